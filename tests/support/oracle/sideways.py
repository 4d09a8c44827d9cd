"""Files for reference trajectories: offsets and sideways distances within limits, ends that begin more."""

from __future__ import annotations

from collections.abc import Iterator

from support.oracle.actions import beside, lane_change, lane_offset, timing
from support.oracle.settings import BEGIN, Case, case, moving
from support.scenarios.files import (
    event,
    init,
    on_lane,
    private,
    speed,
    state,
    story,
    time,
    to,
    trajectory,
    vehicle,
    world,
)


def offsets() -> Iterator[Case]:
    """A long way aside at little speed, and beside an oncoming entity or a walker across the road."""
    wide = lane_offset(3.0, a=3.0)
    yield case("lane_offset_wide", "straight", wide)
    yield case("lane_offset_wide", "curve", wide)
    for setting in ("oncoming", "on_foot", "reverse"):
        yield case("lane_offset_beside", setting, lane_offset(1.5, a=0.5, other="ego"))


def distances() -> Iterator[Case]:
    """Distances across the road, by speed, by acceleration and at once, and in the ego's axes."""
    aside = ego_goes(lane_change('<AbsoluteTargetLane value="-1"/>', "sinusoidal", 3))
    for name, bounds in (
        ("speed", 'maxSpeed="2"'),
        ("both", 'maxSpeed="3" maxAcceleration="4"'),
        ("spring", 'maxAcceleration="2" maxAccelerationRate="4"'),
        ("rigid", ""),
    ):
        for setting in ("straight", "curve", "oncoming", "hill"):
            action = beside(3.0, "left", axes="road", limits=bounds)
            yield case(f"beside_{name}", setting, action, more=aside)
    for setting in ("straight", "curve", "crossing", "on_foot"):
        action = beside(3.0, "left", limits='maxAcceleration="5"')
        yield case("beside_turning", setting, action)


def ego_goes(action: str, t: float = 3.975) -> str:
    return story(event("ego_e", private(action), time(t)), actor="ego", name="ego_story")


def ends() -> Iterator[Case]:
    """What begins as a trajectory ends, and the way of a step that reaches the end."""
    lines = {
        "paced": trajectory((150.0, -1.75), (180.3, -1.75)),
        "timed": trajectory((150.0, -1.75, None, 0.0), (180.3, -1.75, None, 2.98), timing=timing()),
    }
    for name, line in lines.items():
        events = (
            event("line", private(line), time(BEGIN)),
            event("slow", private(speed(to(2))), state("event", "line", "completeState")),
        )
        parts = {
            "entities": vehicle("ego") + vehicle("other"),
            "init": moving("ego", on_lane(-2, 100), 12) + moving("other", on_lane(-1, 130), 10),
            "stories": story(*events),
        }
        yield Case(f"end_begins_{name}", "straight", parts)
    back = trajectory((150.0, -1.75), (180.3, -1.75), attributes='initialDistanceOffset="9"')
    yield case("end_at_begin", "reverse", back)
    line = trajectory((0.0, 0.0), (40.0, 3.0))
    again = event(
        "again",
        private(trajectory((40.0, 3.0), (60.0, 30.0))),
        state("event", "go", "completeState"),
    )
    ego = init("ego", teleported(0, -20), speed(to(8)), trajectory((0, -20), (60, -20)))
    parts = {
        "entities": vehicle("ego") + vehicle("other"),
        "road": "",
        "init": ego + init("other", teleported(0, 0), speed(to(10))),
        "stories": story(event("go", private(line), time(-1.0)), again),
    }
    yield Case("end_begins_no_road", "straight", parts)


def teleported(x: float, y: float) -> str:
    return f"<TeleportAction><Position>{world(x, y, 0)}</Position></TeleportAction>"


def sideways() -> Iterator[Case]:
    yield from offsets()
    yield from distances()
    yield from ends()
