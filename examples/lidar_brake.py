"""A stack with a lidar of its own: `skidpad adas --stack examples/lidar_brake.py:LidarBrake`."""

from math import atan2

from skidpad.core.geometry import Pose, wrap_angle
from skidpad.core.specs import LidarSpec, PointSensorSpec
from skidpad.core.states import VehicleCommand


class LidarBrake:
    """Follows its lane at 50 km/h and brakes when the lidar meets something in its way."""

    def __init__(self, specs, map, settings):
        self.map = map

    def sensors(self):
        """What comes besides the common sensors; readings arrive in `frame.extra` by id."""
        lidar = LidarSpec("lidar", Pose(0.0, 0.0, 1.7), range=50.0, points_per_second=200_000)
        return (lidar, PointSensorSpec("speed", "speedometer"))

    def tick(self, frame):
        """The command for the next 0.05 s; x forward, y left, z up, from the sensor."""
        pose, v = frame.ego.pose, frame.extra["speed"]
        here = self.map.project(pose.x, pose.y, pose.z)
        aim = self.map.ahead(here, 10.0 + v) if here else None
        x, y, z = frame.extra["lidar"].xyz.T
        ahead = sorted(x[(x > 2.0) & (abs(y) < 1.0) & (z > -1.2)])
        gap = (ahead[2] if len(ahead) > 2 else 50.0) - 2.0  # one or two returns may be drops
        if aim is None or gap < 2.0 + v * v / 8.0:
            return VehicleCommand(brake=1.0)
        steer = wrap_angle(atan2(aim.y - pose.y, aim.x - pose.x) - pose.yaw)
        return VehicleCommand(throttle=0.5 if v < 13.9 else 0.0, steer=min(max(steer, -1.0), 1.0))
