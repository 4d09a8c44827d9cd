"""Sources, sinks, swarms and areas of vehicles that a file does not name."""

from collections import Counter
from itertools import pairwise
from math import hypot

import pytest

from skidpad.scenarios.playing.stage import play_ideal
from skidpad.scenarios.scenario import check
from support.scenarios.files import (
    at,
    compiled,
    condition,
    event,
    on_lane,
    story,
    time,
    told,
    write,
)

CARS = """<TrafficDefinition name="t"><VehicleCategoryDistribution><VehicleCategoryDistributionEntry
category="car" weight="3"/><VehicleCategoryDistributionEntry category="truck" weight="1"/>
</VehicleCategoryDistribution><ControllerDistribution><ControllerDistributionEntry weight="1">
<Controller name="c"><Properties/></Controller></ControllerDistributionEntry>
</ControllerDistribution></TrafficDefinition>"""
KINDS = """<TrafficDistribution><TrafficDistributionEntry weight="1"><EntityDistribution>
<EntityDistributionEntry weight="1"><ScenarioObjectTemplate>{}</ScenarioObjectTemplate>
</EntityDistributionEntry></EntityDistribution></TrafficDistributionEntry></TrafficDistribution>"""
VAN = """<Vehicle name="v" vehicleCategory="van"><BoundingBox><Center x="1.4" y="0" z="1"/>
<Dimensions width="2" length="5.5" height="2.2"/></BoundingBox><Performance maxSpeed="25"
maxDeceleration="9" maxAcceleration="4"/><Axles><FrontAxle maxSteering="0.5" wheelDiameter="0.6"
trackWidth="1.6" positionX="3" positionZ="0.3"/><RearAxle maxSteering="0" wheelDiameter="0.6"
trackWidth="1.6" positionX="0" positionZ="0.3"/></Axles><Properties/></Vehicle>"""


def traffic(action, name="flow"):
    return (
        f'<GlobalAction><TrafficAction trafficName="{name}">{action}</TrafficAction></GlobalAction>'
    )


def place(lane, s):
    return f"<Position>{on_lane(lane, s)}</Position>"


def source(lane=-2, s=300, radius=1, rate=0.5, speed=10):
    return (
        f'<TrafficSourceAction radius="{radius}" rate="{rate}" speed="{speed}">{place(lane, s)}'
        f"{CARS}</TrafficSourceAction>"
    )


def sink(lane=-2, s=400, radius=5):
    return f'<TrafficSinkAction radius="{radius}">{place(lane, s)}</TrafficSinkAction>'


def swarm(number=12, inner=20, major=150, minor=60, more=""):
    return (
        f'<TrafficSwarmAction innerRadius="{inner}" semiMajorAxis="{major}" semiMinorAxis="{minor}" '
        f'numberOfVehicles="{number}" velocity="12" offset="0"><CentralObject entityRef="ego"/>{CARS}{more}'
        "</TrafficSwarmAction>"
    )


def area(number, continuous, region):
    return (
        f'<TrafficAreaAction numberOfEntities="{number}" continuous="{continuous}">'
        f"{KINDS.format(VAN)}<TrafficArea>{region}</TrafficArea></TrafficAreaAction>"
    )


def playing(folder, *actions, more="", end=20, **parts):
    init = at("ego", -3, 100) + at("other", -1, 120) + "".join(actions)
    return told(folder, init=init, stories=more, end=end, **parts)


def of_traffic(told):
    return [row for row in told.rows if row.name.startswith("traffic_")]


def begins(told):
    """Name, time and place of each appearing: where a vehicle has no row a tick before."""
    found, last = [], {}
    for row in of_traffic(told):
        if row.time - last.get(row.name, -1.0) > 0.06:
            found.append(row)
        last[row.name] = row.time
    return found


@pytest.mark.osc("TrafficAction", "TrafficSourceAction")
def test_a_source_brings_vehicles_at_its_rate(tmp_path):
    rows = begins(playing(tmp_path, traffic(source(rate=0.25)), end=21))
    assert [row.time for row in rows] == pytest.approx([0.05 + 4.0 * k for k in range(6)], abs=1e-6)
    first = play_ideal(compiled(tmp_path), 0.0).of("other")[
        0
    ]  # looks along the lanes of negative id
    for row in rows:
        assert (row.h, row.speed) == pytest.approx((first.h, 10.0), abs=0.01)
    assert max(hypot(a.x - b.x, a.y - b.y) for a in rows for b in rows) < 1.0


@pytest.mark.osc("TrafficSinkAction")
def test_a_sink_takes_what_a_source_has_brought_and_nobody_else(tmp_path):
    free = playing(tmp_path, traffic(source()), end=20)
    held = playing(tmp_path, traffic(source()), traffic(sink(radius=30), "end"), end=20)
    begin = begins(free)[0]
    furthest = {
        name: max(hypot(r.x - begin.x, r.y - begin.y) for r in of_traffic(run))
        for name, run in (("free", free), ("held", held))
    }
    assert furthest["free"] > 190.0
    assert 69.0 < furthest["held"] < 71.0
    assert held.of("other")[-1].time == free.of("other")[-1].time


@pytest.mark.osc("TrafficSwarmAction")
def test_a_swarm_stays_about_its_entity(tmp_path):
    run = playing(tmp_path, traffic(swarm(major=300)), end=20)
    ego = {row.time: row for row in run.of("ego")}
    for row in of_traffic(run):
        me = ego[row.time]
        x, y = row.x - me.x, row.y - me.y
        assert (x / 300.0) ** 2 + (y / 60.0) ** 2 < 1.05
    for row in begins(run):
        assert hypot(row.x - ego[row.time].x, row.y - ego[row.time].y) > 19.0
    counts = Counter(row.time for row in of_traffic(run))
    assert max(counts.values()) <= 12
    assert min(list(counts.values())[1:]) >= 8


@pytest.mark.parametrize(("same", "opposite"), [(1, 0), (0, 1)])
def test_the_direction_of_a_swarm_may_be_asked_for(tmp_path, same, opposite):
    more = f'<DirectionOfTravelDistribution same="{same}" opposite="{opposite}"/>'
    run = playing(tmp_path, traffic(swarm(more=more)), end=3)
    heading = run.of("ego")[0].h
    assert {abs(row.h - heading) < 1.0 for row in begins(run)} == {bool(same)}


@pytest.mark.osc("TrafficStopAction")
def test_traffic_that_is_stopped_sends_nobody_more_and_drives_on(tmp_path):
    stop = event("stop", traffic("<TrafficStopAction/>", "flow"), time(5.0))
    run = playing(tmp_path, traffic(source()), traffic(source(-1, 500), "else"), more=story(stop))
    first = {round(row.y) for row in begins(run) if row.time < 5.0}
    later = {round(row.y) for row in begins(run) if row.time > 5.1}
    assert (len(first), len(later)) == (2, 1)
    assert [row for row in of_traffic(run) if row.time > 10.0]


@pytest.mark.osc("TrafficAreaAction")
def test_an_area_is_filled_once_or_kept_full(tmp_path):
    cursors = '<RoadCursor roadId="1" s="{}"><Lane id="-2"/></RoadCursor>'
    region = f"<RoadRange>{cursors.format(300)}{cursors.format(700)}</RoadRange>"
    once = playing(tmp_path, traffic(area(6, "false", region)), end=30, minor=3)
    kept = playing(tmp_path, traffic(area(6, "true", region)), end=30, minor=3)
    assert len(begins(once)) == 6
    assert {row.time for row in begins(once)} == {0.05}
    assert len(begins(kept)) > 6
    x = [row.x for row in of_traffic(kept)]
    assert max(x) - min(x) < 410.0
    assert max(row.x for row in of_traffic(once)) - min(x) > 410.0


def test_an_area_may_be_a_polygon(tmp_path):
    corners = ((300, -20), (500, -20), (500, 20), (300, 20))
    region = "".join(f'<Position><WorldPosition x="{x}" y="{y}"/></Position>' for x, y in corners)
    run = playing(tmp_path, traffic(area(8, "false", f"<Polygon>{region}</Polygon>")), minor=3)
    found = begins(run)
    assert len(found) == 8
    assert all(299.0 < row.x < 501.0 for row in found)


def test_nobody_of_traffic_touches_another(tmp_path):
    jam = traffic(swarm(40, 10, 200, 60)) + traffic(source(-3, 60, 1, 1.0, 25), "fast")
    run = playing(tmp_path, jam, end=20)
    by_time = {}
    for row in run.rows:
        by_time.setdefault(row.time, []).append(row)
    for rows in by_time.values():
        for a, b in pairwise(sorted(rows, key=lambda r: (round(r.y), r.x))):
            assert abs(a.y - b.y) > 2.0 or abs(a.x - b.x) > 4.0, (a, b)


def test_places_are_drawn_by_the_seed(tmp_path):
    path = write(tmp_path, init=at("ego", -3, 100) + at("other", -1, 120) + traffic(swarm()))
    scenario = check(path).playable()
    first, again, other = (play_ideal(scenario, 2.0, seed=seed).csv() for seed in (1, 1, 2))
    assert first == again != other


def test_too_many_are_told_and_fewer_come(tmp_path):
    found = check(write(tmp_path, init=at("ego", -3, 100) + traffic(swarm(5000))))
    assert any("at most 100" in f.what for f in found.findings)
    wrong = check(write(tmp_path, init=at("ego", -3, 100) + traffic(source(rate=-1))))
    assert [f.what for f in wrong.findings if f.element == "TrafficSourceAction"] == [
        "rate must be >= 0, got -1"
    ]


def test_a_collision_with_any_vehicle_may_be_one_with_traffic(tmp_path):
    hit = """<ByEntityCondition><TriggeringEntities triggeringEntitiesRule="any"><EntityRef
entityRef="other"/></TriggeringEntities><EntityCondition><CollisionCondition><ByType
type="vehicle"/></CollisionCondition></EntityCondition></ByEntityCondition>"""
    init = at("ego", -3, 100) + at("other", -2, 70, 30) + traffic(source(-2, 300, 1, 0.1, 5))
    run = told(tmp_path, init=init, stop=condition(hit) + condition(time(20)))
    assert 5.0 < run.rows[-1].time < 12.0


def test_nobody_appears_before_somebody_fast(tmp_path):
    init = at("ego", -3, 100) + at("other", -2, 240, 30) + traffic(source(-2, 300, 1, 0.5, 10))
    first = begins(told(tmp_path, init=init))[0]
    assert first.time > 60.0 / 30.0
