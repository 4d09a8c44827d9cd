"""The driver whose pedals and steer are given from outside, tick by tick."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from skidpad.core.frames import SensorFrame
from skidpad.core.run import Function
from skidpad.core.settings.stack import StackSettings
from skidpad.core.setup import DT
from skidpad.core.specs import SensorSpec
from skidpad.core.states import VehicleCommand
from skidpad.roads.queries import RoadMap
from skidpad.stack.memory import new_memory
from skidpad.stack.road import Road, road_rules

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
        rules = road_rules(frozenset({Function.LCA}), StackSettings(steer_smoothing=True), DT)
        self.road = Road(map, new_memory(), rules)

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Returns the command of the tick's recorded action, else of the last one set.

        An action is the pedal in -1..1 (below 0: brake) and the steer in -1..1; where it has no steer,
        lane centring steers by the frame.
        """
        if frame.tick < len(self.recorded):
            self.action = self.recorded[frame.tick]
        pedal = self.action[0]
        ego = frame.ego
        steer = (
            self.action[1] if len(self.action) > 1 else self.road.read(ego.pose, ego.speed, True)[4]
        )
        return VehicleCommand(throttle=max(pedal, 0.0), brake=max(-pedal, 0.0), steer=steer)
