"""Surfaces: what a patch says acts at each wheel, by the physical model and at the speed driven."""

from dataclasses import replace
from math import hypot

import numpy as np
import pytest
from shapely.geometry import Point, Polygon

from skidpad.core.environment.surface import SurfacePatch, present_patches
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.states import ActorStates
from skidpad.core.vocabulary import GripModel
from skidpad.physics.grip import Road, grip_params, mu_at, physical_params, road_surface
from skidpad.physics.presets import find_weather
from skidpad.physics.types import vehicle_type
from skidpad.roads.baked import load_baked
from skidpad.roads.bundled import FOLDER, bake_file, load_map
from skidpad.roads.roadside import Bridge
from skidpad.roads.surface_outlines import outline_patches
from skidpad.simulation.world.patches import Patches
from skidpad.simulation.world.placed import places_for
from skidpad.simulation.world.surface_files import read_surface

ROAD = load_map("straight")
X, Y, Z = (float(v[500]) for v in (ROAD.samples.x, ROAD.samples.y, ROAD.samples.z))
PLACE = ROAD.project(X, Y, Z)


def patches(*found, weather="clear-noon", model=GripModel.PHYSICAL):
    outside = find_weather(weather)
    return Patches(ROAD, found, Road(outside, model))


@pytest.mark.parametrize("v", [0.0, 15.0, 30.0])
@pytest.mark.parametrize("weather", ["clear-noon", "rain-noon"])
def test_water_lowers_friction_as_a_road_with_that_film_does(weather, v):
    found = patches(SurfacePatch(water_mm=2.0, circle=(X, Y, 3.0)), weather=weather)
    outside = find_weather(weather)
    road = road_surface(outside)
    deep = physical_params(replace(road, film_mm=max(road.film_mm, 2.0)))
    expected = mu_at(deep, v) / mu_at(grip_params(outside, GripModel.PHYSICAL), v)
    assert found.ratio_at(X, Y, Z, v) == pytest.approx(expected)
    assert found.ratio_at(X + 3.1, Y, Z, v) == 1.0


def test_a_film_that_the_weather_has_already_changes_nothing():
    outside = find_weather("rain-noon")
    thin = 0.5 * road_surface(outside).film_mm
    found = patches(SurfacePatch(water_mm=thin, circle=(X, Y, 3.0)), weather="rain-noon")
    assert found.ratio_at(X, Y, Z, 20.0) == pytest.approx(1.0)


def test_ice_on_a_dry_road_is_as_slippery_as_an_icy_road():
    found = patches(SurfacePatch(ice_mm=3.0, circle=(X, Y, 3.0)))
    icy = physical_params(replace(road_surface(find_weather("clear-noon")), ice_mm=3.0))
    dry = grip_params(find_weather("clear-noon"), GripModel.PHYSICAL)
    assert found.ratio_at(X, Y, Z) * mu_at(dry, 0.0) == pytest.approx(mu_at(icy, 0.0))
    assert mu_at(icy, 0.0) < 0.15


def test_slush_between_the_wheel_paths_is_felt_beside_them():
    found = patches(SurfacePatch(slush_mm=8.0, road=PLACE.road, side="beside_wheel_paths"))
    heading = float(ROAD.samples.heading[500])
    at = [(X - left * np.sin(heading), Y + left * np.cos(heading)) for left in (0.75, 0.0)]
    path, between = (found.ratio_at(*xy, Z, 20.0) for xy in at)
    assert path == 1.0
    assert between < 0.25


def test_the_slippery_one_of_two_patches_counts():
    found = patches(
        SurfacePatch(friction=0.7, circle=(X, Y, 5.0)),
        SurfacePatch(friction=0.4, circle=(X, Y, 1.0)),
    )
    assert found.ratio_at(X, Y, Z) == 0.4
    assert found.ratio_at(X + 2.0, Y, Z) == 0.7


def test_a_stretch_covers_its_lane_its_side_and_nothing_else():
    stretch = SurfacePatch(
        friction=0.5, road=PLACE.road, lane=PLACE.lane_id, side="right",
        s=(ROAD.s_road(PLACE) - 5.0, ROAD.s_road(PLACE) + 5.0),
    )  # fmt: skip
    found = patches(stretch)
    heading = float(ROAD.samples.heading[500])
    right = (X + np.sin(heading), Y - np.cos(heading))
    left = (X - np.sin(heading), Y + np.cos(heading))
    assert found.ratio_at(*right, Z) == 0.5
    assert found.ratio_at(*left, Z) == 1.0
    ahead = right[0] + 7.0 * np.cos(heading), right[1] + 7.0 * np.sin(heading)
    assert found.ratio_at(*ahead, Z) == 1.0


@pytest.mark.parametrize(
    ("side", "wet"),
    [("wheel_paths", [0.5, 0.75, 1.0]), ("beside_wheel_paths", [0.0, 0.3, 1.2, 1.7])],
)
def test_wheel_paths_and_the_rest_of_a_lane_are_wet_apart(side, wet):
    """Paths are 0.6 m wide, 0.75 m left and right of the middle of each lane."""
    found = patches(SurfacePatch(friction=0.5, road=PLACE.road, side=side))
    heading = float(ROAD.samples.heading[500])
    for offset in (0.0, 0.3, 0.5, 0.75, 1.0, 1.2, 1.7):
        for left in (offset, -offset):
            at = X - left * np.sin(heading), Y + left * np.cos(heading)
            assert (found.ratio_at(*at, Z) == 0.5) is (offset in wet), left


def test_a_road_that_has_dried_in_its_wheel_paths_is_wet_beside_them():
    """In the middle of the lane all wheels are dry, 0.4 m aside all are wet."""
    found = patches(SurfacePatch(water_mm=0.5, road=PLACE.road, side="beside_wheel_paths"))
    car = vehicle_type("hatchback")
    found.set_vehicles([car])
    heading = float(ROAD.samples.heading[500])
    wet = {}
    for left in (0.0, 0.4):
        states = ActorStates.empty(1)
        states.x[0], states.y[0] = X - left * np.sin(heading), Y + left * np.cos(heading)
        states.z[0], states.yaw[0], states.vx[0] = Z, heading, 20.0
        states.present[0] = True
        share, stiffness, film = (np.zeros((1, 4)) for _ in range(3))
        found.fill(states, places_for(np.ones(1), np.ones(1)), share, stiffness, film)
        wet[left] = (share[0] < 1.0).tolist()
    assert wet == {0.0: [False] * 4, 0.4: [True] * 4}


@pytest.mark.parametrize(("side", "strips"), [("wheel_paths", 2), ("beside_wheel_paths", 3)])
def test_strips_are_drawn_beside_each_other(side, strips):
    stretch = {"road": PLACE.road, "lane": PLACE.lane_id, "s": (100.0, 200.0)}
    parts = outline_patches(ROAD, [SurfacePatch(water_mm=1.0, side=side, **stretch)])
    (whole,) = outline_patches(ROAD, [SurfacePatch(water_mm=1.0, **stretch)])
    assert len(parts) == strips
    covered = sum(Polygon(part.corners).area for part in parts)
    paths = 2 * 0.6 / PLACE.width
    share = paths if side == "wheel_paths" else 1.0 - paths
    assert covered == pytest.approx(share * Polygon(whole.corners).area, rel=1e-6)


def test_the_bounds_leave_out_only_where_nothing_is():
    found = patches(SurfacePatch(friction=0.5, circle=(X, Y, 4.0)))
    rng = np.random.default_rng(3)
    for _ in range(300):
        x, y = X + rng.uniform(-40, 40), Y + rng.uniform(-40, 40)
        assert (found.ratio_at(x, y, Z) < 1.0) == (hypot(x - X, y - Y) <= 4.0)


def covers(patch, x, y, z):
    """The same in plain words, without a kernel."""
    if patch.circle is not None:
        return hypot(x - patch.circle[0], y - patch.circle[1]) <= patch.circle[2]
    if patch.polygon:
        return Polygon(patch.polygon).contains(Point(x, y))
    place = ROAD.project(x, y, z)
    if place is None or abs(place.offset) > place.width / 2 or place.road != patch.road:
        return False
    low, high = patch.stretch
    on_side = patch.side == "both" or (place.offset > 0) == (patch.side == "left")
    return on_side and patch.lane in (None, place.lane_id) and low <= ROAD.s_road(place) <= high


def test_the_kernel_finds_the_patch_that_plain_words_find():
    star = ((X, Y - 9), (X + 3, Y), (X + 9, Y + 9), (X, Y + 4), (X - 9, Y + 9), (X - 3, Y))
    laid = [
        SurfacePatch(
            friction=0.9, road=PLACE.road, s=(ROAD.s_road(PLACE) - 6, ROAD.s_road(PLACE) + 8)
        ),
        SurfacePatch(friction=0.8, road=PLACE.road, lane=PLACE.lane_id, side="right"),
        SurfacePatch(friction=0.7, polygon=star),
        SurfacePatch(friction=0.6, circle=(X + 4, Y - 2, 5.0)),
    ]
    found, rng = patches(*laid), np.random.default_rng(5)
    seen = set()
    for _ in range(400):
        x, y = float(X + rng.uniform(-15, 15)), float(Y + rng.uniform(-15, 15))
        wanted = min((p.friction for p in laid if covers(p, x, y, Z)), default=1.0)
        assert found.ratio_at(x, y, Z) == wanted, (x, y)
        seen.add(wanted)
    assert seen == {0.6, 0.7, 0.8, 0.9, 1.0}


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("puddles: []", "must be a mapping with `patches` or `crg`"),
        ("patches: []", "a list of at least one patch"),
        ("patches: [{water_mm: 1}]", "patches[0]: needs one of circle, polygon, road and bridges"),
        ("patches: [{circle: [0, 0, 1]}]", "needs either friction or a depth"),
        ("patches: [{friction: 0.5, ice_mm: 1, road: 1}]", "needs either friction or a depth"),
        ("patches: [{water_mm: 13, road: 1}]", "water_mm must be between 0 and 10, got 13"),
        ("patches: [{slush_mm: 16, road: 1}]", "slush_mm must be between 0 and 15, got 16"),
        ("patches: [{friction: 0, road: 1}]", "friction must be between 0.01 and 1.5, got 0"),
        ("patches: [{friction: 0.5, circle: [0, 0, 1], side: left}]", "side goes with a road or"),
        ("patches: [{friction: 0.5, circle: [0, 0, 1], s: [0, 1]}]", "lane and s go with a road"),
        ("patches: [{ice_mm: 1, bridges: true, road: 1}]", "needs one of circle, polygon, road"),
        ("patches: [{ice_mm: 1, bridges: true, lane: 1}]", "lane and s go with a road"),
        (
            "patches: [{ice_mm: 1, bridges: true, air_below_c: 80}]",
            "air_below_c must be between -60 and 60, got 80",
        ),
        ("patches: [{friction: 0.5, road: 1, s: [5, 5]}]", "s must run from 0 or more to more"),
        ("patches: [{friction: 0.5, polygon: [[0, 0], [1, 1]]}]", "at least 3 corners, got 2"),
        ("patches: [{mud: 1}]", "mud"),
        ("patches: [{friction: 0.5, road: 1, side: middle}]", "middle"),
        ("patches: [{water_mn: 1, road: 1}]", "did you mean 'water_mm'"),
        (
            "patches: [{slush_mm: lots, road: 1}]",
            "slush_mm must be a number from 0 to 15, got 'lots'",
        ),
        (
            "patches: [{friction: [1], road: 1}]",
            "friction must be a number from 0.01 to 1.5, got [1]",
        ),
        ("patches: [{ice_mm: 1, road: A}]", "road: Expected `int | null`, got `str`, got 'A'"),
        (
            "patches: [{ice_mm: 1, circle: [0, 0]}]",
            "circle: Expected `array` of length 3, got 2, got [0, 0]",
        ),
        ("patches: [3]", "patches[0]: Expected `object`, got `int`"),
    ],
)
def test_a_wrong_file_is_refused_in_one_sentence(text, complaint, tmp_path):
    path = tmp_path / "surface.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        read_surface(path)
    assert complaint in str(caught.value)
    assert "surface.yaml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_named_once(tmp_path):
    with pytest.raises(FileError) as caught:
        read_surface(tmp_path / "gone.yaml")
    assert str(caught.value).startswith(f"surface {tmp_path}/gone.yaml: cannot be read")
    assert str(caught.value).count("gone.yaml") == 1


@pytest.mark.parametrize(
    ("patch", "complaint"),
    [
        (SurfacePatch(friction=0.5, road=77, name="ice"), "(ice): map straight has no road 77"),
        (SurfacePatch(friction=0.5, road=PLACE.road, s=(1e5, 2e5)), "runs from 0.0 to"),
        (SurfacePatch(friction=0.5, road=PLACE.road, lane=9, s=(0.0, 10.0)), "has lanes"),
    ],
)
def test_a_patch_on_no_road_of_the_map_says_what_there_is(patch, complaint):
    with pytest.raises(ConfigError) as caught:
        patches(patch)
    assert complaint in str(caught.value)


BRIDGE = '<objects><bridge id="b" s="300" length="40" name="" type="concrete">{}</bridge>'


def bridge_map(folder, lanes=""):
    """The straight road, of which 40 m are a bridge."""
    text = (FOLDER / "straight.xodr").read_text("utf-8")
    assert text.count("<objects>") == 1
    (folder / "bridge.xodr").write_text(text.replace("<objects>", BRIDGE.format(lanes)))
    return load_map(folder / "bridge.xodr")


def icy_bridge(map, air_c, **where):
    """Ice on bridges below 1 degree, in air of this temperature above a road at 4 degrees."""
    weather = replace(find_weather("clear-noon"), air_temperature_c=air_c, road_temperature_c=4.0)
    ice = SurfacePatch(ice_mm=1.0, air_below_c=1.0, **(where or {"bridges": True}))
    return Patches(map, [ice], Road(weather, GripModel.PHYSICAL))


def friction_along(map, found, lane=-2):
    """The share of the friction in the middle of a lane at 290, 310, 330 and 350 m."""
    i = int(np.flatnonzero((map.lanes.road == PLACE.road) & (map.lanes.lane_id == lane))[0])
    at = [
        map.at(i, s - float(map.samples.s_road[map.lanes.first[i]])) for s in (290, 310, 330, 350)
    ]
    return [found.ratio_at(p.x, p.y, p.z) for p in at]


def test_bridges_of_the_map_are_icy_while_the_air_is_colder_than_said(tmp_path):
    map = bridge_map(tmp_path)
    assert friction_along(map, icy_bridge(map, 1.0)) == [1.0] * 4
    before, one, two, after = friction_along(map, icy_bridge(map, 0.9))
    assert (before, after) == (1.0, 1.0)
    assert one == two < 0.15
    by_hand = icy_bridge(ROAD, 0.9, road=PLACE.road, s=(300.0, 340.0))
    assert friction_along(ROAD, by_hand) == [before, one, two, after]


def test_a_bridge_under_some_lanes_freezes_there_alone(tmp_path):
    map = bridge_map(tmp_path, '<validity fromLane="-2" toLane="-2"/>')
    found = icy_bridge(map, -3.0)
    assert friction_along(map, found, -2)[1] < 0.15
    assert friction_along(map, found, -3)[1] == 1.0


def test_colder_weather_lays_the_ice_and_warmer_weather_takes_it(tmp_path):
    map = bridge_map(tmp_path)
    found = icy_bridge(map, 5.0)
    for air_c, icy in ((5.0, False), (-1.0, True), (5.0, False)):
        found.lay(replace(found.road, weather=replace(found.road.weather, air_temperature_c=air_c)))
        assert (friction_along(map, found)[1] < 0.5) is icy


def test_a_known_place_makes_the_search_short_and_changes_nothing():
    """Wheels of cars on, beside and far from the place that is told, on a road that crosses itself."""
    town = load_map("figure8")
    rng, chosen = np.random.default_rng(5), slice(0, None, 40)
    laid = [
        SurfacePatch(water_mm=4.0, road=int(road), side="wheel_paths")
        for road in sorted(set(town.lanes.road.tolist()))
    ]
    found = Patches(town, laid, Road(find_weather("rain-noon"), GripModel.PHYSICAL))
    samples = town.samples
    n = len(samples.x[chosen])
    found.set_vehicles([vehicle_type("mini_cooper_s")] * n)
    states = ActorStates.empty(n)
    states.x[:] = samples.x[chosen] + rng.normal(0.0, 2.0, n)
    states.y[:] = samples.y[chosen] + rng.normal(0.0, 2.0, n)
    states.z[:], states.yaw[:] = samples.z[chosen], rng.uniform(-np.pi, np.pi, n)
    states.vx[:], states.present[:] = 20.0, True
    unknown, near = (places_for(np.ones(n), np.ones(n)) for _ in range(2))
    near["lane"], near["sample"] = samples.lane[chosen], np.arange(len(samples.x))[chosen]
    far = near.copy()
    far["lane"], far["sample"] = np.roll(near["lane"], 3), np.roll(near["sample"], 3)
    filled = []
    for placed in (unknown, near, far):
        shares = tuple(np.zeros((n, 4)) for _ in range(3))
        found.fill(states, placed, *shares)
        filled.append(np.stack(shares).tobytes())
    assert filled[0] == filled[1] == filled[2]
    assert 0.1 < (np.frombuffer(filled[0]).reshape(3, n, 4)[0] < 1.0).mean() < 0.9


def test_a_baked_file_keeps_the_bridges_and_they_change_no_hash(tmp_path):
    map = bridge_map(tmp_path, '<validity fromLane="-3" toLane="-2"/>')
    baked = bake_file(tmp_path / "bridge.xodr")
    assert baked.roadside.bridges == (Bridge(PLACE.road, 300.0, 340.0, (-3, -2)),)
    baked.save(tmp_path / "bridge.npz")
    assert load_baked(tmp_path / "bridge.npz").roadside.bridges == baked.roadside.bridges
    assert map.content_hash == ROAD.content_hash


def test_bridges_are_drawn_where_they_are_and_only_when_cold(tmp_path):
    map = bridge_map(tmp_path)
    ice = SurfacePatch(ice_mm=1.0, bridges=True, air_below_c=1.0)
    shown = outline_patches(map, present_patches([ice], 0.0))
    corners = [corner for outline in shown for corner in outline.corners.tolist()]
    along = [map.s_road(map.project(*corner)) for corner in corners]
    assert {o.kind for o in shown} == {"ice"}
    assert max(along) - min(along) == pytest.approx(40.0, abs=2.5)
    assert present_patches([ice], 1.0) == ()


def test_a_map_without_bridges_says_so():
    with pytest.raises(ConfigError, match=r"map straight names no <bridge>; say road and s"):
        icy_bridge(ROAD, -3.0)


def test_a_wrong_bridge_of_a_map_names_file_line_and_field(tmp_path):
    text = (FOLDER / "straight.xodr").read_text("utf-8")
    wrong = BRIDGE.format("").replace('length="40"', 'length="-4"')
    (tmp_path / "bad.xodr").write_text(text.replace("<objects>", wrong))
    with pytest.raises(FileError, match=r"bad.xodr, line \d+: <bridge id=b> needs length of 0"):
        load_map(tmp_path / "bad.xodr")
