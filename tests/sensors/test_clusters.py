"""Clusters hold every triangle once, in order, inside their spheres."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from skidpad.sensors.scene.static import SIZE, cluster


@given(st.lists(st.integers(0, 3 * SIZE), min_size=1, max_size=5), st.integers(0, 2**32 - 1))
def test_clusters_hold_the_same_triangles_in_the_same_order(sizes, seed):
    if not sum(sizes):
        sizes[0] = 1
    random = np.random.default_rng(seed)
    vertices = random.normal(size=(40, 3))
    triangles = random.integers(0, 40, size=(sum(sizes), 3)).astype(np.int32)
    found, per_block = cluster(vertices, triangles, np.array(sizes, dtype=np.int32))
    assert per_block.tolist() == [-(-n // SIZE) for n in sizes]
    corners = []
    for k in range(len(found.radius)):
        first, count = found.triangle_start[k], found.triangle_count[k]
        assert 1 <= count <= SIZE
        part = slice(found.vertex_start[k], found.vertex_start[k] + found.vertex_count[k])
        own = found.vertices[part]
        corners.append(own[found.triangles[first : first + count]])
        assert (np.linalg.norm(own - found.centre[k], axis=1) <= found.radius[k]).all()
    assert np.array_equal(np.concatenate(corners), vertices[triangles])
