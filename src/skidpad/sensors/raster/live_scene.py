"""A map's scene with the actors on it, as they are now: what all cameras and rays look at (R-13)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Protocol

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind, Bodywork, LightState
from skidpad.roads.lanes import LaneSamples, LaneTable
from skidpad.roads.roadside import Roadside
from skidpad.sensors.raster import rasteriser, rays
from skidpad.sensors.raster.passes import Pass
from skidpad.sensors.raster.projection import Scratch, make_scratch
from skidpad.sensors.raster.rasteriser import Actors
from skidpad.sensors.raster.rays import Hits, Rays
from skidpad.sensors.raster.shaped_actors import ShapedActors
from skidpad.sensors.raster.view import View
from skidpad.sensors.scene.bodies import body_mesh
from skidpad.sensors.scene.mesh import Mesh
from skidpad.sensors.scene.static import StaticScene, build_scene, pixel_key

MAX_CLIMB = 8.0  # m/s; a faster change of height is a relocation, not motion
KEPT_SCENES = 4
_SCENES: dict[str, StaticScene] = {}


class SceneMap(Protocol):
    """What the sensors read of a road map."""

    content_hash: str
    samples: LaneSamples
    lanes: LaneTable
    roadside: Roadside


def scene_of(map: SceneMap) -> StaticScene:
    """Returns the triangulated map; the last KEPT_SCENES maps of a process are kept by content hash."""
    scene = _SCENES.pop(map.content_hash, None)
    if scene is None:
        scene = build_scene(map.samples, map.lanes, map.roadside)
        while len(_SCENES) >= KEPT_SCENES:
            _SCENES.pop(next(iter(_SCENES)))
    _SCENES[map.content_hash] = scene
    return scene


class LiveScene:
    """Triangles of the map and of its actors; whoever moves the world tells it what changed."""

    UNSAVED = ("static", "key", "actors", "_free")  # of the map, or set by `place` and `show`

    def __init__(
        self,
        map: SceneMap,
        table: ActorTable,
        widest: int = 1,
        bodywork: Bodywork = Bodywork.PLAIN,
    ) -> None:
        """widest: columns in px of the widest image."""
        self.static = scene_of(map)
        self.ground = float(map.samples.z.min())  # m, of the lowest road: fog lies on it
        self.key = self.static.chunks.key.copy()  # of the map's triangles, lamps as they shine
        self._shaped = ShapedActors(table) if bodywork is Bodywork.SHAPED else None
        self.actors = make_actors(table) if self._shaped is None else self._shaped.near
        self.motion = np.zeros((len(table), 4))  # vx, vy, vz in m/s and yaw rate
        self._height = np.full(len(table), np.nan)
        clusters = self.static.chunks.clusters.vertex_count
        largest = max(int(clusters.max()), int(self.actors.vertex_count.max(initial=0)))
        if self._shaped is not None:
            largest = max(largest, int(self._shaped.far.vertex_count.max(initial=0)))
        self._free: list[Scratch] = []  # that no thread uses at present
        self._largest, self._widest = largest, widest

    def place(self, states: ActorStates, elapsed: float) -> None:
        """Puts the actors where they are, `elapsed` s after the last time; vz from the height.

        vz is 0 at the first call and for a climb faster than MAX_CLIMB.
        """
        place_actors(states, self.actors)
        if self._shaped is not None:
            self._shaped.turn_wheels(states, elapsed)
        climb = (states.z - self._height) / elapsed
        self._height[:] = states.z
        self.motion[:, 0], self.motion[:, 1] = states.vx, states.vy
        self.motion[:, 2] = np.where(np.abs(climb) < MAX_CLIMB, climb, 0.0)
        self.motion[:, 3] = states.yaw_rate

    def show(self, lights: Mapping[int, LightState]) -> None:
        """Writes the keys of the signal lamps as the lights, by signal id, show now; all others are dark."""
        self.key[self.static.lamps.triangle] = self.static.lamp_keys(lights)

    def draw(self, view: View, hidden: int, level: int, out: Pass) -> None:
        """Writes inverse depth and keys of a view's rows into `out`.

        hidden: row of the actor left out, or -1. level: of detail, or AUTO_LEVEL.
        """
        actors = self.actors
        if self._shaped is not None and level == rasteriser.AUTO_LEVEL:
            actors = self._shaped.select_for(view)
        with self._scratch() as scratch:
            rasteriser.raster(
                self.static.chunks,
                self.key,
                actors,
                hidden,
                view,
                level,
                scratch,
                out.inverse,
                out.key,
            )

    def cast(self, view: View, hidden: int, reach: float, along: Rays, hits: Hits) -> None:
        """Writes the nearest surface on every ray into `hits`; one beyond `reach` m may or may not be told.

        hidden: row of the actor that no ray meets, or -1.
        """
        with self._scratch() as scratch:
            rays.cast(
                self.static.chunks,
                self.key,
                self.actors,
                hidden,
                view,
                reach,
                scratch,
                along,
                hits,
            )

    @contextmanager
    def _scratch(self) -> Iterator[Scratch]:
        """Lends working memory, to each thread its own."""
        try:
            scratch = self._free.pop()
        except IndexError:
            scratch = make_scratch(self._largest, self._widest)
        yield scratch
        self._free.append(scratch)


# The moving part of the scene: a mesh per actor, and where each one is now.


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
        meshes.append(body_mesh(ActorKind.PROP, 1.0, 1.0, 1.0))  # of no actor: arrays have a type
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
