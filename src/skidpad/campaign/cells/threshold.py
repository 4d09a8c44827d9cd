"""The runs of the threshold map: how near, how hard the lead brakes, on how much friction.

The catalogue's lead slowdown, with its distances and speeds drawn around other values. The road is
equally slippery for all and looks dry, so that friction alone differs between levels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, NamedTuple

from msgspec import structs

from skidpad.campaign.cells.grip import scenario_of
from skidpad.core.courses import ActorMode, Scenario
from skidpad.core.errors import ConfigError, require_choice, require_range
from skidpad.core.geometry import kmh_from_mps
from skidpad.core.run import AdasDriver, CameraDriver, DriverSpec, Function, RunSpec
from skidpad.core.text.told import describe_value
from skidpad.core.vocabulary import GripModel, SensorLevel
from skidpad.physics.grip import statistical_ratio
from skidpad.physics.presets import preset
from skidpad.scenarios.shipped import find_shipped
from skidpad.scenarios.variation import drawn_parameters, drawn_skill

LEAD = "lead_slowdown"
EGO_S = 100.0  # m, where the file puts the ego
HALVES = 0.5 * (3.81 + 4.69)  # m, half of each length: centres to bumpers
REACTION = 0.5  # s of driving before the lead brakes, so that every driver has seen it
DRIVERS: dict[str, DriverSpec] = {
    "acc": AdasDriver(label="acc", functions=frozenset({Function.ACC, Function.LCA})),
    "aeb": AdasDriver(label="aeb", functions=frozenset({Function.AEB, Function.LCA})),
    "camera": CameraDriver(),
}
HEADWAY_RANGE, DECELERATION_RANGE, LEVEL_RANGE = (0.3, 5.0), (0.5, 10.0), (0.06, 1.0)
# The public challenge puts the lead 25 m ahead of the trigger, at 10 m/s (FollowLeadingVehicle of
# carla-simulator/scenario_runner, `_first_vehicle_location`, `_first_vehicle_speed`).
CHALLENGE, CHALLENGE_S, CHALLENGE_V = "25m", 25.0, 10.0
# Weathers of the study whose statistical ratios are among the levels, so that its claims can be judged.
PRESETS = ("icy_0", "icy_10", "rain_40", "rain_60", "icy_30", "icy_70", "icy_100")
BETWEEN = (0.83, 0.55, 0.22, 0.11)  # shares of dry friction that fill the gaps between them


class Start(NamedTuple):
    """Where the lead drives when it begins to brake."""

    name: str
    v: float  # m/s of both
    gap: float  # m, bumper to bumper


@dataclass(frozen=True, slots=True, kw_only=True)
class Levels:
    """The values that a threshold map varies."""

    drivers: Sequence[DriverSpec]
    modes: Sequence[ActorMode]
    starts: Sequence[Start]
    decelerations: Sequence[float]  # m/s^2
    shares: Sequence[float]  # of dry friction


def default_shares() -> list[float]:
    """Returns shares of dry friction, dry first: those that PRESETS leave, and BETWEEN."""
    known = [_ratio(name) for name in PRESETS]
    return sorted({*known, *BETWEEN}, reverse=True)


def preset_of(share: float) -> str:
    """Returns the weather of PRESETS that leaves exactly this share of dry friction; "": none does."""
    return next((name for name in PRESETS if _ratio(name) == share), "")


def _ratio(name: str) -> float:
    """Returns a weather's grip ratio by the statistical model, rounded to 4 digits."""
    return round(statistical_ratio(preset(name)), 4)


def start_of_text(text: str) -> Start:
    """Returns a start of text: "0.6" is a headway in s at the file's speed, "25m" the challenge's start.

    Raises ConfigError for another text or out of HEADWAY_RANGE.
    """
    if text == CHALLENGE:
        return Start(CHALLENGE, CHALLENGE_V, CHALLENGE_S - HALVES)
    headway = number("--headways", text, HEADWAY_RANGE, f" or {CHALLENGE}")
    v = find_shipped(LEAD).parameters["EgoSpeed"]
    return Start(f"{headway:g}s", v, headway * v)


def number(option: str, text: str, allowed: tuple[float, float], otherwise: str = "") -> float:
    """Returns the finite number in a text; ConfigError, naming `option`, for another or not in `allowed`.

    otherwise: what else the option takes, for the sentence of the error.
    """
    low, high = allowed
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise ConfigError(
            f"{option} takes numbers between {low:g} and {high:g}{otherwise}, got {describe_value(text, 100)}"
        )
    require_range(option, value, low, high)
    return value


def driver_named(name: str) -> DriverSpec:
    """Returns the driver of this name in DRIVERS; ConfigError for an unknown one."""
    return DRIVERS[require_choice("--drivers", name, list(DRIVERS))]


@dataclass(frozen=True, slots=True)
class Task:
    """One run of the map, with what it was asked to be before a seed varied it."""

    run: RunSpec
    start: Start
    deceleration: float  # m/s^2
    share: float  # of dry friction

    @property
    def name(self) -> str:
        """Returns the run's name, by which its folder is found."""
        return self.run.name

    @property
    def deadline_s(self) -> float:
        """Returns the wall time in s after which the run counts as hanging."""
        return self.run.deadline_s

    @property
    def mode(self) -> ActorMode:
        """Returns how the lead is moved."""
        return scenario_of(self.run).actors

    def to_identity(self) -> dict[str, Any]:
        """Returns everything that decides the run, as plain data."""
        return self.run.to_identity()


def tasks(template: RunSpec, levels: Levels, seeds: range) -> list[Task]:
    """Returns a task for every combination, the rest as in `template`; seeds vary slowest."""
    return [
        Task(
            _run(_driven_by(template, driver, seed), mode, start, braking, share),
            start,
            braking,
            share,
        )
        for seed in seeds
        for driver in levels.drivers
        for mode in levels.modes
        for start in levels.starts
        for braking in levels.decelerations
        for share in levels.shares
    ]


def _driven_by(template: RunSpec, driver: DriverSpec, seed: int) -> RunSpec:
    """Returns the run with a driver; pixels are drawn for those that see images alone."""
    sees = isinstance(driver, CameraDriver)
    sensors = SensorLevel.PIXELS if sees else template.sensors
    return structs.replace(template, seed=seed, driver=driver, sensors=sensors)


def _run(run: RunSpec, mode: ActorMode, start: Start, braking: float, share: float) -> RunSpec:
    """Returns the run of a start, a braking of the lead in m/s² and a share of the reference grip."""
    nominal = {
        "EgoSpeed": start.v,
        "LeadSpeed": start.v,
        "LeadS": EGO_S + HALVES + start.gap,
        "TriggerDistance": REACTION * start.v,
        "Deceleration": braking,
    }
    course = Scenario(
        file=LEAD,
        parameters=dict(drawn_parameters(LEAD, run.seed, nominal=nominal)),
        variant=f"{run.driver.label}-{mode.value}-{start.name}-{braking:g}-{share:g}",
        skill=drawn_skill(LEAD, run.seed),
        end_on_collision=True,  # B-094
        actors=mode,
    )
    mu = share * run.settings.world.mu_ref
    settings = run.settings.with_values({"mu_ref": mu, "grip": GripModel.NONE})
    return structs.replace(run, course=course, settings=settings)


def title_of(start: Start) -> str:
    """Returns a start of the scenario in words."""
    if start.name == CHALLENGE:
        return f"25 m at {kmh_from_mps(start.v):.0f} km/h"
    return f"{start.name.removesuffix('s')} s at {kmh_from_mps(start.v):.0f} km/h"
