"""A map's scene with the actors on it, as they are now: what all cameras and rays look at (R-13)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import Bodywork, LightState
from skidpad.roads.lanes import LaneSamples, LaneTable
from skidpad.roads.roadside import Roadside
from skidpad.sensors.raster import rasteriser, rays
from skidpad.sensors.raster.actors import make_actors, place_actors
from skidpad.sensors.raster.passes import Pass
from skidpad.sensors.raster.projection import make_scratch
from skidpad.sensors.raster.rays import Hits, Rays
from skidpad.sensors.raster.shaped_actors import ShapedActors
from skidpad.sensors.raster.view import View
from skidpad.sensors.scene.static import StaticScene, build_scene

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

    UNSAVED = ("static", "key", "actors", "_scratch")  # of the map, or set by `place` and `show`

    def __init__(
        self,
        map: SceneMap,
        table: ActorTable,
        widest: int = 1,
        bodywork: Bodywork = Bodywork.PLAIN,
    ) -> None:
        """widest: columns in px of the widest image."""
        self.static = scene_of(map)
        self.key = self.static.chunks.key.copy()  # of the map's triangles, lamps as they shine
        self._shaped = ShapedActors(table) if bodywork is Bodywork.SHAPED else None
        self.actors = make_actors(table) if self._shaped is None else self._shaped.near
        self.motion = np.zeros((len(table), 4))  # vx, vy, vz in m/s and yaw rate
        self._height = np.full(len(table), np.nan)
        clusters = self.static.chunks.clusters.vertex_count
        largest = max(int(clusters.max()), int(self.actors.vertex_count.max(initial=0)))
        if self._shaped is not None:
            largest = max(largest, int(self._shaped.far.vertex_count.max(initial=0)))
        self._scratch = make_scratch(largest, widest)

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
        rasteriser.raster(
            self.static.chunks,
            self.key,
            actors,
            hidden,
            view,
            level,
            self._scratch,
            out.inverse,
            out.key,
        )

    def cast(self, view: View, hidden: int, reach: float, along: Rays, hits: Hits) -> None:
        """Writes the nearest surface on every ray into `hits`; one beyond `reach` m may or may not be told.

        hidden: row of the actor that no ray meets, or -1.
        """
        rays.cast(
            self.static.chunks,
            self.key,
            self.actors,
            hidden,
            view,
            reach,
            self._scratch,
            along,
            hits,
        )
