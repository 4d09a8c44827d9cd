"""The files whose reference trajectories esmini has computed: a table of cases, written by us.

# ruff: noqa: E501  a case is one row

Each case has two moving entities, `ego` and `other`. Triggers at times stand half a step before the
step that is meant, so that sums of steps round alike in every player.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import pi

from tests.scenarios.files import (
    FILE,
    by_entity,
    condition,
    event,
    init,
    on_lane,
    pedestrian,
    private,
    speed,
    state,
    story,
    synchronize,
    teleport,
    time,
    to,
    trajectory,
    vehicle,
    world,
)
from tests.scenarios.oracle.actions import (
    assigned,
    beside,
    gap,
    lane_change,
    lane_offset,
    limits,
    profile,
    relative,
    shape_of,
    timing,
)

NORTH, WEST = pi / 2, pi
BEGIN = 0.975  # s


@dataclass(frozen=True)
class Case:
    """One file: its name, its road, and the parts of its text."""

    name: str
    road: str
    parts: dict[str, str] = field(default_factory=dict)
    end: float = 10.0

    def text(self) -> str:
        values = {
            "minor": 2,
            "parameters": "",
            "variables": "",
            "catalogs": "",
            "road": f'<LogicFile filepath="{self.road}.xodr"/>',
            "stop": condition(time(self.end - 0.025)),
        } | self.parts
        return FILE.format(**values)


def moving(name: str, place: str, v: float, *more: str) -> str:
    return init(name, teleport(place), speed(to(v)), *more)


def turned(lane: int, s: float, h: float, offset: float = 0.0) -> str:
    """A place on a lane with a heading against it."""
    return f"""<LanePosition roadId="1" laneId="{lane}" s="{s}" offset="{offset}">
<Orientation type="relative" h="{h}"/></LanePosition>"""


# name of a setting: road, kind of the other one, where ego and other begin and how fast
SETTINGS: dict[str, tuple[str, bool, str, str]] = {
    "straight": (
        "straight",
        False,
        moving("ego", on_lane(-2, 100), 12),
        moving("other", on_lane(-1, 130), 10),
    ),
    "curve": (
        "curve",
        False,
        moving("ego", on_lane(-2, 60), 12),
        moving("other", on_lane(-1, 90), 10),
    ),
    "hill": (
        "hill",
        False,
        moving("ego", on_lane(-2, 60), 12),
        moving("other", on_lane(-1, 90), 10),
    ),
    "oncoming": (
        "straight",
        False,
        moving("ego", on_lane(-1, 100), 12),
        moving("other", on_lane(1, 300), 10),
    ),
    "crossing": (
        "cross",
        False,
        moving("ego", on_lane(-1, 100), 12),
        moving("other", on_lane(-1, 90, road=2), 10),
    ),
    "reverse": (
        "straight",
        False,
        moving("ego", on_lane(-2, 100), 8),
        moving("other", on_lane(-1, 200), -6),
    ),
    "on_foot": (
        "straight",
        True,
        moving("ego", on_lane(-2, 100), 8),
        moving("other", on_lane(-1, 130), 1.5),
    ),
}
KNOWN = tuple(SETTINGS)


def case(
    name: str, setting: str, action: str, *, when: str = "", more: str = "", end: float = 10.0
) -> Case:
    """The other one does something in a setting; at 1 s, unless `when` says otherwise."""
    road, walks, ego, other = SETTINGS[setting]
    entities = vehicle("ego") + (pedestrian("other") if walks else vehicle("other"))
    stories = (
        story(event("e", private(action), when or time(BEGIN)), start=when and time(BEGIN)) + more
    )
    parts = {"entities": entities, "init": ego + other, "stories": stories}
    return Case(f"{name}_{setting}", road, parts, end)


def ego_does(action: str, t: float = 2.975) -> str:
    return story(event("ego_e", private(action), time(t)), actor="ego", name="ego_story")


# what each setting's entity may do: name, action
ACTIONS: dict[str, str] = {
    "speed_linear": speed(to(5), "linear", 3),
    "speed_rate": speed(to(4), "linear", 2, "rate"),
    "speed_distance": speed(to(5), "linear", 30, "distance"),
    "speed_cubic": speed(to(6), "cubic", 3),
    "speed_back": speed(to(-3), "linear", 3, "rate"),
    "speed_relative": speed(relative(-2), "linear", 2),
    "speed_factor": speed(relative(0.5, "factor"), "linear", 2),
    "lane_change": lane_change('<AbsoluteTargetLane value="-2"/>'),
    "lane_change_way": lane_change('<AbsoluteTargetLane value="-2"/>', "cubic", 40, "distance"),
    "lane_change_relative": lane_change(
        '<RelativeTargetLane entityRef="ego" value="0"/>', offset=0.4
    ),
    "lane_offset": lane_offset(0.8),
    "lane_offset_step": lane_offset(-0.5, "step"),
    "gap_ahead": gap(
        'distance="40" freespace="false"', continuous=True, side="ahead", limits=limits(3, 4)
    ),
    "gap_once": gap('distance="20" freespace="false"', continuous=False, side="ahead"),
    "gap_kept": gap('distance="20" freespace="true"', continuous=True, side="ahead"),
    "time_gap": gap(
        'timeGap="2" freespace="false"', continuous=True, side="ahead", limits=limits(3, 4)
    ),
}
FEW = ("speed_linear", "speed_distance", "speed_back", "lane_change", "lane_offset", "gap_once")
MOST = tuple(ACTIONS)
PLAN: dict[str, tuple[str, ...]] = {
    "straight": MOST,
    "curve": tuple(a for a in MOST if a not in ("speed_rate", "speed_factor", "lane_offset_step")),
    "hill": FEW,
    "reverse": ("speed_linear", "speed_distance", "speed_back", "lane_change", "lane_offset"),
    "on_foot": ("speed_linear", "speed_distance"),
    "oncoming": ("speed_linear", "speed_relative", "lane_offset"),
    "crossing": ("speed_linear", "speed_relative", "lane_offset"),
}


def actions() -> Iterator[Case]:
    for setting, names in PLAN.items():
        for name in names:
            yield case(name, setting, ACTIONS[name])
    yield case(
        "lane_change", "on_foot", lane_change('<AbsoluteTargetLane value="-2"/>', "linear", 7)
    )
    yield case("lane_offset", "on_foot", lane_offset(0.4, a=0.1))
    yield case("profile", "straight", profile((14, 2), (6, 4)))
    yield case("profile_relative", "curve", profile((2, 2), (-3, 3), other="ego"))
    yield case(
        "speed_followed",
        "curve",
        speed(relative(2, continuous=True), "linear", 1),
        more=ego_does(speed(to(6), "linear", 2)),
    )
    yield case("beside", "straight", beside(2.5, "left"), more=ego_does(lane_offset(0.5)))
    yield case("beside_free", "curve", beside(1.0, "left", free=True, axes="road"))
    yield case("lane_offset_relative", "straight", lane_offset(3.0, other="ego"))
    yield case(
        "gap_behind",
        "straight",
        gap('distance="20" freespace="false"', continuous=True, side="behind", limits=limits(4, 6)),
        end=14.0,
    )
    yield case(
        "gap_road",
        "curve",
        gap(
            'distance="45" freespace="false"',
            continuous=True,
            side="ahead",
            limits=limits(3, 4),
            axes="road",
        ),
    )
    yield case(
        "gap_performance",
        "straight",
        gap(
            'distance="60" freespace="false"', continuous=True, side="ahead", limits=limits(15, 15)
        ),
    )


FINAL = '<FinalSpeed><AbsoluteSpeed value="{}">{}</AbsoluteSpeed></FinalSpeed>'
WALK = trajectory((200.0, -20.0), (200.0, 12.0))
WALKS = {
    "none": "",
    "final": FINAL.format(1.5, ""),
    "steady": FINAL.format(1.5, '<TargetDistanceSteadyState distance="4"/>'),
    "steady_time": FINAL.format(1.5, '<TargetTimeSteadyState time="2"/>'),
    "relative": '<FinalSpeed><RelativeSpeedToMaster value="-6"/></FinalSpeed>',
}


def walking(
    name: str, final: str, *, place: str = "", walk: str = WALK, v: float = 0.0, s: float = 100.0
) -> Case:
    """Somebody on foot crosses the road as the ego comes to x = 200 m at 10 m/s."""
    meet = synchronize("ego", on_lane(-1, 200), place or world(200.0, -1.75), final)
    begin = moving("ego", on_lane(-1, s), 10)
    begin += init("other", teleport(world(200.0, -20.0, NORTH)), speed(to(v)), walk)
    stories = story(event("e", private(meet), time(BEGIN)))
    parts = {"entities": vehicle("ego") + pedestrian("other"), "init": begin, "stories": stories}
    return Case(f"meet_{name}", "straight", parts, 13.0)


def meetings() -> Iterator[Case]:
    for name, final in WALKS.items():
        yield walking(f"on_foot_{name}", final, v=1.0)
    yield walking("on_foot_waiting", WALKS["steady"], s=20.0)
    on_line = f"""<TrajectoryPosition s="18.25"><TrajectoryRef>{_line()}</TrajectoryRef>
</TrajectoryPosition>"""
    yield walking("on_trajectory", WALKS["steady"], place=on_line)
    corner = trajectory((190.0, -12.0), (200.0, -12.0), (200.0, 12.0))
    yield walking("round_a_corner", WALKS["final"], walk=corner, v=1.0)
    for name, final, setting, goal, its in (
        ("crossing", FINAL.format(8, ""), "crossing", on_lane(-1, 198, road=2), on_lane(-1, 200)),
        ("crossing_plain", "", "crossing", on_lane(-1, 198, road=2), on_lane(-1, 200)),
        ("oncoming", FINAL.format(8, ""), "oncoming", on_lane(1, 210), on_lane(-1, 200)),
        ("curve", FINAL.format(8, ""), "curve", on_lane(-1, 160), on_lane(-2, 150)),
        ("hill", FINAL.format(8, ""), "hill", on_lane(-1, 160), on_lane(-2, 150)),
    ):
        yield case(f"meet_{name}", setting, synchronize("ego", its, goal, final, 0.5))


def _line() -> str:
    points = "".join(
        f"<Vertex><Position>{world(200.0, y)}</Position></Vertex>" for y in (-20.0, 12.0)
    )
    return f"""<Trajectory name="t" closed="false"><Shape><Polyline>{points}</Polyline></Shape>
</Trajectory>"""


CORNER = ((150.0, -1.75), (180.0, -1.75), (180.0, 12.0))


def trajectories() -> Iterator[Case]:
    yield case("track_corner", "straight", trajectory(*CORNER))
    yield case("track_on_foot", "on_foot", trajectory((131.5, -1.75), (135.0, 5.0), (140.0, 5.0)))
    yield case(
        "track_timed",
        "straight",
        trajectory(
            *((x, y, None, t) for (x, y), t in zip(CORNER, (0.0, 3.0, 6.0), strict=True)),
            timing=timing(),
        ),
    )
    yield case(
        "track_absolute",
        "straight",
        trajectory(
            (140.0, -1.75, None, 1.0),
            (170.0, -1.75, None, 4.0),
            (200.0, -5.25, None, 7.0),
            timing=timing("absolute"),
        ),
    )
    yield case("track_reversed", "reverse", trajectory((194.0, -1.75, 0.0), (100.0, -1.75, 0.0)))
    yield case(
        "track_reversed_timed",
        "straight",
        trajectory((140.0, -1.75, 0.0, 0.0), (120.0, -1.75, 0.0, 4.0), timing=timing()),
    )
    yield case("track_end_across", "on_foot", trajectory((131.5, -1.75), (131.5, 3.0)))
    yield case("track_end_back", "on_foot", trajectory((131.5, -1.75), (129.0, -1.75)))
    yield case(
        "track_end_back_timed",
        "on_foot",
        trajectory((131.5, -1.75, None, 0.0), (128.0, -1.75, None, 2.0), timing=timing()),
    )
    yield case(
        "track_headings",
        "straight",
        trajectory((140.0, -1.75, 0.0), (160.0, -1.75, 0.3), (180.0, 4.0, 0.3)),
    )
    clothoid = f"""<Clothoid curvature="0" curvaturePrime="0.0005" length="60"><Position>
{world(140.0, -1.75, 0.0)}</Position></Clothoid>"""
    yield case("track_clothoid", "straight", shape_of(clothoid))
    yield case(
        "track_speed",
        "straight",
        trajectory(*CORNER),
        more=story(event("v", private(speed(to(4), "linear", 2)), time(2.975)), name="b"),
    )


def begins() -> Iterator[Case]:
    """What <Init> says is so at the begin; what is put somewhere keeps its speed."""
    for name, more in (
        ("gap", gap('distance="40" freespace="false"', continuous=False, side="ahead")),
        ("gap_free", gap('distance="40" freespace="true"', continuous=True, side="ahead")),
        ("offset", lane_offset(0.7, "step")),
        ("lane", lane_change('<AbsoluteTargetLane value="-2"/>', "step", 0)),
        ("track", trajectory((150.0, -1.75), (190.0, 3.0))),
    ):
        begin = moving("ego", on_lane(-2, 100), 10) + moving("other", on_lane(-1, 130), 12, more)
        parts = {
            "entities": vehicle("ego") + vehicle("other"),
            "init": begin,
            "stories": story(event("e", private(speed(to(6), "linear", 2)), time(3.975))),
        }
        yield Case(f"init_{name}", "straight", parts, 8.0)
    yield case("teleport", "straight", teleport(on_lane(-2, 200)))
    yield case("teleport_turned", "straight", teleport(turned(-1, 200, WEST)))
    yield case("teleport_across", "on_foot", teleport(turned(-1, 140, NORTH)))
    yield case(
        "teleport_relative",
        "curve",
        teleport('<RelativeLanePosition entityRef="ego" dLane="0" ds="25"/>'),
    )
    yield case(
        "teleport_road",
        "curve",
        teleport('<RelativeRoadPosition entityRef="ego" ds="20" dt="3.5"/>'),
    )
    yield case(
        "teleport_object",
        "curve",
        teleport('<RelativeObjectPosition entityRef="ego" dx="20" dy="3.5"/>'),
    )
    ways = assigned(on_lane(-1, 90, road=2), on_lane(-1, 300, road=2))
    road, _, ego, other = SETTINGS["crossing"]
    parts = {
        "entities": vehicle("ego") + vehicle("other"),
        "init": ego + other,
        "stories": story(event("e", ways, time(BEGIN))),
    }
    yield Case("route_crossing", road, parts)


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


def conditions() -> Iterator[Case]:
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
    end_of_road = SETTINGS["straight"][2] + moving("other", on_lane(-1, 960), 10)
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


def _chain(name: str, setting: str, *events: str) -> Case:
    road, _, ego, other = SETTINGS[setting]
    parts = {
        "entities": vehicle("ego") + vehicle("other"),
        "init": ego + other,
        "stories": story(*events),
    }
    return Case(f"when_{name}_{setting}", road, parts, 12.0)


CASES: dict[str, Case] = {
    c.name: c for part in (actions, meetings, trajectories, begins, conditions) for c in part()
}
