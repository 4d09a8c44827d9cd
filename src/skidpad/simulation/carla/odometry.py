"""What the ego's localisation and its own sensors say of itself."""

from __future__ import annotations

from dataclasses import replace

from skidpad.core.randomness import stream
from skidpad.core.states import ActorStates, EgoEstimate
from skidpad.simulation.carla import truth

EGO = 0
TRACK = 0.8  # of a car's width, between its wheels


class Odometry:
    """Pose with noise; rims turn as the body moves (CARLA tells no wheel speeds)."""

    def __init__(self, seed: int, sigma: float, width: float) -> None:
        """sigma: m, noise of the position. width: m, of the ego."""
        self._rng = stream(seed, "ego", "localisation")
        self._sigma, self._half_track = sigma, TRACK * width / 2.0

    def read(self, s: ActorStates, gear: int) -> EgoEstimate:
        """Returns the estimate of this tick; call it once per tick, for the noise is drawn anew."""
        pose = s.pose(EGO)
        if self._sigma > 0.0:
            dx, dy = self._rng.normal(0.0, self._sigma, 2).tolist()
            pose = replace(pose, x=pose.x + dx, y=pose.y + dy)
        v, yaw_rate = truth.along(s, EGO), float(s.yaw_rate[EGO])
        left, right = v - yaw_rate * self._half_track, v + yaw_rate * self._half_track
        return EgoEstimate(
            pose=pose,
            speed=v,
            yaw_rate=yaw_rate,
            ax=float(s.ax[EGO]),
            ay=float(s.ay[EGO]),
            wheel_speeds=(left, right, left, right),
            gear=gear,
        )
