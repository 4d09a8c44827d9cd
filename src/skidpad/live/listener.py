"""What listens to channels while they drive; it changes nothing and cannot end the drive."""

from __future__ import annotations

from typing import Protocol

from skidpad.recording.channels.mcap_files import Item


class Listener(Protocol):
    """Told every item in the order of the recording, and when a cycle has been said in full."""

    def hear(self, channel: int | None, item: Item) -> None:
        """Takes in one item; `channel` is the index of the channel that said it."""
        ...

    def cycle_over(self, k: int, t: float) -> None:
        """Takes in that everything of cycle k at t s has been said."""
        ...

    def close(self) -> None:
        """The drive is over; whatever runs beside it has ended on return."""
        ...
