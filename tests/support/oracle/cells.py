"""Files for reference trajectories: conditions and actions in the settings that other tables leave out."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, hypot, sin

from support.oracle.actions import (
    beside,
    gap,
    lane_change,
    lane_offset,
    limits,
    relative,
    smooth_profile,
)
from support.oracle.conditions import (
    STOP,
    collision_time,
    headway,
    near,
    towards,
)
from support.oracle.pairs import DELETED, added
from support.oracle.settings import BEGIN, SETTINGS, Case, case, moving
from support.oracle.turns import drawn
from support.scenarios.files import (
    by_entity,
    event,
    on_lane,
    pedestrian,
    private,
    speed,
    state,
    story,
    synchronize,
    time,
    to,
    vehicle,
    world,
)

MOMENT = 3.03  # s, between two steps
RADIUS = 120.0  # m, of the curve, which begins at x = 100 m and turns left
BANK = cos(0.5)  # m seen from above per m across the banked road


def on_arc(s: float, t: float) -> tuple[float, float, float]:
    """Place and heading on the curve at road coordinates."""
    turn = (s - 100.0) / RADIUS
    r = RADIUS - t
    return 100.0 + r * sin(turn), RADIUS - r * cos(turn), turn


# by setting: s, t, speed along increasing s of ego and other; m, m/s
COURSES = {
    "straight": ((100.0, -5.25, 12.0), (130.0, -1.75, 10.0)),
    "arc": ((150.0, -5.25, 12.0), (180.0, -1.75, 10.0)),
    "hill": ((60.0, -5.25, 12.0), (90.0, -1.75, 10.0)),
    "banked": ((60.0, -5.25, 12.0), (90.0, -0.45, 10.0)),
    "oncoming": ((100.0, -1.75, 12.0), (300.0, 1.75, -10.0)),
    "reverse": ((100.0, -5.25, 8.0), (200.0, -1.75, -6.0)),
    "on_foot": ((100.0, -5.25, 8.0), (130.0, -1.75, 1.5)),
}
CROSSING = ((100.0, -1.75, 12.0, 0.0), (201.75, -110.0, 0.0, 10.0))


def road_s(setting: str, who: int, t: float) -> float:
    """Where ego (0) or other (1) is along the road, m."""
    s, left, v = COURSES[setting][who]
    return s + v * t * (RADIUS / (RADIUS - left) if setting == "arc" else 1.0)


def seen(setting: str, who: int, t: float) -> tuple[float, float]:
    """Where ego (0) or other (1) is, m."""
    if setting == "crossing":
        x, y, vx, vy = CROSSING[who]
        return x + vx * t, y + vy * t
    left = COURSES[setting][who][1]
    along = road_s(setting, who, t)
    if setting == "arc":
        return on_arc(along, left)[:2]
    return along, left * (BANK if setting == "banked" else 1.0)


def ego_waits(name: str, setting: str, first: str, condition: str) -> Case:
    """The other one does something at 1 s, and the ego slows down when a condition holds."""
    slow = event("ego_e", private(speed(to(5), "linear", 2)), condition)
    ego = story(slow, actor="ego", name="ego_story", start=time(BEGIN))
    begun = case("x", setting, first)
    parts = begun.parts | {"minor": "3", "stories": begun.parts["stories"] + ego}
    return Case(f"{name}_{setting}", begun.road, parts)


# m to the left of increasing s that the other one goes aside
ASIDE = {"reverse": -1.5, "oncoming": -1.5, "banked": 2.8}


def distances_across() -> Iterator[Case]:
    """The ego waits until the other one, which goes aside, is so far beside it."""
    for setting, (ego, other) in COURSES.items():
        goes = ASIDE.get(setting, 1.5)
        begin = 1.3 if setting == "banked" else 0.0
        before = abs(other[1] - ego[1])
        after = abs(other[1] - begin + goes - ego[1])
        value = round(before + 0.37 * (after - before), 3)
        rule = "lessThan" if after < before else "greaterThan"
        for axes in ("road", "lane", "entity"):
            if axes == "entity" and setting in ("arc", "banked"):
                continue
            body = near(value, "lateral", axes, rule=rule)
            action = lane_offset(goes, a=0.5)
            yield ego_waits(f"ego_waits_beside_{axes}", setting, action, by_entity(body, "other"))


def distances_along() -> Iterator[Case]:
    """The other one brakes when the ego is so far along the road, or so far off, box to box."""
    for setting in COURSES:
        now, later = (
            abs(road_s(setting, 0, t) - road_s(setting, 1, t)) for t in (MOMENT, MOMENT + 0.01)
        )
        rule = "lessThan" if later < now else "greaterThan"
        for axes, free in (("road", "false"), ("road", "true"), ("lane", "false")):
            if axes == "lane" and setting == "arc":
                continue
            value = now - (5.0 if free == "true" and setting != "on_foot" else 0.0)
            body = near(round(value, 3), "longitudinal", axes, free, rule)
            name = f"when_along_{axes}{'_free' * (free == 'true')}"
            yield case(name, setting, STOP, when=by_entity(body, "other"))


def places_reached() -> Iterator[Case]:
    """The other one brakes near a place, at a place, and beside the place along the road."""
    for setting in (*COURSES, "crossing"):
        x, y = seen(setting, 1, MOMENT + 0.4)
        bx, by = seen(setting, 1, MOMENT)
        off = round(hypot(x - bx, y - by), 3)
        place = world(round(x, 3), round(y, 3))
        bodies = {
            "near": towards(place, f'value="{off}" freespace="false" rule="lessThan"'),
            "reached_place": f'<ReachPositionCondition tolerance="{off}"><Position>{place}</Position>'
            "</ReachPositionCondition>",
        }
        if setting in COURSES:
            how = 'relativeDistanceType="longitudinal" coordinateSystem="road"'
            there = road_s(setting, 1, MOMENT + 0.4)
            off = round(abs(there - road_s(setting, 1, MOMENT)), 3)
            lane = 1 if setting == "oncoming" else -1
            bodies["near_road"] = towards(
                on_lane(lane, round(there, 3)),
                f'value="{off}" freespace="false" rule="lessThan" {how}',
            )
        for name, body in bodies.items():
            yield case(f"when_{name}", setting, STOP, when=by_entity(body, "other"))


def chain(name: str, setting: str, *events: str) -> Case:
    road, walks, ego, other = SETTINGS[setting]
    entities = vehicle("ego") + (pedestrian("other") if walks else vehicle("other"))
    parts = {"minor": "3", "entities": entities, "init": ego + other, "stories": story(*events)}
    return Case(f"{name}_{setting}", road, parts, 12.0)


def later(body: str, sign: float = 1.0) -> str:
    action = speed(to(5 * sign), "linear", 2)
    return event("again", private(action), by_entity(body, "other"))


def chains() -> Iterator[Case]:
    """What stands goes on, what brakes goes aside, and what has ended lets something begin."""
    for setting in SETTINGS:
        sign = -1.0 if setting == "reverse" else 1.0
        slow = event("slow", private(speed(to(0), "linear", 2)), time(BEGIN))
        stands = '<StandStillCondition duration="0.975"/>'
        if setting != "straight":
            yield chain("when_stands", setting, slow, later(stands, sign))
        ended = event(
            "again",
            private(speed(to(6 * sign), "linear", 2)),
            state("event", "slow", "completeState"),
        )
        yield chain("when_ended", setting, slow, ended)
        rule = "lessThan" if sign > 0.0 else "greaterThan"
        body = f"""<AccelerationCondition value="{-3 * sign}" rule="{rule}"
direction="longitudinal"/>"""
        if setting not in ("straight", "on_foot", "curve"):
            aside = event("again", private(lane_offset(0.6)), by_entity(body, "other"))
            yield chain("when_acceleration", setting, slow, aside)
    off = '<OffroadCondition duration="0.475"/>'
    for setting in ("arc", "hill"):
        aside = event("aside", private(lane_offset(-12.0, a=4.0)), time(BEGIN))
        yield chain("when_off_road", setting, aside, later(off))


def other_measures() -> Iterator[Case]:
    """Times to collision, headways, speeds and angles in further settings."""
    heading = """<AngleCondition angle="0.95" angleTolerance="0.0303" angleType="heading"
coordinateSystem="world"/>"""
    yield case("when_turned", "arc", STOP, when=by_entity(heading, "other"))
    for setting in ("arc", "banked"):
        slows = speed(to(2), "linear", 6)
        for name, body, who in (
            ("collision", collision_time(2.51), "ego"),
            ("headway", headway(1.51), "ego"),
            ("headway_road", headway(1.51, "road"), "ego"),
            (
                "relative_speed",
                '<RelativeSpeedCondition entityRef="ego" value="-6.011" rule="lessThan"/>',
                "other",
            ),
        ):
            yield ego_waits(f"ego_waits_{name}", setting, slows, by_entity(body, who))
    body = collision_time(5.03, kind="euclidianDistance")
    yield case("when_collision_time_euclidean", "crossing", STOP, when=by_entity(body, "ego"))
    room = """<RelativeClearanceCondition freeSpace="false" distanceForward="{}" distanceBackward="0"
oppositeLanes="true"><RelativeLaneRange from="-3" to="3"/></RelativeClearanceCondition>"""
    for setting, ahead in (("arc", 25.03), ("banked", 25.03), ("on_foot", 12.03)):
        body = by_entity(room.format(ahead), "ego")
        yield case("when_room_ahead", setting, STOP, when=body)


def hits() -> Iterator[Case]:
    """The other one brakes as the ego touches it."""
    begins = {
        "straight": ("straight", on_lane(-1, 100), 12, on_lane(-1, 115.07), 8),
        "arc": ("curve", on_lane(-1, 150), 12, on_lane(-1, 165), 8),
        "hill": ("hill", on_lane(-1, 120), 12, on_lane(-1, 135.07), 8),
        "oncoming": ("straight", on_lane(-1, 100), 12, on_lane(1, 150, -3.5), 10),
        "crossing": ("cross", on_lane(-1, 160), 12, on_lane(-1, 164, road=2), 10),
        "reverse": ("straight", on_lane(-1, 100), 8, on_lane(-1, 140), -6),
        "on_foot": ("straight", on_lane(-1, 100), 8, on_lane(-1, 120), 1.5),
    }
    touched = '<CollisionCondition><EntityRef entityRef="ego"/></CollisionCondition>'
    for setting, (road, its, v_ego, own, v) in begins.items():
        entities = vehicle("ego")
        entities += pedestrian("other") if setting == "on_foot" else vehicle("other")
        stories = story(event("e", private(STOP), by_entity(touched, "other")))
        begin = moving("ego", its, v_ego) + moving("other", own, v)
        parts = {"entities": entities, "init": begin, "stories": stories}
        yield Case(f"when_hit_{setting}", road, parts, 8.0)


FINAL = '<FinalSpeed><AbsoluteSpeed value="8"/></FinalSpeed>'


def actions_elsewhere() -> Iterator[Case]:
    for setting in SETTINGS:
        v = -4.0 if setting == "reverse" else 1.0 if setting == "on_foot" else 5.0
        ego_slows = story(
            event("ego_e", private(speed(to(6), "linear", 3)), time(1.975)),
            actor="ego",
            name="ego_story",
        )
        kept = speed(relative(-2, continuous=True), "linear", 1)
        if setting != "curve":
            yield case("speed_followed", setting, kept, more=ego_slows)
        if setting not in ("reverse", "on_foot"):
            yield (
                case("profile_jerk_down", setting, smooth_profile(v, up=1, down=2))
                if (setting != "curve")
                else case("profile_jerk_up", setting, smooth_profile(14, up=1, down=2))
            )
        for shape, dimension, value in (
            ("linear", "time", 4.0),
            ("sinusoidal", "rate", 1.0),
            ("cubic", "rate", 1.0),
            ("sinusoidal", "distance", 30.0),
        ):
            if setting == "on_foot" or (setting == "reverse" and dimension == "distance"):
                continue
            target = '<AbsoluteTargetLane value="{}"/>'.format(2 if setting == "oncoming" else -2)
            action = lane_change(target, shape, value, dimension)
            yield case(f"lane_change_{shape}_{dimension}", setting, action)
    for setting in ("arc", "banked"):
        own, its = (200, 190) if setting == "arc" else (140, 130)
        for name, final in (("plain", ""), ("final", FINAL)):
            action = synchronize("ego", on_lane(-2, its), on_lane(-1, own), final, 0.5)
            yield case(f"meets_{name}", setting, action)
        for name, bounds in (("slowly", 'maxSpeed="0.4"'), ("rigid", "")):
            action = beside(2.5, "left", axes="road", limits=bounds)
            yield case(f"beside_{name}", setting, action)
        kept = gap(
            'distance="20" freespace="true"',
            continuous=True,
            side="behind",
            limits=limits(2, 3),
            axes="road",
        )
        yield case("behind_road", setting, kept)
    for name in ("gap_kept", "time_gap"):
        how = (
            'distance="20" freespace="true"'
            if name == "gap_kept"
            else 'timeGap="2" freespace="false"'
        )
        kept = gap(how, continuous=True, side="ahead", limits=limits(3, 4))
        yield case(name, "banked", kept)


def both(begin: str, stories: str, walks: bool = False) -> dict[str, str]:
    entities = vehicle("ego") + (pedestrian("other") if walks else vehicle("other"))
    return {"minor": "3", "entities": entities, "init": begin, "stories": stories}


def ends_of_roads() -> Iterator[Case]:
    """The ego slows down once the other one has been at the end of its road for a second."""
    ends = {
        "arc": ("curve", on_lane(-1, 383.7), 10.0),
        "hill": ("hill", on_lane(-1, 783.7), 10.0),
        "oncoming": ("straight", on_lane(1, 16.3), 10.0),
        "reverse": ("straight", on_lane(-1, 12), -6.0),
        "crossing": ("cross", on_lane(-1, 383.7, road=2), 10.0),
        "on_foot": ("straight", on_lane(-1, 997), 1.5),
    }
    stands = '<EndOfRoadCondition duration="0.975"/>'
    for setting, (road, place, v) in ends.items():
        slow = event("e", private(speed(to(4), "linear", 2)), by_entity(stands, "other"))
        begin = moving("ego", on_lane(-2, 120), 12) + moving("other", place, v)
        parts = both(begin, story(slow, actor="ego"), setting == "on_foot")
        yield Case(f"when_end_of_road_{setting}", road, parts, 8.0)


def comings() -> Iterator[Case]:
    """The other one is taken away and put somewhere else in its setting."""
    for setting, (road, walks, ego, other) in SETTINGS.items():
        there = on_lane(
            1 if setting == "oncoming" else -1, 220, road=2 if setting == "crossing" else 1
        )
        events = (event("remove", DELETED, time(BEGIN)), event("add", added(there), time(2.975)))
        parts = both(ego + other, story(*events), walks)
        yield (
            Case(f"add_again_{setting}", road, parts, 6.0)
            if setting != "straight"
            else Case("add_there_straight", road, parts, 6.0)
        )


ACQUIRED = """<RoutingAction><AcquirePositionAction><Position>{}</Position>
</AcquirePositionAction></RoutingAction>"""


def acquired_places() -> Iterator[Case]:
    """A place behind a fork is driven to, straight on, round the corner and coming back."""
    for name, begin, goal in (
        ("straight_on", on_lane(-1, 60), on_lane(-1, 60, road=2)),
        ("round", on_lane(-1, 60), on_lane(-1, 60, road=3)),
        ("back", on_lane(1, 40, road=3), on_lane(1, 20)),
    ):
        stories = story(event("e", private(ACQUIRED.format(goal)), time(BEGIN)))
        places = moving("ego", on_lane(-1, 20), 8) + moving("other", begin, 10)
        yield Case(f"acquire_{name}_fork", "fork", both(places, stories), 9.0)


def trailers_elsewhere() -> Iterator[Case]:
    change = private(lane_change('<AbsoluteTargetLane value="-1"/>', "sinusoidal", 3))
    yield drawn("arc", "curve", moving("ego", on_lane(-2, 150), 10), change)
    back = private(speed(to(-2), "linear", 2))
    yield drawn("back_arc", "curve", moving("ego", on_lane(-2, 250), 2), back, 6.0)
    yield drawn(
        "oncoming", "straight", moving("ego", on_lane(2, 300), 10), private(lane_offset(0.8))
    )


def cells() -> Iterator[Case]:
    yield from distances_across()
    yield from distances_along()
    yield from places_reached()
    yield from chains()
    yield from other_measures()
    yield from hits()
    yield from actions_elsewhere()
    yield from ends_of_roads()
    yield from comings()
    yield from acquired_places()
    yield from trailers_elsewhere()
