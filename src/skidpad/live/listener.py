"""What listens to channels while they drive; it changes nothing and cannot end the drive."""

from __future__ import annotations

from typing import Protocol

from skidpad.recording.channels.mcap_files import Item


class Listener(Protocol):
    """Takes every item of a drive in the order of the recording, and the end of each cycle."""

    def hear(self, channel: int | None, item: Item) -> None:
        """Takes in one item; `channel`: index of the channel that said it, None for none."""
        ...

    def cycle_over(self, k: int, t: float) -> None:
        """Takes in that everything of cycle k at t s has been said."""
        ...

    def close(self) -> None:
        """Ends the listener after the drive; what runs beside it has ended on return."""
        ...
