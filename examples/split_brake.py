"""A full stop with ice under the right wheels, by a driver who steers.

skidpad play lead_slowdown --stack examples/split_brake.py:SplitBrake --surface examples/split_mu.yaml \
    --set anti_lock=wheel_speeds --sensors objects --duration 20 --out out/split
"""

from math import atan2

from skidpad.core.geometry import wrap_angle
from skidpad.core.states import VehicleCommand

BEGIN = 40  # ticks of 0.05 s


class SplitBrake:
    """Follows its lane, and brakes with all there is after two seconds."""

    def __init__(self, specs, map, settings):
        self.map = map

    def tick(self, frame):
        """The command for the next 0.05 s."""
        pose, v = frame.ego.pose, frame.ego.speed
        here = self.map.project(pose.x, pose.y, pose.z)
        aim = self.map.ahead(here, 8.0 + v) if here else None
        steer = 0.0
        if aim is not None:
            steer = 0.6 * wrap_angle(atan2(aim.y - pose.y, aim.x - pose.x) - pose.yaw)
        if frame.tick < BEGIN:
            return VehicleCommand(throttle=0.3, steer=steer)
        return VehicleCommand(brake=1.0, steer=steer)
