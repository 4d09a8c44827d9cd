"""What any stack under test looks like (decision L-3). Yours too: `--stack module:Class`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

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


@runtime_checkable
class VectorStack(Protocol):
    """Drives several runs of `skidpad.drive_many` at once, as a network takes a batch: a call per tick.

    It is made by its user and given as the `stack` of each of these runs; they are known by their numbers
    in the list.
    """

    def begin(
        self, run: int, specs: Sequence[SensorSpec], map: RoadMap, settings: Mapping[str, Any]
    ) -> None:
        """Takes what a stack of one run is built with; a run begins."""
        ...

    def tick(self, frames: Mapping[int, SensorFrame]) -> Mapping[int, VehicleCommand]:
        """Returns a command for each frame, by the number of its run; runs that are over have none."""
        ...
