"""All indicators of C-040 to C-079 for any number of channels, cycle by cycle."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.evidence.channels.frames import Usable
from skidpad.evidence.channels.indicators.catalogue import Scope
from skidpad.evidence.channels.indicators.channel import ChannelIndicators, Values
from skidpad.evidence.channels.indicators.layout import IndicatorReadings, Layout
from skidpad.evidence.channels.indicators.pair import PairIndicators
from skidpad.evidence.channels.indicators.settings import IndicatorSettings

Lap = Callable[[str], None]


def no_lap(_: str) -> None:
    """Does nothing; stands for `lap` where nothing is timed."""


class IndicatorPanel:
    """Indicators of channels and of pairs of channels in one row of values."""

    def __init__(self, channels: Sequence[str], settings: IndicatorSettings) -> None:
        self.layout = Layout.of(channels)
        self.settings = settings
        self.reset()

    def reset(self) -> None:
        """Forgets all cycles before, for a new drive."""
        self.channels = [ChannelIndicators(self.settings) for _ in self.layout.channels]
        self.pairs = [
            PairIndicators(self.channels[a], self.channels[b], self.settings)
            for a, b in self.layout.pairs
        ]
        of = {Scope.CHANNEL: len(self.channels), Scope.PAIR: len(self.pairs)}
        self.added = [
            (kind, [kind.make() for _ in range(of[kind.scope])]) for kind in self.layout.added
        ]

    def update(self, messages: Sequence[Usable | None], lap: Lap = no_lap) -> IndicatorReadings:
        """Returns the values of one cycle; `lap(name)` is called when the part `name` is done.

        messages: one per channel, None: it said nothing. Those of risk (safety score, share of the
        risk behind) are left nan.
        """
        values = np.full(len(self.layout.places), np.nan)
        for channel, message in zip(self.channels, messages, strict=True):
            channel.begin(message)
        speaking = [(i, c, c.frame) for i, c in enumerate(self.channels) if c.frame is not None]
        lap("prepare")
        for i, channel, frame in speaking:
            self._store_values(values, i, channel.comfort(frame))
        lap("comfort")
        meeting = []
        for p, pair in enumerate(self.pairs):
            if pair.a.frame is None or pair.b.frame is None:
                pair.silent()
                continue
            similar = pair.similarity(pair.a.frame, pair.b.frame)
            self._store_values(values, p, similar)
            meeting.append((p, pair, similar))
        lap("similarity")
        for i, channel, frame in speaking:
            self._store_values(values, i, channel.prediction(frame))
        for p, pair, similar in meeting:
            self._store_values(values, p, pair.prediction(similar))
        self._add_foreign(values)
        lap("motion_prediction")
        return IndicatorReadings(self.layout, values, tuple(pair.matched for pair in self.pairs))

    def _add_foreign(self, row: Floats) -> None:
        """Writes the values of the indicators that packages added into the row; nan stays without a frame."""
        for kind, functions in self.added:
            first = self.layout.span[kind.key].start
            for subject, function in enumerate(functions):
                of = (subject,) if kind.scope is Scope.CHANNEL else self.layout.pairs[subject]
                frames = [self.channels[i].frame for i in of]
                if all(frame is not None for frame in frames):
                    row[first + subject] = function(*frames)

    def _store_values(self, row: Floats, subject: int, values: Values) -> None:
        """Writes the values of the subject of this number into a row of all indicators."""
        for indicator, value in values.items():
            row[self.layout.span[indicator].start + subject] = value
