"""The world snapshot: a header, 36 bytes about the episode, and 119 bytes for each actor.

Rows are a numpy record array with the client's packed layout, so a tick fills columns and copies
the buffer; nothing is packed actor by actor.
"""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.vocabulary import LightState
from skidpad.simulation.carla_server.clock import Clock


class SensorType(IntEnum):
    """Index in the client's compiled registry; this table is 0.9.16's and no other's."""

    COLLISION = 0
    DEPTH = 1
    NORMALS = 2
    DVS = 3
    GNSS = 4
    IMU = 5
    LANE_INVASION = 6
    OBSTACLE = 7
    OPTICAL_FLOW = 8
    RADAR = 9
    SEMANTIC_LIDAR = 10
    LIDAR = 11
    RSS = 12
    RGB = 13
    SEMANTIC = 14
    INSTANCE = 15
    COSMOS = 16
    WORLD = 17
    GBUFFER = 18  # of bytes; 19 are those of floats, which no server sends
    AWARENESS = 20
    CUSTOM_V2X = 21


HEADER = struct.Struct("<QQd6f")  # type, frame, timestamp, x, y, z, pitch, yaw, roll
EPISODE = struct.Struct("<Qdf3iI")  # id, platform time, delta, map origin, state bits
MAP_CHANGED = 1
LIGHTS_CHANGED = 2
ACTIVE = 1

_KINEMATICS = [
    ("id", "<u4", 0),
    ("state", "u1", 4),
    ("pose", "<f4", 5, (6,)),
    ("velocity", "<f4", 29, (3,)),
    ("turn", "<f4", 41, (3,)),
    ("acceleration", "<f4", 53, (3,)),
]
_VEHICLE = [
    ("control", "<f4", 65, (3,)),  # throttle, steer, brake
    ("switches", "u1", 77, (3,)),  # hand brake, reverse, manual gears
    ("gear", "<i4", 80),
    ("speed_limit", "<f4", 84),
    ("light_state", "u1", 88),
    ("has_light", "u1", 89),
    ("light_id", "<u4", 90),
    ("failure", "u1", 94),
]
_LIGHT = [
    ("sign", "S32", 65),
    ("times", "<f4", 97, (4,)),  # green, yellow, red, elapsed
    ("pole", "<u4", 113),
    ("frozen", "u1", 117),
    ("shown", "u1", 118),
]
_WALKER = [("direction", "<f4", 65, (3,)), ("speed", "<f4", 77), ("jump", "u1", 81)]
ROW_BYTES = 119


def _layout(fields: list[Any]) -> np.dtype[Any]:
    """Returns the structured dtype of a row from (name, format, byte offset[, shape])."""
    layout: np.dtype[Any] = np.dtype(
        {
            "names": [f[0] for f in fields],
            "formats": [(f[1], f[3]) if len(f) > 3 else f[1] for f in fields],
            "offsets": [f[2] for f in fields],
            "itemsize": ROW_BYTES,
        }
    )
    return layout


BYTES = np.dtype((np.void, ROW_BYTES))
VEHICLE_ROW = _layout([*_KINEMATICS, *_VEHICLE])
LIGHT_ROW = _layout([*_KINEMATICS, *_LIGHT])
WALKER_ROW = _layout([*_KINEMATICS, *_WALKER])
NO_LIGHT_STATE = int(LightState.GREEN)
MIN_ROWS = 256


class Rows:
    """The rows of all actors, compact, in order of spawning; three views of one buffer."""

    def __init__(self) -> None:
        self.count = 0
        self._ids: list[int] = []
        self._buffer = np.zeros(MIN_ROWS, dtype=BYTES)
        self._views()

    def _views(self) -> None:
        """Makes the views of the buffer as rows of vehicles, lights and walkers."""
        self.vehicles: NDArray[Any] = self._buffer.view(VEHICLE_ROW)
        self.lights: NDArray[Any] = self._buffer.view(LIGHT_ROW)
        self.walkers: NDArray[Any] = self._buffer.view(WALKER_ROW)

    def add(self, actor: int) -> int:
        """Adds a new row at the end and returns its index, which holds until another row is removed."""
        if self.count == len(self._buffer):
            grown = np.zeros(2 * self.count, dtype=BYTES)
            grown[: self.count] = self._buffer
            self._buffer = grown
            self._views()
        row = self.count
        self._buffer.view(np.uint8).reshape(-1, ROW_BYTES)[row] = 0
        self.vehicles["id"][row] = actor
        self.vehicles["state"][row] = ACTIVE
        self._ids.append(actor)
        self.count += 1
        return row

    def remove(self, row: int) -> None:
        """Removes a row; later rows move up by one."""
        raw = self._buffer.view(np.uint8).reshape(-1, ROW_BYTES)
        raw[row : self.count - 1] = raw[row + 1 : self.count].copy()
        del self._ids[row]
        self.count -= 1

    def order(self) -> dict[int, int]:
        """Returns the row of each actor by its id."""
        return {actor: row for row, actor in enumerate(self._ids)}

    def tobytes(self) -> bytes:
        """Returns the bytes of all rows as they travel."""
        return self._buffer[: self.count].tobytes()


def header(kind: SensorType, frame: int, time: float, pose: tuple[float, ...] | None) -> bytes:
    """Returns the 48 bytes before every payload; pose: x, y, z, pitch, yaw, roll in CARLA's axes.

    time: s; zeros without a pose.
    """
    return HEADER.pack(kind, frame, time, *(pose or (0.0,) * 6))


def message(clock: Clock, rows: Rows, platform_time: float, bits: int) -> bytes:
    """Returns one snapshot, ready to send; platform_time: s of the wall; bits: MAP_CHANGED and alike."""
    return b"".join(
        (
            header(SensorType.WORLD, clock.frame, clock.elapsed, None),
            EPISODE.pack(clock.episode, platform_time, clock.step, 0, 0, 0, bits),
            rows.tobytes(),
        )
    )
