"""What is hidden is skipped and near chunks are drawn first: no bit of a picture may show it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.specs import CameraSpec, Modality
from skidpad.core.vocabulary import Bodywork, Scenery
from skidpad.roads.bundled import load_map
from skidpad.scenery.dressing import dress_map
from skidpad.sensors.bench import convoy
from skidpad.sensors.raster.canvas import BACKGROUND
from skidpad.sensors.raster.live_scene import LiveScene
from skidpad.sensors.raster.passes import Pass
from skidpad.sensors.raster.rasteriser import AUTO_LEVEL, MOST_RANKS
from skidpad.sensors.raster.view import camera_view

AHEAD = CameraSpec("ahead", Modality.RGB, 160, 120, 75.0, Pose(0.5, 0.0, 1.4))
DOWN = CameraSpec("down", Modality.RGB, 200, 200, 70.0, Pose(4.0, 0.0, 26.0, 0.0, np.pi / 2, 0.0))


def scene_on(map_name):
    table, states = convoy(load_map(map_name))
    scene = LiveScene(dress_map(load_map(map_name), Scenery.FULL), table, 1600, Bodywork.SHAPED)
    scene.place(states, 0.05)
    scene.show({})
    return scene, states


def rows_of(chunks, rows):
    fields = {f: getattr(chunks, f)[rows] for f in chunks._fields if f not in ("clusters", "key")}
    return chunks._replace(**fields)


def draw(scene, camera, pose, chunks=None, actors=True):
    out, static = Pass(camera), scene.static
    scene.actors.present[:] = actors
    if chunks is not None:
        scene.static = replace(static, chunks=rows_of(static.chunks, chunks))
    scene.draw(camera_view(camera, pose), 0, AUTO_LEVEL, out)
    scene.static = static
    return out


@pytest.mark.parametrize(
    ("map_name", "camera", "actor"),
    [("town", AHEAD, 0), ("town", AHEAD, 11), ("figure8", AHEAD, 4), ("figure8", DOWN, 5)],
)
def test_a_picture_is_that_of_its_chunks_drawn_one_by_one(map_name, camera, actor):
    scene, states = scene_on(map_name)
    pose = states.pose(actor)
    inverse = np.zeros((camera.height, camera.width), np.float32)
    key = np.full((camera.height, camera.width), BACKGROUND, np.int32)
    ties = 0
    chunks = [[c] for c in range(len(scene.static.chunks.radius))]
    for part in [draw(scene, camera, pose, c, False) for c in chunks] + [
        draw(scene, camera, pose, [], True)
    ]:
        ties += ((part.inverse == inverse) & (part.inverse > 0) & (part.key != key)).sum()
        nearer = part.inverse > inverse
        inverse[nearer], key[nearer] = part.inverse[nearer], part.key[nearer]
    whole = draw(scene, camera, pose)
    assert np.array_equal(whole.inverse, inverse)
    assert np.array_equal(whole.key, key)
    if camera is DOWN:
        assert ties  # lanes of a junction lie in one plane: the first is seen


def test_pictures_of_many_rows_are_those_of_their_parts():
    scene, states = scene_on("town")
    camera = CameraSpec("wide", Modality.RGB, 1600, 900, 70.0, Pose(0.5, 0.0, 1.4))
    whole, parts = draw(scene, camera, states.pose(0)), Pass(camera)
    view = camera_view(camera, states.pose(0))
    for top, end in ((0, 7), (7, 500), (500, 900)):
        scene.draw(view._replace(top=top, height=end), 0, AUTO_LEVEL, parts)
    assert np.array_equal(whole.inverse, parts.inverse)
    assert np.array_equal(whole.key, parts.key)


def test_chunks_in_sight_without_number_are_drawn_in_the_maps_order():
    scene, states = scene_on("figure8")
    chunks = scene.static.chunks
    small = np.flatnonzero(chunks.triangle_count[:, 0] <= 24)
    away = np.linalg.norm(chunks.centre[small] - scene.actors.position[0], axis=1)
    some = small[np.argsort(away)[:40]]
    camera = replace(AHEAD, width=40, height=30)
    few = draw(scene, camera, states.pose(0), some, False)
    many = draw(scene, camera, states.pose(0), np.tile(some, MOST_RANKS // 2), False)
    assert np.array_equal(few.inverse, many.inverse)
    assert np.array_equal(few.key, many.key)
    assert (few.key != BACKGROUND).any()
