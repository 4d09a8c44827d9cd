"""The files whose reference trajectories esmini has computed: a table of cases, written by us.

Each case has two moving entities, `ego` and `other`. Triggers at times stand half a step before the
step that is meant, so that sums of steps round alike in every player.
"""

from __future__ import annotations

from collections.abc import Iterator

from support.oracle.actions import (
    assigned,
    beside,
    gap,
    lane_change,
    lane_offset,
    limits,
    profile,
    relative,
    round_profile,
    shape_of,
    smooth_profile,
    timing,
)
from support.oracle.cells import cells
from support.oracle.conditions import conditions
from support.oracle.ends import at_once, at_the_same_time, backwards, without_road
from support.oracle.everywhere import everywhere
from support.oracle.pairs import pairs
from support.oracle.settings import BEGIN, NORTH, SETTINGS, WEST, Case, case, moving, turned
from support.oracle.sideways import sideways
from support.oracle.turns import turns
from support.scenarios.files import (
    event,
    init,
    on_lane,
    pedestrian,
    private,
    speed,
    story,
    synchronize,
    teleport,
    time,
    to,
    trajectory,
    vehicle,
    world,
)


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
MOST = tuple(ACTIONS)
PLAN: dict[str, tuple[str, ...]] = {
    "straight": MOST,
    "curve": tuple(a for a in MOST if a not in ("speed_rate", "speed_factor", "lane_offset_step")),
    "arc": MOST,
    "hill": MOST,
    "reverse": tuple(a for a in MOST if a != "lane_change_way"),  # esmini looks along the motion
    "on_foot": tuple(a for a in MOST if a not in ("lane_change", "lane_offset")),
    "oncoming": tuple(a for a in MOST if a != "gap_once"),  # esmini never ends it there
    "crossing": tuple(a for a in MOST if a != "gap_once"),
}


def actions() -> Iterator[Case]:
    for setting, names in PLAN.items():
        for name in names:
            yield case(name, setting, ACTIONS[name])
    yield case(
        "lane_change", "on_foot", lane_change('<AbsoluteTargetLane value="-2"/>', "linear", 7)
    )
    yield case("lane_offset", "on_foot", lane_offset(0.4, a=0.1))
    for name in ("lane_offset", "lane_change_relative", "lane_offset_step"):
        yield case(name, "banked", ACTIONS[name])
    yield case("profile", "straight", profile((14, 2), (6, 4)))
    yield case("profile_jerk_up", "straight", smooth_profile(18, up=2, down=3))
    yield case("profile_jerk_down", "curve", smooth_profile(4, up=1, down=2))
    for name, then in (("soon", smooth_profile(4, up=4, down=3)), ("timed", round_profile((5, 5)))):
        more = story(event("then", private(then), time(2.575)), name="b")
        first = smooth_profile(20, up=2, down=3)
        yield case(f"profile_under_way_{name}", "straight", first, more=more)
    yield case("profile_corners", "straight", round_profile((16, 3), (4, 4), (12, 3)))
    first = f'{speed(to(3))}</PrivateAction></Action><Action name="then"><PrivateAction>'
    yield case("profile_after_step", "straight", first + profile((9, 3), (6, 2)))
    yield case("speed_after_step", "straight", first + speed(to(12), "linear", 4))
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


HITCH = '<TrailerHitch dx="-1.1"/>{}<Properties/></Vehicle>'
COUPLER = '<TrailerCoupler dx="3.2"/><Properties/></Vehicle>'
TRAILER = '<Trailer><TrailerRef entityRef="other"/></Trailer>'


def trailers() -> Iterator[Case]:
    """`ego` draws `other`: from the begin through a lane change on a curve, and from 1 s to 6 s."""

    def bodies(more: str) -> str:
        car = vehicle("ego").replace("<Properties/></Vehicle>", HITCH.format(more))
        return vehicle("other").replace("<Properties/></Vehicle>", COUPLER) + car

    aside = lane_change('<AbsoluteTargetLane value="-1"/>', "sinusoidal", 3)
    yield Case(
        "trailer_curve",
        "curve",
        {
            "minor": "3",
            "entities": bodies(TRAILER),
            "init": moving("ego", on_lane(-2, 60), 10),
            "stories": ego_does(aside),
        },
    )
    join = '<TrailerAction><ConnectTrailerAction trailerRef="other"/></TrailerAction>'
    leave = "<TrailerAction><DisconnectTrailerAction/></TrailerAction>"
    events = (
        event("join", private(join), time(BEGIN)),
        event("go", private(speed(to(8), "linear", 2)), time(1.975)),
        event("leave", private(leave), time(5.975)),
        event("stop", private(speed(to(3), "linear", 2)), time(5.975)),
    )
    yield Case(
        "trailer_joined_straight",
        "straight",
        {
            "minor": "3",
            "entities": bodies(""),
            "init": moving("ego", on_lane(-2, 100), 0) + moving("other", turned(-2, 95.5, 0.3), 0),
            "stories": story(*events, actor="ego"),
        },
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
    yield case("track_clothoid", "reverse", shape_of(clothoid))
    yield case("track_clothoid", "crossing", shape_of(clothoid))
    yield from backwards()
    yield from without_road()
    yield from at_once()
    yield from at_the_same_time()
    yield case(
        "track_speed",
        "straight",
        trajectory(*CORNER),
        more=story(event("v", private(speed(to(4), "linear", 2)), time(2.975)), name="b"),
    )


def on_road(s: float, t: float) -> str:
    return f'<RoadPosition roadId="1" s="{s}" t="{t}"/>'


def lines_on_roads() -> Iterator[Case]:
    """Lines whose places on roads name no heading: across the road on foot, and rear first."""

    def line(*places: str) -> str:
        points = "".join(f"<Vertex><Position>{p}</Position></Vertex>" for p in places)
        return shape_of(f"<Polyline>{points}</Polyline>")

    yield case("track_across_road", "on_foot", line(on_road(131.5, -4), on_road(131.5, 4)))
    yield case("track_along_road", "curve", line(on_road(91, -1.75), on_road(180, -1.75)))
    back = line(on_road(200, -1.75), on_road(100, -1.75))
    begin = moving("ego", on_lane(-2, 100), 8) + moving("other", on_lane(-1, 200), -6, back)
    parts = {"entities": vehicle("ego") + vehicle("other"), "init": begin, "stories": ""}
    yield Case("init_track_rear_first", "straight", parts, 8.0)


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
    both = f'{teleport(on_lane(-2, 200))}</PrivateAction></Action><Action name="v"><PrivateAction>'
    yield case("teleport_speed", "straight", both + speed(to(6)), when=time(1.125))
    aside = f'{teleport(on_lane(-2, 200))}</PrivateAction></Action><Action name="l"><PrivateAction>'
    change = lane_change('<AbsoluteTargetLane value="-1"/>', "linear", 3)
    yield case("teleport_lane", "straight", aside + change)
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


CASES: dict[str, Case] = {
    c.name: c
    for part in (
        actions,
        trailers,
        meetings,
        trajectories,
        lines_on_roads,
        begins,
        conditions,
        sideways,
        pairs,
        everywhere,
        turns,
        cells,
    )
    for c in part()
}
