"""Files for reference trajectories: begins and ends of trajectories, ahead and backwards."""

from __future__ import annotations

from collections.abc import Iterator

from support.oracle.actions import timing
from support.oracle.settings import NORTH, Case, case, moving
from support.scenarios.files import (
    event,
    init,
    on_lane,
    private,
    speed,
    story,
    teleport,
    time,
    to,
    trajectory,
    vehicle,
    world,
)


def backwards() -> Iterator[Case]:
    """Trajectories that an entity follows with a negative speed, from their end or against a corner."""
    for name, offset, *points in (
        ("end", 60, (140.0, -1.75, 0.0), (200.0, -1.75, 0.0)),
        ("bend", 30, (150.0, -8.0, 0.0), (170.0, -1.75, 0.0), (208.0, -1.75, 0.0)),
        ("turn", 28, (150.0, -1.75, 0.0), (176.0, -1.75, 0.0), (130.0, -5.25, 0.0)),
        ("climb", 28, (200.0, 40.0, NORTH), (200.0, 0.0, NORTH)),
    ):
        x = f'initialDistanceOffset="{offset}"'
        yield case(f"track_back_{name}", "reverse", trajectory(*points, attributes=x), end=8.0)
        if name != "end":
            yield case(f"track_ahead_{name}", "on_foot", trajectory(*points, attributes=x), end=8.0)


def at_once() -> Iterator[Case]:
    """Trajectories and speeds of one event, which begins at time 0 somewhere on the line."""
    line = trajectory((100.0, -1.75), (240.0, -1.75), attributes='initialDistanceOffset="50"')
    for name, v in (("ahead", 6.0), ("back", -6.0)):
        both = f'{private(speed(to(v)))}</Action><Action name="line">{private(line)}'
        parts = {
            "entities": vehicle("ego") + vehicle("other"),
            "init": moving("ego", on_lane(-2, 100), 12) + init("other", teleport(on_lane(-1, 90))),
            "stories": story(event("e", both, time(-1.0))),
        }
        yield Case(f"track_at_once_{name}", "straight", parts, 6.0)


def without_road() -> Iterator[Case]:
    """Ends of trajectories in a file without a road."""
    lines = {
        "paced": trajectory((0.0, 0.0), (40.0, 3.0)),
        "timed": trajectory((0.0, 0.0, None, 0.0), (40.0, 30.0, None, 4.0), timing=timing()),
        "corner": trajectory((0.0, 0.0), (20.0, 0.0), (20.0, 25.0)),
    }
    ego = init("ego", teleport(world(0, -20, 0)), speed(to(8)), trajectory((0, -20), (60, -20)))
    for name, line in lines.items():
        parts = {
            "entities": vehicle("ego") + vehicle("other"),
            "road": "",
            "init": ego + init("other", teleport(world(0, 0, 0)), speed(to(10)), line),
            "stories": "",
        }
        yield Case(f"track_no_road_{name}", "straight", parts, 8.0)


def at_the_same_time() -> Iterator[Case]:
    """A change of speed and a line that end in one step: the entity goes on at the last speed."""
    line = private(trajectory((150.0, -1.75), (173.75, -1.75)))
    both = f'{line}</Action><Action name="v">{private(speed(to(14), "linear", 2))}'
    parts = {
        "entities": vehicle("ego") + vehicle("other"),
        "init": moving("ego", on_lane(-2, 100), 12) + moving("other", on_lane(-1, 140), 10),
        "stories": story(event("e", both, time(0.975))),
    }
    yield Case("track_end_with_speed_straight", "straight", parts, 6.0)
