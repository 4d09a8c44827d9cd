"""Short drives of the reference driver among actors that a test moves, in the embedded world."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from math import inf
from typing import NamedTuple

import numpy as np

from skidpad.campaign.cast import ego_model
from skidpad.core.setup import ActorCommand, ActorSetup, LanePosition, Setup
from skidpad.core.states import VehicleCommand, WorldTruth
from skidpad.core.vocabulary import Control, GripModel, SensorLevel
from skidpad.core.weather import Weather
from skidpad.physics.presets import find_weather
from skidpad.physics.types import EGO_TYPE
from skidpad.roads.bundled import load_map
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.stack.reference.driver import EYES, ReferenceStack
from skidpad.stack.reference.person import Person

DT = 0.05
MEDIAN = Person(reaction=0.9, headway=0.98, speed=1.0, a_max=1.4)
Move = Callable[[int, WorldTruth], Sequence[ActorCommand]]


class Drive(NamedTuple):
    """One row per tick."""

    t: np.ndarray
    v: np.ndarray  # m/s
    gap: np.ndarray  # m to the actor nearest ahead, bumper to bumper; inf: none
    commands: list[VehicleCommand]
    contacts: int
    truths: list[tuple[float, ...]]  # x, y, yaw of the ego


def seat(map: str = "straight", person: Person | None = MEDIAN, seed: int = 0) -> ReferenceStack:
    """A reference stack on a bundled map; person None: the one of the seed."""
    stack = ReferenceStack((), load_map(map), {"seed": seed, "car": asdict(ego_model())})
    if person is not None:
        stack.person = stack.driver.person = person
    return stack


def car(
    name: str, s: float, speed: float = 0.0, lane: int = -2, kind: str = "hatchback"
) -> ActorSetup:
    """A car of the test on the straight road."""
    return ActorSetup(
        name=name,
        type=kind,
        place=LanePosition(road=1, lane=lane, s=s),
        speed=speed,
        driver=Control.SCRIPTED,
    )


def drive(
    *actors: ActorSetup,
    v: float = 0.0,
    seconds: float = 20.0,
    weather: str | Weather = "clear-noon",
    move: Move | None = None,
    stack: ReferenceStack | None = None,
    until: Callable[[WorldTruth], bool] | None = None,
    s: float = 100.0,
) -> Drive:
    """Drive from `s` m with speed v; `move` says what the actors do, else they keep still."""
    stack = seat() if stack is None else stack
    (eyes,) = stack.sensors()
    found = find_weather(weather) if isinstance(weather, str) else weather
    setup = Setup(
        map="straight",
        weather=found,
        specs=(eyes,),
        asked=frozenset({EYES}),
        ego=replace(car("ego", s, v), type=EGO_TYPE),
        actors=actors,
        grip=GripModel.PHYSICAL,
        stability=True,
        level=SensorLevel.OBJECTS,
    )
    backend = EmbeddedBackend()
    frame = backend.reset(setup, 1)
    rows: list[tuple[float, float, float]] = []
    commands, places, contacts = [], [], 0
    for k in range(round(seconds / DT)):
        truth = backend.truth()
        rows.append((k * DT, frame.ego.speed, gap_ahead(truth)))
        places.append((frame.ego.pose.x, frame.ego.pose.y, frame.ego.pose.yaw))
        contacts += len(truth.contacts)
        if until is not None and until(truth):
            break
        commands.append(stack.tick(frame))
        told = () if move is None else move(k, truth)
        frame = backend.step(commands[-1], told)
    t, speeds, gaps = np.array(rows).T
    return Drive(t, speeds, gaps, commands, contacts, places)


def gap_ahead(truth: WorldTruth) -> float:
    """m from the ego's front to the nearest rear ahead in its lane of the straight road."""
    s, table = truth.states, truth.table
    best = inf
    for i in range(1, len(table)):
        if s.present[i] and s.x[i] > s.x[0] and abs(s.y[i] - s.y[0]) < 2.0:
            best = min(best, float(s.x[i] - s.x[0] - 0.5 * (table.length[i] + table.length[0])))
    return best
