"""The same triangles through Embree, an independent ray tracer: the oracle of the images."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.core.vocabulary import SemanticClass
from skidpad.sensors.raster.view import NEAR
from skidpad.sensors.scene.materials import Material


def triangles_of(suite, view, hidden=0):
    """(m, 3, 3) full-detail triangles in camera axes, and their keys with the instance."""
    chunks, actors = suite.scene.static.chunks, suite.scene.actors
    clusters = chunks.clusters
    corners, keys = [], []
    for c in range(len(chunks.radius)):
        first = chunks.cluster_start[c, 0]
        for k in range(first, first + chunks.cluster_count[c, 0]):
            t0 = clusters.triangle_start[k]
            t = slice(t0, t0 + clusters.triangle_count[k])
            corners.append(clusters.vertices[clusters.triangles[t] + clusters.vertex_start[k]])
            keys.append(suite.scene.key[t])
    for n in range(len(actors.radius)):
        if n == hidden or not actors.present[n]:
            continue
        t = slice(actors.triangle_start[n], actors.triangle_start[n] + actors.triangle_count[n])
        body = actors.vertices[actors.triangles[t] + actors.vertex_start[n]]
        corners.append(body @ actors.rotation[n].T + actors.position[n])
        keys.append(actors.key[t] | (n + 1) << 16)
    seen = (np.concatenate(corners) - view.centre) @ view.rotation.T
    return seen, np.concatenate(keys)


def trace(suite, view, directions, hidden=0):
    """Planar depth and key along (k, 3) directions (u, v, 1); inf and sky where nothing is hit."""
    pytest.importorskip("embreex")
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh

    corners, keys = triangles_of(suite, view, hidden)
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, np.ascontiguousarray(corners, dtype=np.float32))
    rays = np.ascontiguousarray(directions, dtype=np.float32)
    found = scene.run(np.ascontiguousarray(NEAR * rays), rays, output=1)
    hit = found["primID"] >= 0
    depth = np.where(hit, found["tfar"] + NEAR, np.inf)
    background = int(SemanticClass.SKY) << 8 | int(Material.SKY)
    return depth, np.where(hit, keys[found["primID"]], background)


def pixel_directions(view):
    """(H * W, 3) through the pixel centres, with third component 1."""
    v, u = np.mgrid[0 : view.height, 0 : view.width]
    u, v = (u + 0.5 - view.cx) / view.focal, (v + 0.5 - view.cy) / view.focal
    return np.stack([u, v, np.ones_like(u)], axis=-1).reshape(-1, 3)
