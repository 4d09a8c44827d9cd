"""Files for reference trajectories: places, meetings, angles and speeds in every setting."""

from __future__ import annotations

from collections.abc import Iterator

from support.oracle.actions import beside, gap, limits, profile, timing
from support.oracle.conditions import collision_time, headway
from support.oracle.settings import BEGIN, SETTINGS, Case, case, moving
from support.scenarios.files import (
    by_entity,
    event,
    on_lane,
    private,
    speed,
    story,
    synchronize,
    teleport,
    time,
    to,
    trajectory,
    vehicle,
)

# places that refer to the ego, by name
PLACES = {
    "relative_lane": '<RelativeLanePosition entityRef="ego" dLane="0" ds="25"/>',
    "relative_road": '<RelativeRoadPosition entityRef="ego" ds="20" dt="1.5"/>',
    "relative_object": '<RelativeObjectPosition entityRef="ego" dx="20" dy="1.5"/>',
    "relative_world": '<RelativeWorldPosition entityRef="ego" dx="15" dy="1"/>',
}
FINAL = '<FinalSpeed><AbsoluteSpeed value="{}"/></FinalSpeed>'
# where both meet, by setting: the ego's place and the other one's
MEETINGS = {
    "straight": (on_lane(-2, 190), on_lane(-1, 200)),
    "hill": (on_lane(-2, 150), on_lane(-1, 160)),
    "reverse": (on_lane(-2, 160), on_lane(-1, 160)),
    "on_foot": (on_lane(-2, 160), on_lane(-1, 140)),
    "oncoming": (on_lane(-1, 190), on_lane(1, 220)),
    "crossing": (on_lane(-1, 190), on_lane(-1, 180, road=2)),
}
LINES = {
    "straight": ((140.0, -1.75), (180.0, -1.75), (200.0, 8.0)),
    "hill": ((100.0, -1.75), (140.0, -1.75), (180.0, -5.25)),
    "reverse": ((194.0, -1.75), (160.0, -1.75), (130.0, -5.25)),
    "oncoming": ((290.0, 1.75), (250.0, 1.75), (220.0, 6.0)),
    "crossing": ((201.75, -100.0), (201.75, -60.0), (220.0, -40.0)),
}


def places() -> Iterator[Case]:
    for setting in SETTINGS:
        for name, place in PLACES.items():
            yield case(f"place_{name}", setting, teleport(place), end=5.0)
    for name, lane, ds in (("out", 2, 20), ("back", -2, -20)):
        place = f'<RelativeLanePosition entityRef="ego" dLane="1" ds="{ds}" offset="0.5"/>'
        parts = case("x", "arc", teleport(place)).parts
        begin = moving("ego", on_lane(lane, 150), 12) + moving("other", on_lane(-1, 190), 10)
        yield Case(f"place_relative_lane_{name}_arc", "curve", parts | {"init": begin}, 5.0)
    yield from places_beyond_a_road()


def places_beyond_a_road() -> Iterator[Case]:
    """Places that lie on the next road, and on the one before."""
    for name, road, s, ds in (("next", 1, 70, 50), ("before", 2, 20, -70)):
        for kind, shift in (("lane", 'dLane="0"'), ("road", 'dt="0.5"')):
            tag = f"Relative{kind.title()}Position"
            action = teleport(f'<{tag} entityRef="ego" ds="{ds}" {shift}/>')
            parts = {
                "entities": vehicle("ego") + vehicle("other"),
                "init": moving("ego", on_lane(-1, s, road=road), 10)
                + moving("other", on_lane(-1, 40), 8),
                "stories": story(event("e", private(action), time(BEGIN))),
            }
            yield Case(f"place_relative_{kind}_{name}_fork", "fork", parts, 3.0)


def meetings() -> Iterator[Case]:
    for setting, (its, own) in MEETINGS.items():
        v = -4.0 if setting == "reverse" else 1.2 if setting == "on_foot" else 7.0
        for name, final in (("plain", ""), ("final", FINAL.format(v))):
            action = synchronize("ego", its, own, final, 0.5)
            yield case(f"meets_{name}", setting, action, end=12.0)


def lines() -> Iterator[Case]:
    for setting, points in LINES.items():
        yield case("line", setting, trajectory(*points))
        times = ((x, y, None, 3.0 * k) for k, (x, y) in enumerate(points))
        yield case("line_timed", setting, trajectory(*times, timing=timing()))


def speeds() -> Iterator[Case]:
    """Profiles of speed, and what waits for a speed of its own or beside that of the ego."""
    for setting, (_, _, _, other) in SETTINGS.items():
        sign = -1.0 if 'value="-6"' in other else 1.0
        slow = setting == "on_foot"
        entries = ((2.5, 2), (0.5, 3)) if slow else ((14 * sign, 2), (5 * sign, 4))
        yield case("profile_two", setting, profile(*entries))
        bound = 0.9 * sign if slow else 7.05 * sign
        rule = "greaterThan" if sign < 0 else "lessThan"
        if sign < 0:
            bound = -3.05
        slower = speed(to(0.2 if slow else 2 * sign), "linear", 4)
        condition = f'<SpeedCondition value="{bound}" rule="{rule}"/>'
        from_there = case(
            "when_slower", setting, speed(to(sign), "linear", 1), when=by_entity(condition, "other")
        )
        parts = from_there.parts | {
            "stories": case("x", setting, slower).parts["stories"].replace("story", "first")
            + from_there.parts["stories"]
        }
        yield Case(from_there.name, from_there.road, parts)


STEADY = """<FinalSpeed><AbsoluteSpeed value="{}"><TargetDistanceSteadyState distance="6"/>
</AbsoluteSpeed></FinalSpeed>"""
RELATIVE = '<FinalSpeed><RelativeSpeedToMaster value="-5"/></FinalSpeed>'


def more_meetings() -> Iterator[Case]:
    for setting, (its, own) in MEETINGS.items():
        if setting == "reverse":
            continue  # esmini does not arrive
        v = 1.2 if setting == "on_foot" else 7.0
        yield case(
            "meets_steady", setting, synchronize("ego", its, own, STEADY.format(v), 0.5), end=12.0
        )
        if setting != "on_foot":
            yield case(
                "meets_relative", setting, synchronize("ego", its, own, RELATIVE, 0.5), end=12.0
            )


def distances() -> Iterator[Case]:
    """Distances across the road and along it, where the other one backs, walks or comes towards."""
    for setting in ("reverse", "on_foot", "crossing", "oncoming", "hill"):
        if setting != "crossing":
            aside = beside(2.5, "left", axes="road", limits='maxSpeed="0.4"')
            yield case("beside_slowly", setting, aside)
        for name, how in (("gap", "distance"), ("time", "timeGap")):
            kept = gap(
                f'{how}="{20 if how == "distance" else 2}" freespace="true"',
                continuous=True,
                side="behind",
                limits=limits(2, 3),
            )
            yield case(f"behind_{name}", setting, kept)


def waits() -> Iterator[Case]:
    """The ego waits for a speed, a time to collision or a headway while the other one slows down."""
    slower = {"reverse": -1.0, "on_foot": 0.3}
    for setting in ("straight", "hill", "reverse", "on_foot", "oncoming", "crossing"):
        slows = speed(to(slower.get(setting, 2.0)), "linear", 6)
        between = 0.5 * (
            slower.get(setting, 2.0) + {"reverse": -6.0, "on_foot": 1.5}.get(setting, 10.0)
        )
        ego = {"reverse": 8.0, "on_foot": 8.0}.get(setting, 12.0)
        rule = "greaterThan" if between < 0.0 else "lessThan"
        value = f'value="{between - ego + 0.011:.3f}" rule="{rule}"'
        relative = f'<RelativeSpeedCondition entityRef="ego" {value}/>'
        conditions = [("relative_speed", by_entity(relative, "other"))]
        if setting != "crossing":
            conditions.append(("collision", by_entity(collision_time(2.51), "ego")))
        if setting not in ("crossing", "oncoming"):
            conditions += [
                ("headway", by_entity(headway(1.51), "ego")),
                ("headway_road", by_entity(headway(1.51, "road"), "ego")),
            ]
        for name, condition in conditions:
            first = case("x", setting, slows)
            then = event("ego_e", private(speed(to(5), "linear", 2)), condition)
            stories = first.parts["stories"] + story(
                then, actor="ego", name="ego_story", start=time(BEGIN)
            )
            yield Case(
                f"ego_waits_{name}_{setting}", first.road, first.parts | {"stories": stories}
            )


def everywhere() -> Iterator[Case]:
    yield from waits()
    yield from more_meetings()
    yield from distances()
    yield from places()
    yield from meetings()
    yield from lines()
    yield from speeds()
