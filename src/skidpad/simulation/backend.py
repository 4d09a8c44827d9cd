"""What every simulator behind Skidpad promises (decision L-4); one contract test holds for all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from skidpad.core.frames import Frame
from skidpad.core.geometry import Pose
from skidpad.core.inputs import Outside
from skidpad.core.setup import ActorCommand, Setup
from skidpad.core.states import VehicleCommand, WorldTruth


class Backend(Protocol):
    """A world that advances one fixed step at a time."""

    def reset(self, setup: Setup, seed: int) -> Frame:
        """Begin a run. The same setup and seed give the same bytes, whatever ran before."""
        ...

    def step(self, command: VehicleCommand, actor_commands: Sequence[ActorCommand] = ()) -> Frame:
        """Apply the commands for one step; the frame is valid until the next call."""
        ...

    def truth(self) -> WorldTruth:
        """Ground truth of the moment; valid until the next step."""
        ...

    def relocate(self, pose: Pose, v: float) -> None:
        """Put the ego at `pose` with speed `v` along it, no rotation."""
        ...

    def change(self, outside: Outside) -> None:
        """Weather, grip and headlights are others from the next step on."""
        ...

    def close(self) -> None:
        """Releases everything; it is safe to call twice."""
        ...
