"""Files for reference trajectories: speeds after another entity, rooms beside it, groups that begin again."""

from __future__ import annotations

from collections.abc import Iterator

from support.oracle.actions import assigned, lane_change, relative
from support.oracle.settings import BEGIN, SETTINGS, Case, case, moving
from support.scenarios.files import (
    by_entity,
    event,
    init,
    on_lane,
    private,
    speed,
    state,
    story,
    teleport,
    time,
    to,
    vehicle,
)


def ego_speeds(v: float, seconds: float = 4.0, t: float = 1.975) -> str:
    action = private(speed(to(v), "linear", seconds))
    return story(event("ego_e", action, time(t)), actor="ego", name="ego_story")


def speeds() -> Iterator[Case]:
    """The speed of another entity changes while it is aimed at, by time, by rate and at once."""
    for name, how in (
        ("time", ("sinusoidal", 3)),
        ("rate", ("linear", 2, "rate")),
        ("distance", ("linear", 30, "distance")),
        ("step", ("step", 0)),
    ):
        for kept in (False, True):
            action = speed(relative(3, continuous=kept), *how)
            label = f"speed_moving_{name}{'_kept' if kept else ''}"
            yield case(label, "straight", action, more=ego_speeds(20))
    for setting in ("curve", "hill", "reverse", "oncoming", "crossing", "on_foot"):
        action = speed(relative(-2), "linear", 2)
        yield case("speed_moving", setting, action, more=ego_speeds(6, 3.0))
    too_fast = speed(relative(0, continuous=True), "step")
    yield case("speed_within_limits", "straight", too_fast, more=ego_speeds(40, 1.0))


def speeds_from_the_begin() -> Iterator[Case]:
    """A speed that is kept to another one's from the begin is there at time 0."""
    kept = speed(relative(2, continuous=True))
    parts = {
        "entities": vehicle("ego") + vehicle("other"),
        "init": moving("ego", on_lane(-2, 100), 12)
        + init("other", teleport(on_lane(-1, 130)), kept),
        "stories": ego_speeds(20),
    }
    yield Case("init_speed_kept_straight", "straight", parts, 6.0)


CLEAR = """<RelativeClearanceCondition freeSpace="{}" distanceForward="{}" distanceBackward="20"
oppositeLanes="{}"><RelativeLaneRange from="-3" to="3"/></RelativeClearanceCondition>"""


def rooms() -> Iterator[Case]:
    """A lane change once there is room, with and without the lanes of the other direction."""
    change = lane_change('<AbsoluteTargetLane value="-2"/>')
    for setting in ("oncoming", "straight", "curve", "hill"):
        for free in ("true", "false"):
            for opposite in ("true", "false"):
                name = f"when_room{'_free' * (free == 'true')}{'_both' * (opposite == 'true')}"
                condition = by_entity(CLEAR.format(free, 15.03, opposite), "ego")
                yield case(name, setting, change, when=condition)


def group_twice() -> Iterator[Case]:
    """A group that is told twice: what waits for one of its events waits again."""
    events = (
        event("fast", private(speed(to(14), "linear", 1)), time(BEGIN)),
        event("slow", private(speed(to(6), "linear", 2)), state("event", "fast", "completeState")),
    )
    _, _, ego, other = SETTINGS["straight"]
    twice = story(*events).replace('maximumExecutionCount="1"', 'maximumExecutionCount="2"')
    parts = {"entities": vehicle("ego") + vehicle("other"), "init": ego + other, "stories": twice}
    yield Case("group_twice_straight", "straight", parts)


def added(place: str) -> str:
    return f"""<GlobalAction><EntityAction entityRef="other"><AddEntityAction><Position>{place}
</Position></AddEntityAction></EntityAction></GlobalAction>"""


DELETED = """<GlobalAction><EntityAction entityRef="other"><DeleteEntityAction/></EntityAction>
</GlobalAction>"""


def coming() -> Iterator[Case]:
    """An entity that is there is not added once more; one that is added moves on in that step."""
    _, _, ego, other = SETTINGS["straight"]
    twice = story(event("add", added(on_lane(-2, 300)), time(BEGIN)))
    again = story(
        event("remove", DELETED, time(BEGIN)),
        event("add", added(on_lane(-1, 400)), time(2.975)),
    )
    for name, stories in (("add_twice", twice), ("add_again", again)):
        parts = {
            "entities": vehicle("ego") + vehicle("other"),
            "init": ego + other,
            "stories": stories,
        }
        yield Case(f"{name}_straight", "straight", parts, 6.0)


def places_on_routes() -> Iterator[Case]:
    """Places along a route, on a lane of it with an offset, ahead and against the road."""
    for name, lane, a, b in (("ahead", -1, 50, 300), ("against", 1, 300, 50)):
        points = "".join(
            f'<Waypoint routeStrategy="shortest"><Position>{on_lane(lane, s)}</Position></Waypoint>'
            for s in (a, b)
        )
        route = f'<RouteRef><Route name="r" closed="false">{points}</Route></RouteRef>'
        inside = f'<FromLaneCoordinates pathS="70" laneId="{lane}" laneOffset="0.6"/>'
        place = f"<RoutePosition>{route}<InRoutePosition>{inside}</InRoutePosition></RoutePosition>"
        parts = {
            "entities": vehicle("ego") + vehicle("other"),
            "init": moving("ego", on_lane(-2, 100), 12) + moving("other", on_lane(lane, 130), 8),
            "stories": story(event("e", private(teleport(place)), time(BEGIN))),
        }
        yield Case(f"place_on_route_{name}", "curve", parts, 5.0)


def routes() -> Iterator[Case]:
    """Along a route through a fork, on the own lane and on that of the other direction."""
    for name, lane, goal in (("ahead", -1, 3), ("straight_on", -1, 2), ("against", 1, 3)):
        way = assigned(on_lane(-1, 50), on_lane(-1, 60, road=goal))
        heading = "" if lane < 0 else '<Orientation type="relative" h="3.14159265"/>'
        place = on_lane(lane, 60).replace("/>", f">{heading}</LanePosition>")
        parts = {
            "entities": vehicle("ego") + vehicle("other"),
            "init": moving("ego", on_lane(-1, 20), 8) + moving("other", place, 10),
            "stories": story(event("e", way, time(BEGIN))),
        }
        yield Case(f"route_fork_{name}", "fork", parts, 9.0)


def road_ends() -> Iterator[Case]:
    """What stands at the end of a road has no speed: put somewhere else it begins from standstill."""
    both = f"""{private(teleport(on_lane(-1, 300)))}</Action><Action name="go">
{private(speed(to(10), "linear", 3))}"""
    at_end = by_entity('<EndOfRoadCondition duration="0.975"/>', "other")
    parts = {
        "entities": vehicle("ego") + vehicle("other"),
        "init": moving("ego", on_lane(-2, 100), 12) + moving("other", on_lane(-1, 959), 12),
        "stories": story(event("e", both, at_end)),
    }
    yield Case("road_end_again_straight", "straight", parts, 9.0)


def pairs() -> Iterator[Case]:
    yield from road_ends()
    yield from routes()
    yield from speeds()
    yield from speeds_from_the_begin()
    yield from rooms()
    yield from group_twice()
    yield from coming()
    yield from places_on_routes()
