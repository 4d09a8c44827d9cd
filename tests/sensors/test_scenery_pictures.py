"""Pictures of a map with generated scenery: what they show, how even they are, what grain may change."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.specs import CameraSpec, Modality
from skidpad.core.vocabulary import Scenery, SemanticClass
from skidpad.physics.presets import preset
from skidpad.roads.bundled import load_map
from skidpad.roads.roadside import Box, Shape
from skidpad.scenery.dressing import dress_map
from skidpad.sensors.finish.extras import ALL_EXTRAS, Extra
from skidpad.sensors.pictures.blocks import BLOCK, COLUMNS, LANES, R, W, gather
from skidpad.sensors.pictures.lane_wear import soften_border
from skidpad.sensors.pictures.roughness import COARSE_SIZE, SIZE, make_tiles
from skidpad.sensors.pictures.settled_snow import NOTHING_SETTLES
from skidpad.sensors.scene.grain import BENEATH, NO_GRAIN
from skidpad.sensors.scene.grain import COLUMNS as GRAIN_COLUMNS
from skidpad.sensors.scene.materials import ASPHALTS, FIELDS, MATERIALS, Material, base_palette
from skidpad.sensors.scene.mesh import Mesh
from skidpad.sensors.scene.road_mesh import road_pieces
from skidpad.sensors.scene.shapes import shape_levels
from skidpad.sensors.scene.static import build_scene, ground_pieces
from skidpad.sensors.scene.street_light import NO_STREET_LIGHT, street_light_of
from skidpad.sensors.suite import PixelSettings, PixelSuite
from support.sensors.worlds import states_at, straight, table_of

EYE = Pose(0.5, 0.0, 1.5)


def look(scenery: Scenery, lane: int, share: float, weather: str = "clear-noon", eye: Pose = EYE):
    """Returns colours, classes and inverse depth from a place on a lane of the town."""
    road_map = dress_map(load_map("town"), scenery)
    cameras = [CameraSpec(m.value, m, 400, 300, 90.0, eye) for m in list(Modality)[:3]]
    settings = PixelSettings(extras=ALL_EXTRAS, in_cockpit=False)
    suite = PixelSuite(road_map, table_of([]), cameras, preset(weather), settings)
    row = int(road_map.lanes.first[lane] + share * (road_map.lanes.size[lane] - 1))
    x, y, z, yaw = (
        float(v[row])
        for v in (
            road_map.samples.x,
            road_map.samples.y,
            road_map.samples.z,
            road_map.samples.heading,
        )
    )
    images = suite.observe(0, states_at([(x, y, z, yaw)]), {}).images
    return (
        suite,
        images["rgb"].rgb.copy(),
        images["semantic"].labels.copy(),
        images["depth"].inverse_depth.copy(),
    )


def share_of_commonest(rgb: np.ndarray) -> float:
    """Returns the share of pixels in the 8 commonest colours: 5 x 5 median, 5 bits a channel."""
    few = cv2.medianBlur(np.ascontiguousarray(rgb), 5).astype(int) >> 3
    counts = np.bincount(((few[..., 0] << 10) | (few[..., 1] << 5) | few[..., 2]).ravel())
    return float(np.sort(counts)[-8:].sum() / counts.sum())


def test_a_street_shows_buildings_trees_and_posts_that_it_did_not_have() -> None:
    _, _, before, _ = look(Scenery.NONE, 3, 0.5)
    _, _, after, _ = look(Scenery.FULL, 3, 0.5)
    for kind in (SemanticClass.VEGETATION, SemanticClass.POLE):  # it has buildings of its own
        assert (after == kind).mean() > 1.2 * (before == kind).mean(), kind


def test_grain_changes_colours_only() -> None:
    suite, rgb, labels, depth = look(Scenery.FULL, 3, 0.5)
    assert suite.shading._grain.shape == (256, GRAIN_COLUMNS)
    suite.shading._grain = NO_GRAIN
    ego = suite._ego
    plain = suite.observe(1, states_at([(ego.x, ego.y, ego.z, ego.yaw)]), {}).images
    assert np.array_equal(plain["semantic"].labels, labels)
    assert np.array_equal(plain["depth"].inverse_depth, depth)
    changed = (plain["rgb"].rgb != rgb).any(axis=2)
    assert changed[labels == SemanticClass.ROAD].mean() > 0.8


def test_without_scenery_there_is_no_grain() -> None:
    road_map = load_map("town")
    scene = build_scene(road_map.samples, road_map.lanes, road_map.roadside)
    assert scene.grain.shape == (0, GRAIN_COLUMNS)


def test_every_shape_stays_in_its_box_and_farther_levels_have_no_more_triangles() -> None:
    road_map = dress_map(load_map("town"), Scenery.FULL)
    seen = set()
    for box in road_map.roadside.boxes:
        if box.shape.name == "BOX" or (box.shape in seen and len(seen) < 9):
            continue
        seen.add(box.shape)
        levels = shape_levels(box, 40)
        sizes = [len(m.triangles) for m in levels]
        assert sizes == sorted(sizes, reverse=True)
        half = np.array([box.length / 2, box.width / 2])
        for mesh in levels:
            assert (np.abs(mesh.vertices[:, :2]).max(axis=0) <= half + 0.07).all(), box
            assert mesh.vertices[:, 2].min() >= -1e-9
            assert mesh.vertices[:, 2].max() <= box.height + 1e-9, box
            assert set(mesh.label.tolist()) == {box.label}
    assert len(seen) >= 9


@pytest.mark.parametrize(("lane", "share"), [(3, 0.5), (0, 0.4)])
def test_colours_are_spread_more_evenly_than_without(lane: int, share: float) -> None:
    plain = share_of_commonest(look(Scenery.NONE, lane, share)[1])
    full = share_of_commonest(look(Scenery.FULL, lane, share)[1])
    assert full < 0.5 * plain


def test_age_and_tracks_of_asphalt_differ_in_material_only() -> None:
    road_map = load_map("town")
    even = [m for _, m in road_pieces(road_map.samples, road_map.lanes)]
    aged = [m for _, m in road_pieces(road_map.samples, road_map.lanes, ages=True)]
    near, far = set(), set()
    for a, b in zip(even, aged, strict=True):
        assert np.array_equal(a[2].vertices, b[2].vertices)  # too far away for tracks
        differs = a[2].material != b[2].material
        assert set(a[2].material[differs].tolist()) <= {Material.ASPHALT}
        far |= set(b[2].material[differs].tolist())
        assert set(a[0].label.tolist()) == set(b[0].label.tolist())
        road = [np.isin(m[0].material, ASPHALTS) for m in (a, b)]
        area = [_area_of(m[0], rows) for m, rows in zip((a, b), road, strict=True)]
        assert area[1] == pytest.approx(area[0], rel=1e-6), "strips fill the lane and no more"
        near |= set(b[0].material[road[1]].tolist())
    assert far == {Material.NEW_ASPHALT, Material.WORN_ASPHALT}
    assert near == set(ASPHALTS)
    plain = build_scene(road_map.samples, road_map.lanes, road_map.roadside)
    assert not (near - {Material.ASPHALT}) & set((plain.chunks.key & 255).tolist())


def test_strips_of_one_asphalt_run_into_each_other_and_into_nothing_else() -> None:
    runs = [(Material.ASPHALT, 40), (Material.ASPHALT_TRACK, 30), (Material.ASPHALT, 30)]
    keys = np.repeat([*(m for m, _ in runs), Material.NEW_OIL], [*(n for _, n in runs), 20])
    keys = keys.astype(np.int32)
    table = np.zeros((2 * MATERIALS, COLUMNS), dtype=np.float32)
    table[:MATERIALS, :3] = (base_palette() / 255.0) ** 2
    work = np.zeros(LANES * BLOCK, dtype=np.float32)
    gather(keys[None], 0, 0, keys.size, table, work)
    work[W : W + keys.size] = 0.1  # 10 m away
    before = work.copy()
    borders = (0, 40, 70, 100, 120)
    for begin, middle, end in zip(borders, borders[1:], borders[2:], strict=False):
        soften_border(np.float32(400.0), begin, middle, end, keys, table, work)
    red, old = work[R : R + keys.size], before[R : R + keys.size]
    assert np.abs(np.diff(red[:90])).max() < 0.3 * np.abs(np.diff(old[:90])).max()
    assert (np.diff(red[:50]) >= 0.0).all()
    assert np.array_equal(red[86:], old[86:]), "another asphalt keeps its joint"
    assert np.array_equal(red[:28], old[:28]), "11 px are 0.28 m"
    actors = keys + (1 << 16)
    table[MATERIALS:] = table[:MATERIALS]
    work[:] = before
    soften_border(np.float32(400.0), 0, 40, 70, actors, table, work)
    assert np.array_equal(work, before), "actors have no strips"


def _area_of(mesh: Mesh, rows: np.ndarray) -> float:
    """Returns the area in m2 of these triangles."""
    a, b, c = (mesh.vertices[mesh.triangles[rows, n]] for n in range(3))
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def test_fields_lie_away_from_the_roads_and_on_dressed_maps_only() -> None:
    road_map = load_map("figure8")
    at = np.stack([road_map.samples.x, road_map.samples.y], axis=1)[::20]
    found = set()
    for sown in (False, True):
        for _, (mesh, *_) in ground_pieces(road_map.samples, fields=sown):
            used = set(mesh.material.tolist()) - {Material.GRASS}
            assert sown or not used
            if used:
                middle = mesh.vertices[:, :2].mean(axis=0)
                assert np.hypot(*(at - middle).T).min() > 60.0
            found |= used
    assert found == set(FIELDS)


def test_snow_lies_on_roofs_and_crowns_and_not_on_walls() -> None:
    lifted = Pose(-20.0, 0.0, 25.0, pitch=0.5)
    suite, rgb, labels, _ = look(Scenery.FULL, 3, 0.5, "snow", lifted)
    suite.shading._settling = NOTHING_SETTLES
    ego = suite._ego
    bare = suite.observe(0, states_at([(ego.x, ego.y, ego.z, ego.yaw)]), {}).images["rgb"].rgb
    paler = rgb.astype(int).mean(axis=2) - bare.astype(int).mean(axis=2) > 40
    for kind in (SemanticClass.VEGETATION, SemanticClass.BUILDING):
        assert 0.05 < paler[labels == kind].mean() < 0.9, kind
    assert not paler[labels == SemanticClass.ROAD].any()


def test_broad_leaved_crowns_are_bare_where_snow_lies_and_conifers_stay_green() -> None:
    boxes = dress_map(load_map("town"), Scenery.FULL).roadside.boxes
    broad = {b.rgb for b in boxes if b.shape is Shape.CROWN}
    conifers = {b.rgb for b in boxes if b.shape is Shape.CONE}
    assert not broad & conifers
    summer, winter = (look(Scenery.FULL, 3, 0.5, w)[0] for w in ("clear-noon", "snow"))
    palette = summer.scene.static.palette

    def greenness(suite: PixelSuite, colours: set[tuple[int, int, int]]) -> np.ndarray:
        numbers = [int(np.flatnonzero((palette == rgb).all(axis=1))[-1]) for rgb in colours]
        red, green, blue = suite.shading._table[numbers, :3].T
        return green / np.maximum(red, blue)

    assert (greenness(summer, broad) > 1.2).all()
    assert (greenness(winter, broad) < 1.05).all()
    assert np.array_equal(greenness(summer, conifers), greenness(winter, conifers))


def test_by_day_no_pane_tells_that_it_will_be_lit() -> None:
    for weather, alike in (("clear-noon", True), ("clear-night", False)):
        table = look(Scenery.FULL, 3, 0.5, weather)[0].shading._table
        same = np.array_equal(table[Material.LIT_WINDOW, :4], table[Material.GLASS, :4])
        assert same == alike


def test_noise_of_surfaces_repeats_without_a_seam() -> None:
    tiles = make_tiles()
    patches = tiles[SIZE * SIZE :].reshape(COARSE_SIZE, COARSE_SIZE, 4)[..., 0].astype(int)
    inside = np.abs(np.diff(patches, axis=0)).mean()
    assert np.abs(patches[0] - patches[-1]).mean() < 1.5 * inside


def test_street_lamps_light_the_ground_at_night_only_and_fade_around_their_pools() -> None:
    lamp = Box(SemanticClass.POLE, 10.0, 20.0, 7.0, 0.0, 0.3, 0.8, 0.2, shape=Shape.LAMP)
    light = street_light_of([lamp])
    grid = light.light.reshape(light.rows, light.columns)
    i, j = round(10.0 - light.x0), round(20.0 - light.y0)
    assert grid.argmax() == i * light.columns + j
    share = (1.0 - (7.0 / 30.0) ** 2) / 2.0**2.5  # as far away as the lamp is high
    assert grid[i + 7, j] / grid[i, j] == pytest.approx(share, rel=1e-4)
    assert street_light_of([]).light.size == 0
    for weather, brighter in (("clear-noon", False), ("clear-night", True)):
        suite, rgb, labels, _ = look(Scenery.FULL, 3, 0.5, weather)
        suite.shading._street_light = NO_STREET_LIGHT
        ego = suite._ego
        dark = suite.observe(0, states_at([(ego.x, ego.y, ego.z, ego.yaw)]), {}).images["rgb"].rgb
        road = np.isin(labels, [SemanticClass.ROAD, SemanticClass.SIDEWALK, SemanticClass.TERRAIN])
        gained = rgb[road].astype(int).mean() - dark[road].astype(int).mean()
        assert (gained > 2.0) if brighter else gained == 0.0


def test_street_lamps_are_seen_shining_at_night_and_not_by_day() -> None:
    for weather, shining in (("clear-noon", False), ("rain-night", True)):
        suite, *_ = look(Scenery.FULL, 3, 0.5, weather)
        boxes = dress_map(load_map("town"), Scenery.FULL).roadside.boxes
        lamps = [b for b in boxes if b.shape is Shape.LAMP]
        places = np.array([(b.x, b.y, b.z) for b in lamps])
        sources = suite._finish._sources
        at = np.stack([sources.x, sources.y, sources.z], axis=1)
        on = (np.abs(places[:, None] - at[None]).max(axis=2) < 1e-6).any(axis=1)
        near = np.hypot(places[:, 0] - suite._ego.x, places[:, 1] - suite._ego.y) < 100.0
        assert near.any()
        assert on[near].all() if shining else not on.any()


def test_near_the_camera_no_grain_is_seen_as_a_square() -> None:
    """From 1 m above the road 4 cm are 8 px: a square of one colour would show as a run of them."""
    _, rgb, labels, _ = look(Scenery.FULL, 3, 0.5, eye=Pose(3.0, 0.0, 1.0, pitch=np.pi / 2))
    road = labels == SemanticClass.ROAD
    inside = road[:, 1:] & road[:, :-1]
    assert inside.mean() > 0.9
    same = (np.diff(rgb.astype(int), axis=1) == 0).all(axis=2)
    assert same[inside].mean() < 0.5


def test_leaves_are_darker_beneath_and_snow_lies_on_the_sides_of_conifers() -> None:
    def crown(shape: Shape, weather: str) -> tuple[PixelSuite, np.ndarray, np.ndarray]:
        box = Box(SemanticClass.VEGETATION, 112.0, -8.0, 2.0, 0.0, 6.0, 6.0, 7.0, rgb=(60, 90, 45),
                  shape=shape)  # fmt: skip
        cameras = [CameraSpec("rgb", Modality.RGB, 400, 300, 75.0, EYE)]
        settings = PixelSettings(camera_effect=False, extras=frozenset({Extra.SNOW}))
        world = straight(300, boxes=[box])
        suite = PixelSuite(world, table_of([]), cameras, preset(weather), settings)
        rgb = suite.observe(0, states_at([(100.0, -8.0, 0.0, 0.0)]), {}).images["rgb"].rgb
        seen = (suite._pass_of["rgb"].key & 255) == Material.FIRST_FREE
        return suite, rgb.astype(float).mean(axis=2), seen

    suite, shaded, seen = crown(Shape.CROWN, "clear-noon")
    suite.shading._grain[:, BENEATH] = 0.0
    plain = suite.observe(1, states_at([(100.0, -8.0, 0.0, 0.0)]), {}).images["rgb"].rgb
    left = shaded / np.maximum(plain.astype(float).mean(axis=2), 1.0)
    rows = np.flatnonzero(seen.any(axis=1))
    quarter = len(rows) // 4
    ends = (rows[:quarter], rows[-quarter:])
    above, beneath = (np.median(left[part][seen[part]]) for part in ends)
    assert beneath < 0.9 * above
    _, light, seen = crown(Shape.CONE, "snow")
    assert 0.15 < (light[seen] > 140.0).mean() < 0.9, "white and green"
