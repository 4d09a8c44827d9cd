"""Your own stack in 20 lines: steer along the lane, keep two seconds to what the radar sees."""

from math import atan2

from skidpad import VehicleCommand


class FollowLane:
    def __init__(self, specs, map, settings):
        self.map, self.v_cruise = map, settings.get("cruise_kmh", 80.0) / 3.6

    def tick(self, frame):
        ego = frame.ego
        here = self.map.project(ego.pose.x, ego.pose.y, ego.pose.z)
        aim = here and self.map.ahead(here, 10.0 + ego.speed)
        bearing = atan2(aim.y - ego.pose.y, aim.x - ego.pose.x) - ego.pose.yaw if aim else 0.0
        steer = max(-1.0, min(1.0, 0.8 * atan2(*_sin_cos(bearing))))
        ahead = abs(frame.radar.azimuth) * frame.radar.range < 1.5
        gap = min(frame.radar.range[ahead & (frame.radar.altitude > -0.03)], default=1e3)
        error = min(self.v_cruise, gap / 2.0) - ego.speed
        return VehicleCommand(max(0.0, min(1.0, error)), max(0.0, min(1.0, -error / 4.0)), steer)
