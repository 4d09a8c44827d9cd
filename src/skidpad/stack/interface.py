"""What any stack under test looks like (decision L-3). Yours too: `--stack module:Class`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from skidpad.core.frames import SensorFrame
from skidpad.core.specs import SensorSpec
from skidpad.core.states import VehicleCommand

if TYPE_CHECKING:
    from skidpad.roads.queries import RoadMap


class Stack(Protocol):
    """Constructed as `Class(specs, map, settings)`, then called once per tick.

    Optional: `sensors()` names more sensors (cameras, lidars, GNSS, IMU, speedometer), whose
    readings arrive in `frame.extra` by id; `report` says what it thought, for the recording;
    `mode` is a text on its present mode, for `skidpad rerun`.
    """

    def __init__(
        self, specs: Sequence[SensorSpec], map: RoadMap, settings: Mapping[str, Any]
    ) -> None: ...

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Returns the command for the coming step."""
        ...
