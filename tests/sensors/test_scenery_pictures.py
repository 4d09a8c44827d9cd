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
from skidpad.sensors.finish.extras import ALL_EXTRAS
from skidpad.sensors.pictures.roughness import COARSE_SIZE, SIZE, make_tiles
from skidpad.sensors.scene.grain import NO_GRAIN
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.road_mesh import road_pieces
from skidpad.sensors.scene.shapes import shape_levels
from skidpad.sensors.scene.static import build_scene
from skidpad.sensors.scene.street_light import NO_STREET_LIGHT, street_light_of
from skidpad.sensors.suite import PixelSettings, PixelSuite
from support.sensors.worlds import states_at, table_of

EYE = Pose(0.5, 0.0, 1.5)


def look(scenery: Scenery, lane: int, share: float, weather: str = "clear-noon"):
    """Returns colours, classes and inverse depth from a place on a lane of the town."""
    road_map = dress_map(load_map("town"), scenery)
    cameras = [CameraSpec(m.value, m, 400, 300, 90.0, EYE) for m in list(Modality)[:3]]
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
    assert suite.shading._grain.shape == (256, 4)
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
    assert scene.grain.shape == (0, 4)


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


def test_new_and_worn_asphalt_differs_in_material_only() -> None:
    road_map = load_map("town")
    even = [m[0] for _, m in road_pieces(road_map.samples, road_map.lanes)]
    aged = [m[0] for _, m in road_pieces(road_map.samples, road_map.lanes, ages=True)]
    found = set()
    for a, b in zip(even, aged, strict=True):
        assert np.array_equal(a.vertices, b.vertices)
        assert np.array_equal(a.label, b.label)
        differs = a.material != b.material
        assert set(a.material[differs].tolist()) <= {Material.ASPHALT}
        found |= set(b.material[differs].tolist())
    assert found == {Material.NEW_ASPHALT, Material.WORN_ASPHALT}
    plain = build_scene(road_map.samples, road_map.lanes, road_map.roadside)
    assert not found & set((plain.chunks.key & 255).tolist())


def test_noise_of_surfaces_repeats_without_a_seam() -> None:
    tiles = make_tiles()
    patches = tiles[SIZE * SIZE :].reshape(COARSE_SIZE, COARSE_SIZE, 4)[..., 0].astype(int)
    inside = np.abs(np.diff(patches, axis=0)).mean()
    assert np.abs(patches[0] - patches[-1]).mean() < 1.5 * inside


def test_street_lamps_light_the_ground_at_night_only_and_fade_as_a_point_of_light() -> None:
    lamp = Box(SemanticClass.POLE, 10.0, 20.0, 7.0, 0.0, 0.3, 0.8, 0.2, shape=Shape.LAMP)
    light = street_light_of([lamp])
    grid = light.light.reshape(light.rows, light.columns)
    i, j = round(10.0 - light.x0), round(20.0 - light.y0)
    assert grid.argmax() == i * light.columns + j
    share = (1.0 - (7.0 / 30.0) ** 2) / 2.0**1.5  # as far away as the lamp is high
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
