"""Hazard records: the worlds around what the rules found, from 5 s before to 5 s after (C-13)."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from skidpad.core.channels import ChannelFrame, Cycle
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.hazards import Rule, Signal, SignalReadings
from skidpad.evidence.channels.indicators.layout import IndicatorReadings
from skidpad.evidence.channels.risk import RiskMatrix
from skidpad.evidence.channels.timefilter import SAME_TIME
from skidpad.recording.hazards.records import HazardRecord, InvolvedObject

BEFORE = 5.0  # s of world kept before a hazard
AFTER = 5.0  # s after it
WORLD_LIMIT = 600  # cycles of world in one record; a longer hazard is flagged cut


@dataclass(slots=True)
class CycleEvidence:
    """Everything found in one cycle."""

    cycle: Cycle
    readings: IndicatorReadings
    risk: RiskMatrix
    signals: SignalReadings
    fired: tuple[HazardType, ...]
    undecided: tuple[HazardType, ...]


@dataclass(slots=True)
class _Open:
    """A hazard whose record is being gathered."""

    rule: Rule
    t_start: float
    t_end: float
    t_worst: float
    count: int
    worst: float
    signals: SignalReadings
    risk: RiskMatrix
    frames: tuple[ChannelFrame | None, ...]
    worlds: list[Cycle]
    assumed: bool
    cut: bool = False


class Recorder:
    """Gathers the worlds around hazards from 5 s before to 5 s after."""

    def __init__(
        self,
        channels: tuple[str, ...],
        rules: Sequence[Rule],
        profile: str,
        forms: str,
        pause: float,
    ) -> None:
        self.channels, self.profile, self.forms, self.pause = channels, profile, forms, pause
        self.rules = {rule.hazard: rule for rule in rules}
        self.context: dict[str, str] = {}  # words about the drive
        self.past: deque[Cycle] = deque()
        self.open: dict[HazardType, _Open] = {}
        self.closed: list[HazardRecord] = []
        self.number = 0

    def update(self, cycle: Cycle, evidence: CycleEvidence) -> None:
        """Adds the cycle to the past and to all open hazards; closes those whose AFTER s are over."""
        cycle = cycle._replace(truth=None)  # a record holds what channels said
        t = cycle.t
        for hazard, one in list(self.open.items()):
            if hazard not in evidence.fired and t - one.t_end > AFTER + SAME_TIME:
                self._close(hazard)
        while self.past and t - self.past[0].t > BEFORE + SAME_TIME:
            self.past.popleft()
        for hazard in evidence.fired:
            self._note_firing(hazard, cycle, evidence)
        for one in self.open.values():
            if len(one.worlds) < WORLD_LIMIT:
                one.worlds.append(cycle)
            else:
                one.cut = True
        self.past.append(cycle)

    def _note_firing(self, hazard: HazardType, cycle: Cycle, evidence: CycleEvidence) -> None:
        """Begins or extends the open record of a hazard that fired; keeps the cycle of its worst value."""
        rule = self.rules[hazard]
        value = evidence.signals.values[rule.extreme.signal]
        one = self.open.get(hazard)
        if one is not None and cycle.t - one.t_end >= self.pause - SAME_TIME:
            # a new event begins within the 5 s after the last: that record ends here
            self._close(hazard)
            one = None
        if one is None:
            self.open[hazard] = _Open(
                rule, cycle.t, cycle.t, cycle.t, 1, value, evidence.signals, evidence.risk,
                cycle.frames, list(self.past), evidence.signals.assumed,
            )  # fmt: skip
            return
        one.t_end = cycle.t
        one.count += 1
        one.assumed |= evidence.signals.assumed
        harder = value < one.worst if rule.extreme.of == "least" else value > one.worst
        if harder:
            one.worst, one.t_worst = value, cycle.t
            one.signals, one.risk, one.frames = evidence.signals, evidence.risk, cycle.frames

    def _close(self, hazard: HazardType) -> None:
        """Turns the hazard's open record into a finished one and appends it to `closed`."""
        one = self.open.pop(hazard)
        self.number += 1
        involved, objects = _name_involved(hazard, one, self.channels)
        driving = one.signals.driving
        assumed = one.assumed and any(
            c.signal in (Signal.GAP, Signal.GAP_SIGNED) for a in one.rule.alternatives for c in a
        )
        flags = [name for name, set_ in (("assumed", assumed), ("cut", one.cut)) if set_]
        self.closed.append(
            HazardRecord(
                id=f"h{self.number:04d}",
                type=hazard,
                profile=self.profile,
                forms=self.forms,
                t_start=round(one.t_start, 3),
                t_end=round(one.t_end, 3),
                t_worst=round(one.t_worst, 3),
                count=one.count,
                extremes={
                    s.value: round(v, 6) for s, v in one.signals.values.items() if np.isfinite(v)
                },
                channels=self.channels,
                driving=None if driving is None else self.channels[driving],
                involved=involved,
                objects=objects,
                flags=tuple(flags),
                context=dict(self.context),
                worlds=tuple(one.worlds),
            )
        )

    def take(self) -> list[HazardRecord]:
        """Returns the records that were closed, each once."""
        done, self.closed = self.closed, []
        return done

    def finish(self) -> list[HazardRecord]:
        """Closes everything and returns it; what has not had its AFTER s is flagged as cut."""
        for hazard in list(self.open):
            one = self.open[hazard]
            one.cut |= not one.worlds or one.worlds[-1].t - one.t_end < AFTER - SAME_TIME
            self._close(hazard)
        return self.take()


def _name_involved(
    hazard: HazardType, one: _Open, channels: tuple[str, ...]
) -> tuple[tuple[str, ...], tuple[InvolvedObject, ...]]:
    """Returns the channels and objects that a record names: those of the worst risk on its side.

    For localisation, or without any risk, the pair with the largest gap, else all channels; no object.
    """
    if hazard is HazardType.INCONSISTENT_LOCALISATION or not np.isfinite(one.risk.risk).any():
        pair = one.signals.gap_pair
        names = channels if pair is None else tuple(combinations(channels, 2))[pair]
        return tuple(names), ()
    behind = hazard is HazardType.EGO_TAILGATED
    risk = one.risk.risk_behind if behind else one.risk.risk_ahead
    worst = one.risk.worst_behind if behind else one.risk.worst_ahead
    a, b = np.unravel_index(int(np.argmax(np.nan_to_num(risk, nan=-1.0))), risk.shape)
    names = tuple(dict.fromkeys((channels[int(a)], channels[int(b)])))
    frame, row = one.frames[int(b)], int(worst[a, b])
    if frame is None or row < 0:
        return names, ()
    identity = int(frame.ids[row])
    x, y = frame.objects[row, :2].tolist()
    return names, (
        InvolvedObject(
            channels[int(b)], identity if identity >= 0 else None, round(x, 3), round(y, 3)
        ),
    )
