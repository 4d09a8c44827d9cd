"""The world as sensors see it: the map's triangles, actors as meshes, the weather's light.

Built when a sensor first needs it, and again when actors come or go or the weather changes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import Pose
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.weather import Weather
from skidpad.sensors.crowd import make_actors, place_actors
from skidpad.sensors.lighting import lighting
from skidpad.sensors.live_scene import scene_of
from skidpad.sensors.projection import make_scratch
from skidpad.sensors.shading import Shading
from skidpad.simulation.carla_server.actors import Actor
from skidpad.simulation.carla_server.catalogue import Family

if TYPE_CHECKING:
    from skidpad.simulation.carla_server.world import World

WIDEST = 8192  # px
SEEN = (Family.VEHICLE, Family.WALKER, Family.PROP)
PAINT = (160, 160, 160)
SKIN = 0.1  # m around a body within which a camera counts as inside


class Scene:
    """What rays and cameras meet, in the state of one frame."""

    def __init__(self, world: World) -> None:
        self.members = visible(world)
        self.rows = {a.id: i for i, a in enumerate(self.members)}
        self.ids = np.array([0, *(a.id for a in self.members)], dtype=np.int64)
        table = _table(self.members)
        self.static = scene_of(world.map.roads)
        self.keys = self.static.chunks.key.copy()
        self.actors = make_actors(table) if self.members else make_actors(_nobody())
        self.motion: NDArray[np.float64] = np.zeros((max(len(self.members), 1), 4))
        largest = max(
            int(self.static.chunks.clusters.vertex_count.max()), int(self.actors.vertex_count.max())
        )
        self.scratch = make_scratch(largest, WIDEST)
        self._table = table if self.members else _nobody()
        self.weather: Weather | None = None
        self.frame = -1

    def update(self, world: World) -> None:
        """Bring everything to the world's frame, once per frame."""
        if self.frame == world.episode.frame:
            return
        self.frame = world.episode.frame
        if self.members:
            place_actors(self._states(world), self.actors)
        lights = {light.signal: light.state for light in world.lights.lights}
        self.keys[self.static.lamps.triangle] = self.static.lamp_keys(lights)
        if self.weather is not world.sky.weather:
            self.weather = world.sky.weather
            self.shading = Shading(self.static.palette, self._table, lighting(self.weather))
        if self.members:
            self.shading.set_braking(np.array([_brakes(world, a) for a in self.members]))

    def _states(self, world: World) -> ActorStates:
        """Poses and motion of all members."""
        states = ActorStates.empty(len(self.members))
        fleet = world.vehicles.fleet.states
        for i, actor in enumerate(self.members):
            states.present[i] = True
            slot = world.vehicles.slots.get(actor.id)
            if slot is not None:
                for column, source in zip(states, fleet, strict=True):
                    column[i] = source[slot]
                states.present[i] = True
                climb = np.sin(world.ground.grade[slot]) if len(world.ground.grade) > slot else 0.0
                v = np.hypot(states.vx[i], states.vy[i])
                self.motion[i] = (states.vx[i], states.vy[i], v * climb, states.yaw_rate[i])
                continue
            pose = actor.pose
            foot = actor.half[2] if actor.family is Family.WALKER else 0.0
            states.x[i], states.y[i], states.z[i] = pose.x, pose.y, pose.z - foot
            states.yaw[i], states.pitch[i], states.roll[i] = pose.yaw, pose.pitch, pose.roll
            self.motion[i] = (*actor.velocity, actor.turn[2])
        return states

    def hidden_for(self, world: World, sensor: Actor) -> int:
        """Row of the carrier when the sensor sits inside its body, else -1."""
        carrier = world.actors.alive.get(sensor.parent)
        if carrier is None or carrier.id not in self.rows:
            return -1
        mount, half, centre = sensor.mount, carrier.half, carrier.centre
        inside = (
            abs(mount.x - centre[0]) < half[0] + SKIN
            and abs(mount.y - centre[1]) < half[1] + SKIN
            and abs(mount.z - centre[2]) < half[2] + SKIN
        )
        return self.rows[carrier.id] if inside else -1

    def headlights(self, world: World, sensor: Actor) -> Pose:
        """The pose that carries the headlights of a picture."""
        carrier = world.actors.alive.get(sensor.parent)
        return world.pose(sensor) if carrier is None else world.pose(carrier)


def visible(world: World) -> list[Actor]:
    """Actors with a body."""
    return [a for a in world.actors if a.family in SEEN]


def _brakes(world: World, actor: Actor) -> bool:
    slot = world.vehicles.slots.get(actor.id)
    return slot is not None and world.vehicles.members[slot].control.brake > 0.0


def _table(members: list[Actor]) -> ActorTable:
    return ActorTable(
        names=tuple(str(a.id) for a in members),
        types=tuple(a.blueprint.id for a in members),
        kind=np.array([a.blueprint.kind for a in members], dtype=np.uint8),
        length=np.array([2.0 * a.half[0] for a in members]),
        width=np.array([2.0 * a.half[1] for a in members]),
        height=np.array([2.0 * a.half[2] for a in members]),
        rgb=np.array([_paint(a) for a in members], dtype=np.uint8).reshape(-1, 3),
    )


def _paint(actor: Actor) -> tuple[int, int, int]:
    text = actor.attributes.get("color")
    if text is None:
        return PAINT
    red, green, blue = (int(v) for v in text.split(","))
    return red, green, blue


def _nobody() -> ActorTable:
    """One actor that is never present, for an empty world."""
    one = np.ones(1)
    return ActorTable(
        ("",), ("",), np.zeros(1, dtype=np.uint8), 4.0 * one, 2.0 * one, 1.5 * one,
        np.zeros((1, 3), dtype=np.uint8),
    )  # fmt: skip
