"""A cue for ghosts: objects that one channel alone reports, and only for a moment (C-130)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from skidpad.core.channels import ChannelFrame

MOMENT = 0.5  # s


class GhostCue:
    """Counts brief objects per channel; only channels that give identities can be followed."""

    def __init__(self, channels: Sequence[str]) -> None:
        self.channels = tuple(channels)
        self.brief: Counter[str] = Counter()
        self._since: list[dict[int, float]] = [{} for _ in channels]  # id -> first seen, s
        self._shared: list[set[int]] = [set() for _ in channels]  # ids that another channel knew

    def update(self, frames: Sequence[ChannelFrame | None], shared: Sequence[set[int]]) -> None:
        """One cycle; `shared` holds per channel the rows that were paired with another channel."""
        for c, frame in enumerate(frames):
            if frame is None:  # nobody can say what happened to its objects
                self._since[c].clear()
                self._shared[c].clear()
                continue
            ids = frame.ids.tolist()
            since, known = self._since[c], self._shared[c]
            known.update(ids[row] for row in shared[c])
            present = {i for i in ids if i >= 0}
            for i in since.keys() - present:
                if frame.t - since.pop(i) <= MOMENT + 1e-6 and i not in known:
                    self.brief[self.channels[c]] += 1
                known.discard(i)
            for i in present - since.keys():
                since[i] = frame.t
