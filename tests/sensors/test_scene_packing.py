"""A map is packed a few chunks at a time: the same triangles, without all of its meshes at once."""

import tracemalloc

import numpy as np

from skidpad.roads.bundled import load_map
from skidpad.sensors.scene import static
from skidpad.sensors.scene.static import Chunks, build_scene


def columns(chunks: Chunks):
    return [*chunks.clusters, *chunks[1:]]


def test_a_map_packed_in_parts_is_the_map_packed_as_one(monkeypatch):
    roads = load_map("town")
    content = roads.samples, roads.lanes, roads.roadside
    monkeypatch.setattr(static, "BATCH", 10**6)
    whole = build_scene(*content)
    monkeypatch.setattr(static, "BATCH", 50)
    tracemalloc.start()
    parts = build_scene(*content)
    left, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 4.0 * left  # 6.8 with all meshes at once
    for one, other in zip(columns(whole.chunks), columns(parts.chunks), strict=True):
        assert one.dtype == other.dtype
        assert np.array_equal(one, other)
    for one, other in zip(whole.lamps, parts.lamps, strict=True):
        assert np.array_equal(one, other)
