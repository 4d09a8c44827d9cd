"""Compares the reference driver with published distributions of human drivers: writes a CSV and its table.

    PYTHONPATH=src:tools python tools/reference_driver.py

Each person of the seeds drives closed scenarios. What is measured was not
used to choose any number of the model; docs/reference-driver.csv holds both sides.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, replace
from math import inf, pi
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.campaign.driving.stack_at_wheel import ego_model
from skidpad.core.setup import ActorCommand, ActorSetup, LanePosition, Setup
from skidpad.core.states import VehicleCommand, WorldTruth
from skidpad.core.traffic.sight import DriverView, RoadLook, SeenActors
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
PEOPLE = range(1, 201)  # seeds
CSV = Path(__file__).parents[1] / "docs" / "reference-driver.csv"
PRESSED = 0.02  # of full brake, from which the foot is on it
WATCHED = 6.0  # s after the event in which the brake is waited for
V_OBSTACLE, TTC_OBSTACLE = 20.0, 4.0  # m/s, s: a barrier stands up that far ahead
V_LEAD, BRAKE_LEAD = 20.0, 0.45  # m/s, pedal: about 4.5 m/s^2
SETTLING = 50.0  # s behind a steady leader, of which the last count

Floats = NDArray[np.float64]
Move = Callable[[int, WorldTruth], Sequence[ActorCommand]]


class Drive(NamedTuple):
    """One row per tick of a short drive."""

    t: Floats
    v: Floats  # m/s
    gap: Floats  # m to the actor nearest ahead, bumper to bumper; inf: none
    commands: list[VehicleCommand]
    contacts: int

    def brakes_after(self, tick: int) -> float | None:
        """s from a tick until the foot is on the brake; None: not within WATCHED."""
        for k in range(tick, min(tick + round(WATCHED / DT), len(self.commands))):
            if self.commands[k].brake > PRESSED:
                return (k - tick) * DT
        return None


def seat(map: str = "straight", person: Person | None = MEDIAN, seed: int = 0) -> ReferenceStack:
    """A reference stack on a bundled map; person None: the one of the seed."""
    stack = ReferenceStack((), load_map(map), {"seed": seed, "car": asdict(ego_model())})
    if person is not None:
        stack.person = stack.driver.person = person
    return stack


def car(
    name: str, s: float, speed: float = 0.0, lane: int = -2, kind: str = "hatchback"
) -> ActorSetup:
    """An actor on the straight road, moved by commands alone."""
    place = LanePosition(road=1, lane=lane, s=s)
    return ActorSetup(name=name, type=kind, place=place, speed=speed, driver=Control.SCRIPTED)


def drive(
    *actors: ActorSetup,
    v: float = 0.0,
    seconds: float = 20.0,
    weather: str | Weather = "clear-noon",
    move: Move | None = None,
    stack: ReferenceStack | None = None,
    until: Callable[[WorldTruth], bool] | None = None,
) -> Drive:
    """Drive from 100 m on with speed v; `move` says what the actors do, else they keep still."""
    stack = seat() if stack is None else stack
    (eyes,) = stack.sensors()
    setup = Setup(
        map="straight",
        weather=find_weather(weather) if isinstance(weather, str) else weather,
        specs=(eyes,),
        asked=frozenset({EYES}),
        ego=replace(car("ego", 100.0, v), type=EGO_TYPE),
        actors=actors,
        grip=GripModel.PHYSICAL,
        stability=True,
        level=SensorLevel.OBJECTS,
    )
    backend = EmbeddedBackend()
    frame = backend.reset(setup, 1)
    rows: list[tuple[float, float, float]] = []
    commands: list[VehicleCommand] = []
    contacts = 0
    for k in range(round(seconds / DT)):
        truth = backend.truth()
        rows.append((k * DT, frame.ego.speed, gap_ahead(truth)))
        contacts += len(truth.contacts)
        if until is not None and until(truth):
            break
        commands.append(stack.tick(frame))
        frame = backend.step(commands[-1], () if move is None else move(k, truth))
    t, speeds, gaps = np.array(rows).T
    return Drive(t, speeds, gaps, commands, contacts)


def gap_ahead(truth: WorldTruth) -> float:
    """m from the ego's front to the nearest rear ahead in its lane of the straight road."""
    s, table = truth.states, truth.table
    ahead = s.present & (s.x > s.x[0]) & (np.abs(s.y - s.y[0]) < 2.0)
    gaps = s.x - s.x[0] - 0.5 * (table.length + table.length[0])
    return float(np.min(gaps[ahead], initial=inf))


# --- what is compared


def reaction_to_an_obstacle(person: Person) -> float | None:
    """s from a barrier that stands up in the lane until the foot is on the brake."""
    begin = 20

    def move(k: int, truth: WorldTruth) -> list[ActorCommand]:
        del truth
        return [ActorCommand("barrier", present=True)] if k == begin else []

    ahead = 100.0 + V_OBSTACLE * (begin * DT + TTC_OBSTACLE)
    barrier = replace(car("barrier", ahead, kind="barrier"), present=False)
    log = drive(barrier, v=V_OBSTACLE, seconds=8.0, move=move, stack=seat(person=person))
    return log.brakes_after(begin)


def reaction_to_a_leader(person: Person) -> float | None:
    """s from a leader's brake lamps until the foot is on the brake, from steady following."""
    begin = 60

    def move(k: int, truth: WorldTruth) -> list[ActorCommand]:
        if k >= begin:
            return [ActorCommand("lead", command=VehicleCommand(brake=BRAKE_LEAD))]
        return [steady(truth)]

    gap = 2.0 + person.headway * V_LEAD
    lead = car("lead", 100.0 + gap + 4.2, V_LEAD)
    log = drive(lead, v=V_LEAD, seconds=10.0, move=move, stack=seat(person=person))
    return log.brakes_after(begin)


def steady_gap(person: Person) -> float:
    """m to a leader that keeps its speed, once the gap has settled."""
    lead = car("lead", 150.0, V_LEAD)
    log = drive(
        lead, v=V_LEAD, seconds=SETTLING, move=lambda _, truth: [steady(truth)],
        stack=seat(person=person),
    )  # fmt: skip
    return float(np.mean(log.gap[-100:]))


def steady(truth: WorldTruth) -> ActorCommand:
    """The leader keeps V_LEAD."""
    error = V_LEAD - float(np.hypot(truth.states.vx[1], truth.states.vy[1]))
    return ActorCommand("lead", command=VehicleCommand(throttle=min(max(0.12 + error, 0.0), 1.0)))


def accepted_gap(person: Person) -> float:
    """s of the shortest gap that is entered from a stop line of the town, by halving.

    The car has halted; another comes at V_MAJOR on the road that is joined. Counted is the time
    until its front is at the middle of the junction.
    """
    stack, map = seat("town", person), load_map("town")
    place = map.at(STOP_LANE, STOP_S - 0.5 * stack.driver.car.length - 1.5)

    def enters(gap: float) -> bool:
        stack.driver.reset()
        stack.driver.halted = STOP_SIGN
        y = -V_MAJOR * gap - 0.5 * LENGTH_LEAD
        x, z, yaw, still, v = (np.array([c]) for c in (X_MAJOR, 0.0, 0.5 * pi, 0.0, V_MAJOR))
        length, width, lamps = np.array([LENGTH_LEAD]), np.array([1.8]), np.zeros(1, np.bool_)
        id, kind = np.ones(1, np.int64), np.zeros(1, np.uint8)
        seen = SeenActors(id, kind, x, np.array([y]), z, yaw, still, v, length, width, lamps)
        view = DriverView(0, place.pose, 0.0, 0.0, 0.0, seen, {}, RoadLook.DRY, 300.0)
        return stack.driver.act(view).throttle > 0.0

    low, high = 0.0, LONGEST_GAP
    for _ in range(8):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if enters(middle) else (middle, high)
    return high


STOP_LANE, STOP_S, STOP_SIGN = 3, 163.0, 20012  # in town: a minor road meets the ring
X_MAJOR, V_MAJOR = -198.25, 50.0 / 3.6  # m, m/s
LONGEST_GAP = 12.0  # s
LENGTH_LEAD = 3.9  # m; headways count from front to front


class Line(NamedTuple):
    """One statistic of one quantity: what was published, and what the model gives."""

    quantity: str
    statistic: str
    human: float  # s
    source: str
    where: str


LINES = (
    Line(
        "brake reaction to an unexpected obstacle", "mean", 1.1,
        "Fambro, Koppa, Picha and Fitzpatrick (1998), Transportation Research Record 1628", "abstract",
    ),
    Line(
        "brake reaction to an unexpected obstacle", "95 %", 2.0,
        "Fambro, Koppa, Picha and Fitzpatrick (1998), Transportation Research Record 1628", "abstract",
    ),
    Line(
        "brake reaction to a leader's brake lamps", "mean", 1.25,
        "Sivak and Flannagan (1993), Ergonomics 36(4), as quoted by Devore", "example 4.16",
    ),
    Line(
        "brake reaction to a leader's brake lamps", "deviation", 0.46,
        "Sivak and Flannagan (1993), Ergonomics 36(4), as quoted by Devore", "example 4.16",
    ),
    Line(
        "headway of followers, front to front", "mean", 1.32,
        "Wasielewski (1979), Transportation Science 13(1)", "abstract",
    ),
    Line(
        "headway of followers, front to front", "deviation", 0.52,
        "Wasielewski (1979), Transportation Science 13(1)", "abstract",
    ),
    Line(
        "time gap of close followers", "mean", 1.1,
        "Al-Obaedi (2019), International Journal of Engineering 32(5)", "abstract",
    ),
    Line(
        "time gap of close followers", "deviation", 0.42,
        "Al-Obaedi (2019), International Journal of Engineering 32(5)", "abstract",
    ),
    Line(
        "gap entered from a stop line", "50 %", 6.5,
        "Fitzpatrick (1991), Transportation Research Record 1303, pp. 103-112", "abstract",
    ),
    Line(
        "gap entered from a stop line", "85 %", 8.25,
        "Fitzpatrick (1991), Transportation Research Record 1303, pp. 103-112", "abstract",
    ),
)  # fmt: skip


def measured(people: Iterable[Person]) -> dict[str, Floats]:
    """Values of each quantity in s, one per person; who never braked is left out."""
    found: dict[str, list[float]] = {line.quantity: [] for line in LINES}
    obstacle, leader, headway, time_gap, entered = found.values()
    for person in people:
        for values, value in (
            (obstacle, reaction_to_an_obstacle(person)),
            (leader, reaction_to_a_leader(person)),
        ):
            if value is not None:
                values.append(value)
        gap = steady_gap(person)
        headway.append((gap + LENGTH_LEAD) / V_LEAD)
        time_gap.append(gap / V_LEAD)
        entered.append(accepted_gap(person))
    return {name: np.array(values) for name, values in found.items()}


def statistic(name: str, values: Floats) -> float:
    """The mean, the deviation or a quantile."""
    if name == "mean":
        return float(values.mean())
    if name == "deviation":
        return float(values.std(ddof=1))
    return float(np.quantile(values, float(name.removesuffix(" %")) / 100.0))


def compared(values: dict[str, Floats]) -> Iterator[tuple[Line, float]]:
    """Each published statistic with the model's."""
    for line in LINES:
        yield line, statistic(line.statistic, values[line.quantity])


def write(values: dict[str, Floats], path: Path = CSV) -> None:
    """The CSV of both sides."""
    with path.open("w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(("quantity", "statistic", "human_s", "model_s", "people", "source", "where"))
        for line, model in compared(values):
            n = len(values[line.quantity])
            numbers = line.human, f"{model:.2f}", n
            out.writerow((line.quantity, line.statistic, *numbers, line.source, line.where))


def table(path: Path = CSV) -> str:
    """The CSV as the page's table."""
    rows = ["| quantity | | humans, s | model, s | difference |", "|---|---|---|---|---|"]
    with path.open() as file:
        for row in csv.DictReader(file):
            human, model = float(row["human_s"]), float(row["model_s"])
            change = 100.0 * (model / human - 1.0)
            rows.append(
                f"| {row['quantity']} | {row['statistic']} | {human:g} | {model:.2f} | {change:+.0f} % |"
            )
    return "\n".join(rows)


if __name__ == "__main__":
    from skidpad.stack.reference.person import person_of

    write(measured(person_of(seed) for seed in PEOPLE))
    print(table())
