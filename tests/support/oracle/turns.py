"""Files for reference trajectories: angles, trailers and routes in every setting."""

from __future__ import annotations

from collections.abc import Iterator

from support.oracle.actions import assigned, lane_change, lane_offset, shape_of
from support.oracle.settings import BEGIN, SETTINGS, Case, case, moving
from support.scenarios.files import (
    by_entity,
    event,
    on_lane,
    private,
    speed,
    story,
    time,
    to,
    vehicle,
)

HITCH = '<TrailerHitch dx="-1.1"/><Trailer><TrailerRef entityRef="other"/></Trailer><Properties/>'
COUPLER = '<TrailerCoupler dx="3.2"/><Properties/>'
ANGLE = """<AngleCondition angle="0.06" angleTolerance="0.03" angleType="heading"
coordinateSystem="lane"/>"""
ASIDE = {"reverse": -1.5, "oncoming": -1.5, "banked": 2.8}  # m to the left of increasing s


def angles() -> Iterator[Case]:
    """The ego slows down once the other one, which goes aside, has an angle to its lane."""
    for setting in SETTINGS:
        aside = case("x", setting, lane_offset(ASIDE.get(setting, 1.5), a=0.5))
        slow = event("slow", private(speed(to(5), "linear", 2)), by_entity(ANGLE, "other"))
        ego = story(slow, actor="ego", name="ego_story", start=time(BEGIN))
        parts = aside.parts | {"minor": "3", "stories": aside.parts["stories"] + ego}
        yield Case(f"ego_waits_angle_{setting}", aside.road, parts)


def climbing(place: str, *points: tuple[float, float, float | None]) -> str:
    """A line through places whose heights are said, and no pitch: p in `place` is x, y and z."""
    rows = ""
    for x, y, z in points:
        height = "" if z is None else f'{"dz" if "entityRef" in place else "z"}="{z}"'
        rows += f"<Vertex><Position>{place.format(x=x, y=y, z=height)}</Position></Vertex>"
    return shape_of(f"<Polyline>{rows}</Polyline>")


def climbs() -> Iterator[Case]:
    """The ego slows down once the other one, whose line leaves the road upwards, has a pitch."""
    world = '<WorldPosition x="{x}" y="{y}" {z}/>'
    beside = '<RelativeWorldPosition entityRef="other" dx="{x}" dy="{y}" {z}/>'
    ahead = '<RelativeObjectPosition entityRef="other" dx="{x}" dy="{y}" {z}/>'
    up = ((0, 0, None), (20, 1, 1.0), (40, 2, 5.0), (60, 3, 5.0))
    from_140 = tuple((x + 140, y - 1.75, z or 0.0) for x, y, z in up)
    for name, setting, axes, line in (
        ("world", "straight", "world", climbing(world, *from_140)),
        ("relative", "straight", "lane", climbing(beside, *up)),
        ("relative", "hill", "world", climbing(beside, *up)),
        ("object", "curve", "road", climbing(ahead, *up)),
    ):
        pitch = f"""<AngleCondition angle="-0.15" angleTolerance="0.08" angleType="pitch"
coordinateSystem="{axes}"/>"""
        rises = case("x", setting, line)
        slow = event("slow", private(speed(to(5), "linear", 2)), by_entity(pitch, "other"))
        ego = story(slow, actor="ego", name="ego_story", start=time(BEGIN))
        parts = rises.parts | {"minor": "3", "stories": rises.parts["stories"] + ego}
        yield Case(f"ego_waits_climb_{name}_{setting}", rises.road, parts)


def drawn(name: str, road: str, begin: str, action: str, end: float = 9.0) -> Case:
    """The ego draws the other one from the begin and does something at 1 s."""
    tail = "<Properties/></Vehicle>"
    bodies = vehicle("other").replace(tail, f"{COUPLER}</Vehicle>")
    bodies += vehicle("ego").replace(tail, f"{HITCH}</Vehicle>")
    stories = story(event("e", action, time(BEGIN)), actor="ego", name="ego_story")
    parts = {"minor": "3", "entities": bodies, "init": begin, "stories": stories}
    return Case(f"trailer_{name}", road, parts, end)


def trailers() -> Iterator[Case]:
    change = private(lane_change('<AbsoluteTargetLane value="-1"/>', "sinusoidal", 3))
    for road in ("straight", "hill", "banked"):
        yield drawn(road, road, moving("ego", on_lane(-2, 60), 10), change)
    back = private(speed(to(-2), "linear", 2))
    yield drawn("back_straight", "straight", moving("ego", on_lane(-2, 200), 2), back, 6.0)
    turn = assigned(on_lane(-1, 50), on_lane(-1, 60, road=3))
    yield drawn("fork", "fork", moving("ego", on_lane(-1, 60), 8), turn)
    across = private(speed(to(4), "linear", 3))
    yield drawn("cross", "cross", moving("ego", on_lane(-1, 150, road=2), 10), across)


def routes() -> Iterator[Case]:
    """Along a route on one road, and through a fork that the other one reverses through."""
    for road in ("curve", "hill", "banked"):
        way = assigned(on_lane(-1, 100), on_lane(-1, 300))
        parts = case("x", road, lane_offset(0.0)).parts
        yield Case(f"route_{road}", road, parts | {"stories": story(event("e", way, time(BEGIN)))})
    way = assigned(on_lane(-1, 60, road=3), on_lane(-1, 50))
    parts = {
        "entities": vehicle("ego") + vehicle("other"),
        "init": moving("ego", on_lane(-1, 20), 8) + moving("other", on_lane(-1, 30, road=3), -8),
        "stories": story(event("e", way, time(BEGIN))),
    }
    yield Case("route_fork_back", "fork", parts, 9.0)


def ways() -> Iterator[Case]:
    """Routes whose shortest way needs a change of lanes: with another way, and without one."""
    for name, lane, goal in (
        ("detour", -1, on_lane(-1, 60, road=4)),
        ("change", -2, on_lane(-1, 40, road=5)),
    ):
        way = assigned(on_lane(lane, 20), goal)
        parts = {
            "entities": vehicle("ego") + vehicle("other"),
            "init": moving("ego", on_lane(-1, 30, road=2), 8)
            + moving("other", on_lane(lane, 20), 12),
            "stories": story(event("e", way, time(BEGIN))),
        }
        yield Case(f"route_{name}", "detour", parts, 20.0)


def turns() -> Iterator[Case]:
    yield from angles()
    yield from climbs()
    yield from trailers()
    yield from routes()
    yield from ways()
