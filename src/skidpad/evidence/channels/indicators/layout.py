"""The values of a cycle as one row: indicators of each channel, of each pair, then added ones."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Ints
from skidpad.core.errors import ConfigError
from skidpad.evidence.channels.indicators.catalogue import (
    CHANNEL_INDICATORS,
    INDICATORS,
    PAIR_INDICATORS,
    AnyIndicator,
    IndicatorType,
    Scope,
)


class Place(NamedTuple):
    """Whose value stands at one place of the row."""

    indicator: AnyIndicator
    subject: str  # channel, or pair "a+b"


@dataclass(frozen=True, slots=True)
class Layout:
    """What stands where; `span[indicator]` are the places of all its subjects."""

    channels: tuple[str, ...]
    pairs: tuple[tuple[int, int], ...]  # numbers of channels
    places: tuple[Place, ...]
    span: dict[AnyIndicator, slice]
    added: tuple[IndicatorType, ...] = ()  # of installed packages

    @classmethod
    def of(cls, channels: Sequence[str]) -> Layout:
        """Returns the layout for these channels, their pairs and added indicators; ConfigError for none."""
        if not channels:
            raise ConfigError("indicators need at least one channel, got none")
        pairs = tuple(combinations(range(len(channels)), 2))
        names = ["+".join(pair) for pair in combinations(channels, 2)]
        places: list[Place] = []
        span: dict[AnyIndicator, slice] = {}
        added = INDICATORS.foreign_entries()
        subjects_of = {Scope.CHANNEL: list(channels), Scope.PAIR: names}
        rows: list[tuple[AnyIndicator, Scope]] = [
            *((indicator, Scope.CHANNEL) for indicator in CHANNEL_INDICATORS),
            *((indicator, Scope.PAIR) for indicator in PAIR_INDICATORS),
            *((kind.key, kind.scope) for kind in added),
        ]
        for indicator, scope in rows:
            subjects = subjects_of[scope]
            span[indicator] = slice(len(places), len(places) + len(subjects))
            places += [Place(indicator, subject) for subject in subjects]
        return cls(tuple(channels), pairs, tuple(places), span, added)

    def indices(self, indicators: Iterable[AnyIndicator]) -> Ints:
        """Returns the places in a row of all subjects of `indicators`, in their order."""
        row = np.arange(len(self.places))
        return np.concatenate([row[self.span[i]] for i in indicators])


@dataclass(frozen=True, slots=True)
class IndicatorReadings:
    """The values of one cycle; `readings[indicator]` is a view of those of its subjects."""

    layout: Layout
    values: Floats  # (len(layout.places),), NaN: not evaluated
    matched: tuple[Ints | None, ...]  # per pair rows (k, 2) of the objects that both report

    def __getitem__(self, indicator: AnyIndicator) -> Floats:
        view: Floats = self.values[self.layout.span[indicator]]
        return view

    def by_channel(self) -> Floats:
        """Returns a view (len(CHANNEL_INDICATORS), n channels) of the values."""
        n = len(self.layout.channels)
        return self.values[: len(CHANNEL_INDICATORS) * n].reshape(-1, n)

    def by_pair(self) -> Floats:
        """Returns a view (len(PAIR_INDICATORS), n pairs) of the values."""
        n = len(CHANNEL_INDICATORS) * len(self.layout.channels)
        end = n + len(PAIR_INDICATORS) * len(self.layout.pairs)
        return self.values[n:end].reshape(len(PAIR_INDICATORS), -1)

    def shared_rows(self) -> list[set[int]]:
        """Returns per channel the rows of its objects that some other channel also reports."""
        rows: list[set[int]] = [set() for _ in self.layout.channels]
        for (a, b), matched in zip(self.layout.pairs, self.matched, strict=True):
            if matched is not None:
                rows[a].update(matched[:, 0].tolist())
                rows[b].update(matched[:, 1].tolist())
        return rows
