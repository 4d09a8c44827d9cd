"""Poses and plane geometry. Right-handed ISO 8855: x forward, y left, z up, yaw counter-clockwise."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, pi, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.objects.slots import fill_slots

Array = NDArray[np.float64]


@fill_slots
@dataclass(frozen=True, slots=True)
class Pose:
    """Position in metres and attitude in radians of a frame seen from another.

    roll, pitch, yaw turn about x, y, z in the order yaw, pitch, roll (ISO 8855); so pitch > 0 is
    nose down.
    """

    x: float
    y: float
    z: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0

    def rotation(self) -> Array:
        """Returns (3, 3): columns are this frame's axes seen from the parent."""
        cr, sr = cos(self.roll), sin(self.roll)
        cp, sp = cos(self.pitch), sin(self.pitch)
        cy, sy = cos(self.yaw), sin(self.yaw)
        return np.array(
            [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr],
            ]
        )

    def __matmul__(self, other: Pose) -> Pose:
        """Returns `pose_a_c = pose_a_b @ pose_b_c`."""
        m = self.rotation()
        x, y, z = m @ (other.x, other.y, other.z)
        r = m @ other.rotation()
        return Pose(
            x=self.x + float(x),
            y=self.y + float(y),
            z=self.z + float(z),
            roll=atan2(r[2, 1], r[2, 2]),
            pitch=atan2(-r[2, 0], float(np.hypot(r[0, 0], r[1, 0]))),
            yaw=atan2(r[1, 0], r[0, 0]),
        )

    def moved(self, forward: float = 0.0, left: float = 0.0, up: float = 0.0) -> Pose:
        """Returns the same attitude, shifted in the plane along its own heading, and up, in m."""
        c, s = cos(self.yaw), sin(self.yaw)
        return Pose(  # not `replace`: this is asked some thousand times a second
            self.x + forward * c - left * s,
            self.y + forward * s + left * c,
            self.z + up,
            self.roll,
            self.pitch,
            self.yaw,
        )


def wrap_angle(angle: float) -> float:
    """Returns `angle` in radians, wrapped to (-pi, pi]."""
    wrapped = (angle + pi) % (2.0 * pi) - pi
    return pi if wrapped == -pi else wrapped


def mps_from_kmh(v_kmh: float) -> float:
    """Returns a speed in m/s for one in km/h."""
    return v_kmh / 3.6


def kmh_from_mps(v: float) -> float:
    """Returns a speed in km/h for one in m/s."""
    return v * 3.6


def footprint(x: float, y: float, yaw: float, length: float, width: float) -> Array:
    """Returns (4, 2) corners of a box on the ground: front left, rear left, rear right, front right."""
    c, s = cos(yaw), sin(yaw)
    half = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * (length / 2.0, width / 2.0)
    corners: Array = half @ np.array([[c, s], [-s, c]]) + (x, y)
    return corners
