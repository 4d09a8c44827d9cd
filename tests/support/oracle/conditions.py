# ruff: noqa: E501  a case is one row
"""Cases in which a condition of every kind lets something begin."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import cos, hypot, pi, sin

from support.oracle.actions import (
    lane_offset,
)
from support.oracle.settings import BEGIN, SETTINGS, Case, case, moving
from support.scenarios.files import (
    by_entity,
    event,
    on_lane,
    private,
    speed,
    state,
    story,
    time,
    to,
    trajectory,
    vehicle,
)


def entity_condition(body: str, name: str = "other") -> str:
    return by_entity(body, name)


def measured(tag: str, more: str) -> str:
    return f"<{tag} {more}/>"


def towards(place: str, more: str) -> str:
    return f"<DistanceCondition {more}><Position>{place}</Position></DistanceCondition>"


def near(
    value: float, kind: str, axes: str = "entity", free: str = "false", rule: str = "lessThan"
) -> str:
    return measured(
        "RelativeDistanceCondition",
        f'entityRef="ego" relativeDistanceType="{kind}" coordinateSystem="{axes}" freespace="{free}" value="{value}" rule="{rule}"',
    )


def collision_time(
    value: float, free: str = "false", kind: str = "longitudinal", axes: str = "entity"
) -> str:
    return f"""<TimeToCollisionCondition value="{value}" freespace="{free}" rule="lessThan"
relativeDistanceType="{kind}" coordinateSystem="{axes}"><TimeToCollisionConditionTarget>
<EntityRef entityRef="other"/></TimeToCollisionConditionTarget></TimeToCollisionCondition>"""


def headway(value: float, axes: str = "entity", free: str = "false") -> str:
    return measured(
        "TimeHeadwayCondition",
        f'entityRef="other" value="{value}" freespace="{free}" rule="lessThan" coordinateSystem="{axes}" relativeDistanceType="longitudinal"',
    )


STOP = speed(to(3), "linear", 4, "rate")
# name: setting, condition, the entity that triggers
CONDITIONS: dict[str, tuple[str, str, str]] = {
    "distance_straight": ("straight", near(20.05, "longitudinal"), "other"),
    "distance_euclidean": ("crossing", near(60.05, "euclidianDistance"), "other"),
    "distance_free": ("crossing", near(30.05, "euclidianDistance", free="true"), "other"),
    "distance_lateral": ("crossing", near(40.05, "lateral"), "other"),
    "distance_across": ("crossing", near(40.05, "longitudinal"), "other"),
    "distance_road": ("curve", near(20.05, "longitudinal", "road"), "other"),
    "distance_oncoming": ("oncoming", near(70.05, "longitudinal", free="true"), "other"),
    "distance_reverse": ("reverse", near(45.05, "longitudinal"), "other"),
    "distance_on_foot": ("on_foot", near(12.05, "longitudinal", free="true"), "other"),
    "to_place": (
        "curve",
        towards(on_lane(-1, 140), 'value="15.05" freespace="false" rule="lessThan"'),
        "other",
    ),
    "to_place_reverse": (
        "reverse",
        towards(on_lane(-1, 170), 'value="5.05" freespace="false" rule="lessThan"'),
        "other",
    ),
    "reached": (
        "hill",
        f'<ReachPositionCondition tolerance="3.05"><Position>{on_lane(-1, 150)}</Position></ReachPositionCondition>',
        "other",
    ),
    "travelled": ("curve", '<TraveledDistanceCondition value="35.05"/>', "other"),
    "travelled_reverse": ("reverse", '<TraveledDistanceCondition value="15.05"/>', "other"),
    "collision_time": ("straight", collision_time(9.03), "ego"),
    "collision_time_free": ("oncoming", collision_time(4.03, "true"), "ego"),
    "collision_time_reverse": ("reverse", collision_time(5.03), "ego"),
    "collision_time_on_foot": ("on_foot", collision_time(3.03), "ego"),
    "headway": ("straight", headway(1.83), "ego"),
    "headway_reverse": ("reverse", headway(9.03), "ego"),
    "headway_road": ("curve", headway(2.0, "road"), "ego"),
    "speed_reverse": ("reverse", '<SpeedCondition value="-5" rule="lessThan"/>', "other"),
    "relative_speed": (
        "oncoming",
        '<RelativeSpeedCondition entityRef="ego" value="-1" rule="lessThan"/>',
        "other",
    ),
    "clearance": (
        "straight",
        '<RelativeClearanceCondition freeSpace="false" distanceForward="25.05" distanceBackward="0" oppositeLanes="false"><RelativeLaneRange from="1" to="1"/></RelativeClearanceCondition>',
        "ego",
    ),
}


# where ego and other are at t s: x, y and velocity at 0 s, and how the other one looks
COURSES = {
    "straight": ((100.0, -5.25, 12.0, 0.0), (130.0, -1.75, 10.0, 0.0), 0.0),
    "hill": ((60.0, -5.25, 12.0, 0.0), (90.0, -1.75, 10.0, 0.0), 0.0),
    "reverse": ((100.0, -5.25, 8.0, 0.0), (200.0, -1.75, -6.0, 0.0), 0.0),
    "on_foot": ((100.0, -5.25, 8.0, 0.0), (130.0, -1.75, 1.5, 0.0), 0.0),
    "oncoming": ((100.0, -1.75, 12.0, 0.0), (300.0, 1.75, -10.0, 0.0), pi),
    "crossing": ((100.0, -1.75, 12.0, 0.0), (201.75, -110.0, 0.0, 10.0), pi / 2),
}
MOMENT = 3.03  # s, between two steps


def apart(setting: str, kind: str, t: float) -> float:
    """The distance of the two in the axes of the other one, m."""
    ego, other, h = COURSES[setting]
    dx, dy = (other[k] + other[k + 2] * t - ego[k] - ego[k + 2] * t for k in (0, 1))
    parts = {
        "euclidianDistance": hypot(dx, dy),
        "longitudinal": abs(dx * cos(h) + dy * sin(h)),
        "lateral": abs(dy * cos(h) - dx * sin(h)),
    }
    return parts[kind]


def measured_everywhere() -> Iterator[Case]:
    """Every distance in every setting in which it changes, and the way that the other one went."""
    for setting, (_, other, _) in COURSES.items():
        for kind in ("euclidianDistance", "longitudinal", "lateral"):
            now, later = apart(setting, kind, MOMENT), apart(setting, kind, MOMENT + 0.01)
            if abs(now - later) < 1e-6:
                continue
            rule = "lessThan" if later < now else "greaterThan"
            condition = by_entity(near(round(now, 3), kind, rule=rule), "other")
            yield case(f"when_apart_{kind[:4]}", setting, STOP, when=condition)
        way = hypot(other[2], other[3]) * MOMENT
        travelled = by_entity(f'<TraveledDistanceCondition value="{way:.3f}"/>', "other")
        yield case("when_went", setting, STOP, when=travelled)


def conditions() -> Iterator[Case]:
    yield from measured_everywhere()
    yield from conditions_by_hand()


def conditions_by_hand() -> Iterator[Case]:
    """The other one brakes, or drives on, when a condition of either holds."""
    for name, (setting, body, by) in CONDITIONS.items():
        yield case(f"when_{name}", setting, STOP, when=by_entity(body, by))
    slow = event("slow", private(speed(to(0), "linear", 4, "rate")), time(BEGIN))
    again = event(
        "again",
        private(speed(to(5), "linear", 2)),
        entity_condition('<StandStillCondition duration="0.975"/>'),
    )
    yield _chain("stands", "straight", slow, again)
    gently = event("slow", private(speed(to(0), "cubic", 4)), time(BEGIN))
    for setting in ("straight", "curve", "hill"):
        yield _chain("stands_gently", setting, gently, again)
    follows = event(
        "again", private(speed(to(12), "linear", 2)), state("event", "slow", "completeState")
    )
    yield _chain("state", "curve", slow, follows)
    braking = event(
        "again",
        private(lane_offset(0.6)),
        entity_condition(
            '<AccelerationCondition value="-3" rule="lessThan" direction="longitudinal"/>'
        ),
    )
    yield _chain("acceleration", "straight", slow, braking)
    aside = event(
        "aside", private(trajectory((140.0, -1.75), (170.0, -11.0), (250.0, -11.0))), time(BEGIN)
    )
    off = event(
        "off",
        private(speed(to(4), "linear", 1)),
        entity_condition('<OffroadCondition duration="0.475"/>'),
    )
    end_of_road = SETTINGS["straight"][2] + moving("other", on_lane(-1, 960.2), 10)
    parts = {
        "entities": vehicle("ego") + vehicle("other"),
        "init": end_of_road,
        "stories": story(
            event(
                "e",
                private(speed(to(4), "linear", 2)),
                by_entity('<EndOfRoadCondition duration="0.975"/>', "other"),
            ),
            actor="ego",
        ),
    }
    yield Case("when_end_of_road_straight", "straight", parts)
    yield _chain("off_road", "straight", aside, off)
    shoulder = event(
        "aside", private(trajectory((140.0, -1.75), (170.0, -8.0), (250.0, -8.0))), time(BEGIN)
    )
    yield _chain("off_road_shoulder", "straight", shoulder, off)
    void = _chain("off_road_void", "straight", aside, off)
    yield replace(void, road="void")


def _chain(name: str, setting: str, *events: str) -> Case:
    road, _, ego, other = SETTINGS[setting]
    parts = {
        "entities": vehicle("ego") + vehicle("other"),
        "init": ego + other,
        "stories": story(*events),
    }
    return Case(f"when_{name}_{setting}", road, parts, 12.0)
