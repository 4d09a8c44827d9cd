"""The driver whose pedals and steer are given from outside, tick by tick."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from skidpad.core.frames import SensorFrame
from skidpad.core.geometry import kmh_from_mps
from skidpad.core.setup import DT
from skidpad.core.specs import SensorSpec
from skidpad.core.states import VehicleCommand
from skidpad.roads.queries import RoadMap
from skidpad.stack.control.steering import Smoothing, lookahead_distance, steer_towards
from skidpad.stack.perception.lane_view import HighwayRoute, LaneTracker

WHERE = f"{__name__}:ActionStack"  # as `--stack` takes it


class ActionStack:
    """Turns actions into commands; where an action has no steer, lane centring steers.

    settings: `actions`, one per tick, drives a list of actions again; after its end the last one stays.
    """

    def __init__(
        self, specs: Sequence[SensorSpec], map: RoadMap, settings: Mapping[str, Any]
    ) -> None:
        del specs
        self.recorded: Sequence[Sequence[float]] = settings.get("actions", ())
        self.action: Sequence[float] = (0.0,)
        self.tracker = LaneTracker(map, HighwayRoute())
        self.smoothing = Smoothing(DT)

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Returns the command of the tick's recorded action, else of the last one set.

        An action is the pedal in -1..1 (below 0: brake) and the steer in -1..1; where it has no steer,
        lane centring steers by the frame.
        """
        if frame.tick < len(self.recorded):
            self.action = self.recorded[frame.tick]
        pedal = self.action[0]
        steer = self.action[1] if len(self.action) > 1 else self._centre(frame)
        return VehicleCommand(throttle=max(pedal, 0.0), brake=max(-pedal, 0.0), steer=steer)

    def _centre(self, frame: SensorFrame) -> float:
        """Returns the steer of lane centring in -1..1."""
        pose, v_kmh = frame.ego.pose, kmh_from_mps(frame.ego.speed)
        view = self.tracker.update(pose)
        place = self.tracker.ahead(view, lookahead_distance(v_kmh), pose.yaw)
        return self.smoothing.update(steer_towards(pose, v_kmh, place))
