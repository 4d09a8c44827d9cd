"""Which channel drives (C-093, C-096, decision C-9): scores, preference, dwell, failover."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from skidpad.core.channels import ChannelFrame

# decision C-9
SAFE, UNSAFE = 0.8, 0.2  # scores; below UNSAFE for all: minimal-risk stop
DWELL = 1.0  # s between two changes
SETTLE = 0.5  # s for which another channel must be wanted, unless it is urgent
MARGIN = 0.1  # of the score by which another channel must be safer, none being safe
DEAD_AFTER = 0.3  # s without a message


class Reason(str, Enum):
    """Why this channel drives now; recorded."""

    START = "start"
    KEPT = "kept"
    PREFERRED = "preferred channel is safe again"
    SAFER = "higher safety score"
    PROGRESS = "most progressing of the safe channels"
    FAILOVER = "the driving channel is silent"
    LIGHTS = "the driving channel does not see the light or line ahead"
    MINIMAL_RISK = "no channel is safe: minimal-risk stop"
    ALL_SILENT = "all channels are silent: minimal-risk stop"
    ORDERED = "a teleoperator ordered a minimal-risk stop"


@dataclass(frozen=True, slots=True)
class Choice:
    """The channel that drives, None for a minimal-risk stop, and why."""

    driving: int | None
    reason: Reason


class Arbiter:
    """Call `update` each cycle; it never looks at indicators.

    preferred: a channel; None: the one that makes most progress.
    """

    def __init__(self, channels: Sequence[str], preferred: str | None) -> None:
        self.channels, self.preferred = tuple(channels), preferred
        self.reset()

    def reset(self) -> None:
        """Resets the choice: no channel drives and none was heard."""
        self.driving: int | None = None
        self.changed_at = -np.inf
        self.wanted_since: tuple[int | None, float] = (None, -np.inf)
        self.heard_at = [-np.inf] * len(self.channels)
        self.started = False

    def update(
        self,
        t: float,
        frames: Sequence[ChannelFrame | None],
        scores: Sequence[float],
        progress: Sequence[float],
        abstaining: Collection[int] = (),
    ) -> Choice:
        """Takes in one cycle and returns the channel that drives from now on, and why.

        t: s; frames: this cycle's messages, None: nothing came; scores: 0 to 1, NaN: not evaluated;
        progress: m/s at the end of each plan; abstaining: channels that say they cannot judge what
        lies ahead, chosen only where all that are alive say so.
        """
        for i, frame in enumerate(frames):
            if frame is not None:
                self.heard_at[i] = t
        alive = [i for i, heard in enumerate(self.heard_at) if t - heard < DEAD_AFTER - 1e-9]
        able = [i for i in alive if i not in abstaining] or alive
        wanted = self._choose_channel(able, scores, progress)
        if wanted.driving != self.wanted_since[0]:
            self.wanted_since = (wanted.driving, t)
        if wanted.driving == self.driving and self.started:
            return Choice(self.driving, wanted.reason if self.driving is None else Reason.KEPT)
        lost = self.driving is not None and self.driving not in able
        if (
            self.started
            and not (wanted.driving is None or lost)
            and not self._may_switch(t, scores)
        ):
            return Choice(self.driving, Reason.KEPT)
        reason = Reason.START if not self.started else wanted.reason
        if lost and wanted.driving is not None:
            reason = Reason.LIGHTS if self.driving in alive else Reason.FAILOVER
        self.driving, self.changed_at, self.started = wanted.driving, t, True
        return Choice(self.driving, reason)

    def _may_switch(self, t: float, scores: Sequence[float]) -> bool:
        """Returns whether another channel may take over at t: hysteresis in time.

        Not within DWELL s of a change; then at once from none or an unsafe channel, else after SETTLE s.
        """
        if t - self.changed_at < DWELL - 1e-9:
            return False
        if self.driving is None or scores[self.driving] < UNSAFE:
            return True
        return t - self.wanted_since[1] >= SETTLE - 1e-9

    def _choose_channel(
        self, able: Sequence[int], scores: Sequence[float], progress: Sequence[float]
    ) -> Choice:
        """Returns the channel that the scores ask for and why; None for a minimal-risk stop.

        able: channels that may be chosen. Without a score the driving one stays.
        """
        if not able:
            return Choice(None, Reason.ALL_SILENT)
        known = {i: float(scores[i]) for i in able if scores[i] == scores[i]}
        if not known:
            return Choice(self.driving if self.driving in able else able[0], Reason.KEPT)
        safe = [i for i, score in known.items() if score >= SAFE]
        if safe:
            return self._among_safe(safe, progress)
        best = max(known, key=lambda i: (known[i], i == self.driving, -i))
        if known[best] < UNSAFE:
            return Choice(None, Reason.MINIMAL_RISK)
        mine = known.get(self.driving, -np.inf) if self.driving is not None else -np.inf
        if mine >= known[best] - MARGIN and mine >= UNSAFE:
            return Choice(self.driving, Reason.KEPT)
        return Choice(best, Reason.SAFER)

    def _among_safe(self, safe: Sequence[int], progress: Sequence[float]) -> Choice:
        """Returns the preferred channel if it is safe, else the safe one with most progress."""
        if self.preferred is not None and self.channels.index(self.preferred) in safe:
            return Choice(self.channels.index(self.preferred), Reason.PREFERRED)
        best = max(safe, key=lambda i: (progress[i], i == self.driving, -i))
        return Choice(best, Reason.PROGRESS)
