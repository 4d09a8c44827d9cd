"""The runs of the friction campaign: scenario, weather, friction, seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from msgspec import structs

from skidpad.campaign.cells.matrix import FIRST_SEED
from skidpad.campaign.driving.drivers import STACK, find_driver
from skidpad.core.courses import Scenario
from skidpad.core.errors import ConfigError
from skidpad.core.run import Friction, RunSpec
from skidpad.core.settings.parts import load_profile
from skidpad.core.vocabulary import GripModel, SensorLevel
from skidpad.core.weather import Weather
from skidpad.scenarios.variation import CUT_IN, CutIn, drawn_parameters, drawn_skill

DURATION = 120.0  # s, unless the file ends before


@dataclass(frozen=True, slots=True, kw_only=True)
class Cross:
    """The values that a grip campaign varies."""

    scenarios: Sequence[str]
    weather: Sequence[Weather]
    frictions: Sequence[Friction] = tuple(Friction)
    cutins: Sequence[CutIn] = (CutIn.FIXED,)
    overlays: Sequence[bool] = (False,)


def template(configuration: int = 2, **changes: Any) -> RunSpec:
    """Returns a run of the catalogue on objects, by our stack; `changes` are fields of it."""
    base = RunSpec(
        driver=find_driver(configuration, label=STACK),
        course=Scenario(file=CUT_IN),
        duration=DURATION,
        settings=load_profile("recommended", {"grip": GripModel.STATISTICAL}),
        sensors=SensorLevel.OBJECTS,
    )
    return structs.replace(base, **changes)


@cache
def drawn_course(scenario: str, seed: int, cutin: CutIn) -> Scenario:
    """Returns the scenario with what a seed varies, the same for every weather and friction (X-8)."""
    return Scenario(
        file=scenario,
        parameters=dict(drawn_parameters(scenario, seed, cutin)),
        variant="" if cutin is CutIn.FIXED else cutin.value,
        skill=drawn_skill(scenario, seed),
        end_on_collision=True,  # B-094
    )


def cross(template: RunSpec, varied: Cross, seeds: range) -> list[RunSpec]:
    """Returns a run for every combination, the rest as in `template`; seeds vary slowest.

    Pairs that are compared so come early.
    """
    return [
        structs.replace(
            template,
            course=structs.replace(drawn_course(s, seed, c), actors=scenario_of(template).actors),
            weather=w,
            friction=f,
            seed=seed,
            overlay=drops,
        )
        for seed in seeds
        for s in varied.scenarios
        for c in (varied.cutins if s == CUT_IN else (CutIn.FIXED,))
        for w in varied.weather
        for drops in varied.overlays
        for f in varied.frictions
    ]


def scenario_of(cell: RunSpec) -> Scenario:
    """Returns the scenario that a run plays; ConfigError when it plays none."""
    if not isinstance(cell.course, Scenario):
        raise ConfigError(f"{cell.name} plays no scenario")
    return cell.course


def seeds(first: int, n: int) -> range:
    """Returns n seeds from FIRST_SEED + `first` on, as reports use them."""
    return range(FIRST_SEED + first, FIRST_SEED + first + n)
