"""Channels on one clock: a grid of 0.1 s with the newest message of each channel (C-022, C-10)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import floor, inf

from skidpad.core.channels import ChannelFrame, Cycle, Decision, Due, TruthFrame
from skidpad.recording.channels.mcap_files import ChannelSource, Message

STEP = 0.1  # s, the cycle of the published stacks (C-022)
MAX_AGE = 0.15  # s, older messages count as absent (decision C-10)
MAX_GAP = 10.0  # s, a message further ahead must be confirmed by the next of its channel
STRETCH = round(MAX_GAP / STEP)  # cycles
TIME_MAX = 1.8e10  # s, as far as recordings reach
SAME_TIME = 1e-6  # s, rounding of stamps


@dataclass(slots=True)
class _Newest:
    """The newest message of one sender, and one that claims a time far ahead."""

    message: Message | None = None
    doubtful: Message | None = None


class _Clock:
    """Decides per sender which messages move time forward."""

    def __init__(self, source: ChannelSource) -> None:
        self.losses = source.losses
        self.newest: dict[object, _Newest] = {}
        self.t: float | None = None  # newest accepted time over all senders

    def accept(self, message: Message) -> bool:
        """Takes in a message and moves time on; returns False, with a loss counted, where it does not count.

        It does not when its time is malformed, older than its sender's newest, or more than MAX_GAP ahead
        of all; the next of its sender within MAX_GAP confirms such a jump.
        """
        if not abs(message.t) < TIME_MAX:  # also NaN
            self.losses.malformed += 1
            return False
        sender = message.channel if message.channel is not None else type(message.item)
        state = self.newest.setdefault(sender, _Newest())
        if state.message is not None and message.t <= state.message.t - SAME_TIME:
            self.losses.out_of_order += 1
            return False
        if (
            self.t is not None
            and message.t > self.t + MAX_GAP
            and not self._is_confirmed(state, message)
        ):
            state.doubtful = message
            self.losses.jumps += 1
            return False
        state.message = message
        state.doubtful = None
        self.t = message.t if self.t is None else max(self.t, message.t)
        return True

    @staticmethod
    def _is_confirmed(state: _Newest, message: Message) -> bool:
        """Returns True when the message comes at most MAX_GAP s after the doubtful one."""
        return state.doubtful is not None and 0.0 <= message.t - state.doubtful.t <= MAX_GAP


def cycles(source: ChannelSource) -> Iterator[Cycle]:
    """Yields the cycles of a recording: grid times from its first message to its last.

    A stretch of more than MAX_GAP without any message is left out; k keeps counting the grid. A live
    source says with `Due` that a cycle is complete, which then need not wait for the next message.
    """
    clock = _Clock(source)
    state = _State(source)
    t_first: float | None = None
    k = 0
    for message in source.messages():
        state.losses = clock.losses = source.losses
        heard = -inf if clock.t is None else clock.t
        live = isinstance(message.item, Due)
        if t_first is None if live else not clock.accept(message):
            continue
        if t_first is None:
            t_first = message.t
        # a message moves the grid to just before it: everything older is now known
        due = floor((message.t - t_first - SAME_TIME) / STEP)  # the last grid time before it
        if live or k < due - STRETCH:  # what was said before a stretch is not left out with it
            while t_first + k * STEP <= heard + SAME_TIME:
                yield state.cycle(k, t_first + k * STEP)
                k += 1
        if live:
            continue
        k = max(k, due - STRETCH)
        while k <= due:
            yield state.cycle(k, t_first + k * STEP)
            k += 1
        state.take(message)
    if t_first is not None and clock.t is not None:
        while t_first + k * STEP <= clock.t + SAME_TIME:
            yield state.cycle(k, t_first + k * STEP)
            k += 1


class _State:
    """The newest frame per channel, the driving channel and the truth."""

    def __init__(self, source: ChannelSource) -> None:
        self.channels = source.channels
        self.losses = source.losses
        self.frames: list[ChannelFrame | None] = [None] * len(source.channels)
        self.driving: int | None = None
        self.truth: TruthFrame | None = None

    def take(self, message: Message) -> None:
        """Keeps the message as the newest frame, truth or decision."""
        item = message.item
        if isinstance(item, ChannelFrame) and message.channel is not None:
            self.frames[message.channel] = item
        elif isinstance(item, TruthFrame):
            self.truth = item
        elif isinstance(item, Decision) and item.driving in self.channels:
            self.driving = self.channels.index(item.driving)

    def cycle(self, k: int, t: float) -> Cycle:
        """Returns cycle `k` at `t` s; frames and truth older than MAX_AGE are None, and counted as stale."""
        fresh = []
        for name, frame in zip(self.channels, self.frames, strict=True):
            if frame is not None and t - frame.t > MAX_AGE + SAME_TIME:
                frame = None
            if frame is None:
                self.losses.stale[name] = self.losses.stale.get(name, 0) + 1
            fresh.append(frame)
        truth = self.truth
        if truth is not None and t - truth.t > MAX_AGE + SAME_TIME:
            truth = None
        return Cycle(k, t, tuple(fresh), self.driving, truth)
