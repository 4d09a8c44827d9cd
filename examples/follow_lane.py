"""Your own stack: drive it with `skidpad adas --stack examples/follow_lane.py:FollowLane`."""

from math import atan2

import numpy as np

from skidpad.core.geometry import wrap_angle
from skidpad.core.states import VehicleCommand


class FollowLane:
    """Steers towards the lane ahead and keeps two seconds to what the radar sees."""

    def __init__(self, specs, map, settings):
        self.map, self.v_cruise = map, settings.get("cruise_kmh", 80.0) / 3.6

    def tick(self, frame):
        """The command for the next 0.05 s."""
        pose, v, radar = frame.ego.pose, frame.ego.speed, frame.radar
        here = self.map.project(pose.x, pose.y, pose.z)
        aim = self.map.ahead(here, 10.0 + v) if here else None
        if aim is None:
            return VehicleCommand(brake=1.0)
        steer = wrap_angle(atan2(aim.y - pose.y, aim.x - pose.x) - pose.yaw)
        in_path = (np.abs(radar.range * radar.azimuth) < 1.5) & (radar.altitude > -0.01)
        gap = min(radar.range[in_path], default=200.0)
        pedal = min(max(min(self.v_cruise, gap / 2.0) - v, -1.0), 1.0)
        return VehicleCommand(max(pedal, 0.0), max(-pedal, 0.0), min(max(steer, -1.0), 1.0))
