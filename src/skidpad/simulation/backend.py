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
        """Begins a run and returns its first frame.

        The same setup and seed give the same bytes, whatever ran before.
        """
        ...

    def step(self, command: VehicleCommand, actor_commands: Sequence[ActorCommand] = ()) -> Frame:
        """Applies the commands for one step and returns the frame, which is valid until the next call."""
        ...

    def truth(self) -> WorldTruth:
        """Returns the ground truth of the moment, which is valid until the next step."""
        ...

    def relocate(self, pose: Pose, v: float) -> None:
        """Puts the ego at `pose` with speed `v` in m/s along it, without rotation."""
        ...

    def change(self, outside: Outside) -> None:
        """Sets weather, grip and headlights as they are from the next step on."""
        ...

    def close(self) -> None:
        """Releases everything; it is safe to call twice."""
        ...
