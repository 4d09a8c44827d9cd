"""L-3: which number an actor has changes nothing: not for cameras, not for the radar, not for the stack."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from skidpad.campaign.runs.run import run
from skidpad.core.frames import Frame
from skidpad.core.inputs import Outside
from skidpad.core.setup import Setup
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import LightState, SensorLevel
from skidpad.physics.presets import find_weather
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.simulation.sensing import CameraRadarReadings, Sensing, sensing_of
from support.runs import adas_run


class OtherNumbers:
    """The sensors of a world in which all but the ego have other numbers."""

    def __init__(self, inner: Sensing, order: NDArray[np.intp]) -> None:
        self.inner, self.order = inner, order

    def read(
        self,
        tick: int,
        states: ActorStates,
        lights: Mapping[int, LightState],
        braking: NDArray[np.bool_],
    ) -> CameraRadarReadings:
        mixed = ActorStates(*(column[self.order] for column in states))
        lit = braking[self.order] if len(braking) else braking  # empty where nobody sees lamps
        return self.inner.read(tick, mixed, lights, lit)

    def change(self, outside: Outside) -> None:
        self.inner.change(outside)


class Renumbered(EmbeddedBackend):
    """The same world, seen with other numbers."""

    def reset(self, setup: Setup, seed: int) -> Frame:
        super().reset(setup, seed)
        table = self.world.table
        order = 1 + np.random.default_rng(seed).permutation(len(table) - 1)
        order = np.concatenate([[0], order])
        assert (order != np.arange(len(table))).sum() > len(table) / 2
        mixed = ActorTable(**{f.name: taken(getattr(table, f.name), order) for f in fields(table)})
        self.sensing = OtherNumbers(sensing_of(self.map, mixed, setup, seed), order)
        return self._frame()

    def _frame(self) -> Frame:
        frame = super()._frame()
        contacts = tuple(replace(c, actor=c.actor and 1000 - c.actor) for c in frame.contacts)
        return replace(frame, contacts=contacts)


def taken(column: Any, order: NDArray[np.intp]) -> Any:
    return tuple(column[i] for i in order) if isinstance(column, tuple) else column[order]


@pytest.mark.req("L-3")
@pytest.mark.parametrize(
    ("level", "weather", "configuration", "seconds"),
    [
        ("objects", "rain-night", 2, 60.0),
        ("objects", "clear-noon", 0, 40.0),
        ("pixels", "rain-night", 3, 6.0),
    ],
)
def test_other_numbers_give_the_same_drive(
    level: str, weather: str, configuration: int, seconds: float
) -> None:
    spec = adas_run(
        configuration,
        find_weather(weather),
        duration=seconds,
        sensors=SensorLevel(level),
    )
    plain, renumbered = run(spec).log, run(spec, backend=Renumbered()).log
    for a, b in zip(plain.requested, renumbered.requested, strict=True):
        np.testing.assert_array_equal(a, b)
    for a, b in zip(plain.actors, renumbered.actors, strict=True):
        np.testing.assert_array_equal(a, b)
    assert plain.v_ego.max() > 5.0
