"""The ego's sensor readings, from the messages of a tick or from our own object level."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import Any

from skidpad.core.arrays import Floats
from skidpad.core.frames import LidarPoints, RadarPoints
from skidpad.core.setup import Setup
from skidpad.core.specs import LidarSpec, RadarSpec
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import LightState, RangeModel, SensorLevel
from skidpad.physics.optics import radar_range
from skidpad.roads.queries import RoadMap
from skidpad.sensors.requested import AskedSensors
from skidpad.simulation.carla import decode
from skidpad.simulation.carla.actor_rows import ActorRow
from skidpad.simulation.carla.pictures import Pictures
from skidpad.simulation.sensing import CameraRadarReadings, Objects

Messages = Mapping[str, Any]  # what the wheel delivered, by sensor id


class Reader:
    """Turns messages into readings; one per run."""

    def __init__(
        self, map: RoadMap, table: ActorTable, setup: Setup, seed: int, pictures: Pictures
    ) -> None:
        self.pictures = pictures
        self._messages: Messages = {}
        self._objects: Objects | None = None
        if setup.level is SensorLevel.OBJECTS:
            self._objects = Objects(map, table, setup, seed)
        self._asked: AskedSensors | None = None
        if setup.asked:
            self._asked = AskedSensors(map, table, setup, self._lidar, seed)
        radar = next((s for s in setup.specs if isinstance(s, RadarSpec)), None)
        self._radar_id = None if radar is None else radar.id
        self._radar_limit = inf
        if radar is not None and setup.range_model is RangeModel.PHYSICAL:
            self._radar_limit = radar_range(setup.weather, radar.range)

    def know(self, players: Sequence[ActorRow]) -> None:
        """Notes which row the ids of actors in messages stand for."""
        rows = self.pictures.rows
        for i, player in enumerate(players):
            if player.actor is not None:
                rows[player.actor.id % len(rows)] = i + 1

    def read(
        self,
        tick: int,
        messages: Messages,
        states: ActorStates,
        commands: Floats,
        lights: dict[int, LightState],
    ) -> tuple[CameraRadarReadings, Mapping[str, Any]]:
        """Returns the common sensors' readings, and those that the stack asked for besides, by sensor id.

        messages: by sensor id; commands (n, 5); to be called in every tick.
        """
        self._messages, braking = messages, commands[:, 1] > 0.0
        if self._objects is not None:
            seen = self._objects.read(tick, states, lights, braking)
        else:
            radar = RadarPoints.none()
            if self._radar_id is not None:
                raw = messages[self._radar_id].raw_data
                radar = decode.radar_points(raw, self._radar_limit)
            seen = CameraRadarReadings(self.pictures.of(tick, messages), {}, radar)
        asked = self._asked
        if asked is None:
            return seen, {}
        return seen, asked.read(tick, states, seen.images, lights, braking)

    def _lidar(self, spec: LidarSpec) -> LidarPoints:
        """Returns the points of the server's lidar of this tick."""
        assert self._asked is not None
        raw = self._messages[spec.id].raw_data
        return decode.lidar_points(raw, self.pictures.rows, self._asked.air)
