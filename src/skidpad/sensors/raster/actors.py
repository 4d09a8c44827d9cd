"""The moving part of the scene: a mesh per actor, and where each one is now."""

from __future__ import annotations

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind
from skidpad.sensors.raster.rasteriser import Actors
from skidpad.sensors.scene.bodies import body_mesh
from skidpad.sensors.scene.mesh import Mesh
from skidpad.sensors.scene.static import pixel_key


def make_actors(table: ActorTable) -> Actors:
    """Returns the meshes of the table's actors; those of the same shape share one. None is present yet."""
    meshes: list[Mesh] = []
    known: dict[tuple[int, float, float, float], int] = {}
    which = []
    for i in range(len(table)):
        shape = (
            int(table.kind[i]),
            float(table.length[i]),
            float(table.width[i]),
            float(table.height[i]),
        )
        if shape not in known:
            known[shape] = len(meshes)
            meshes.append(body_mesh(ActorKind(shape[0]), *shape[1:]))
        which.append(known[shape])
    if not meshes:
        meshes.append(body_mesh(ActorKind.PROP, 1.0, 1.0, 1.0))  # of nobody: arrays have a type
    vertices = np.array([len(m.vertices) for m in meshes])
    triangles = np.array([len(m.triangles) for m in meshes])
    radius = np.array([np.linalg.norm(m.vertices, axis=1).max() for m in meshes])
    n = len(table)
    return Actors(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.triangles for m in meshes]),
        np.concatenate([pixel_key(m) for m in meshes]),
        (np.cumsum(vertices) - vertices)[which].astype(np.int32),
        vertices[which].astype(np.int32),
        (np.cumsum(triangles) - triangles)[which].astype(np.int32),
        triangles[which].astype(np.int32),
        radius[which],
        np.zeros((n, 3, 3)),
        np.zeros((n, 3)),
        np.zeros(n, dtype=np.bool_),
    )


def place_actors(states: ActorStates, out: Actors) -> None:
    """Writes each actor's rotation matrix, position and presence into `out`."""
    cr, sr = np.cos(states.roll), np.sin(states.roll)
    cp, sp = np.cos(states.pitch), np.sin(states.pitch)
    cy, sy = np.cos(states.yaw), np.sin(states.yaw)
    r: Floats = out.rotation
    r[:, 0, 0], r[:, 0, 1], r[:, 0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    r[:, 1, 0], r[:, 1, 1], r[:, 1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    r[:, 2, 0], r[:, 2, 1], r[:, 2, 2] = -sp, cp * sr, cp * cr
    out.position[:, 0], out.position[:, 1], out.position[:, 2] = states.x, states.y, states.z
    out.present[:] = states.present
