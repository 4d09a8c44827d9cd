"""The channels monitor: indicators, risk, rules and hazards of one drive, cycle by cycle (C-001).

It reads what channels report and nothing else; truth and words about the drive are not its input.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.channels import ChannelFrame, Cycle
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.frames import Usable, usable
from skidpad.evidence.hazards import (
    Profile,
    Rule,
    Signal,
    SignalReader,
    SignalReadings,
    load_rules,
)
from skidpad.evidence.indicators.catalogue import (
    CHANNEL_INDICATORS,
    PAIR_INDICATORS,
    Bound,
    Indicator,
    Threshold,
    Violation,
    load_thresholds,
)
from skidpad.evidence.indicators.panel import (
    CHANNEL_ROW,
    IndicatorPanel,
    IndicatorSettings,
    Readings,
)
from skidpad.evidence.risk import RiskMatrix, risk_matrix
from skidpad.evidence.timefilter import Event, TimeFilter
from skidpad.recording.hazards import HazardRecord, InvolvedObject

Floats = NDArray[np.float64]
BEFORE = 5.0  # s of world kept before a hazard (C-13)
AFTER = 5.0  # s after it
WORLD_LIMIT = 600  # cycles of world in one record; a longer hazard is flagged cut
Lap = Callable[[str], None]


@dataclass(slots=True)
class Unusable:
    """What channels reported and could not be evaluated, over the drive."""

    absent: Counter[str] = field(default_factory=Counter)  # cycles without a channel
    poses: Counter[str] = field(default_factory=Counter)  # cycles without a usable ego pose
    plans: Counter[str] = field(default_factory=Counter)  # cycles without a plan
    objects: Counter[str] = field(default_factory=Counter)  # objects that are not numbers
    objects_beyond_limit: Counter[str] = field(default_factory=Counter)
    shapes: Counter[str] = field(default_factory=Counter)  # objects without an area


class _Counts(NamedTuple):
    """Cycles per indicator and subject."""

    missing: NDArray[np.int64]
    violated: NDArray[np.int64]

    @classmethod
    def of(cls, indicators: int, subjects: int) -> _Counts:
        return cls(*np.zeros((2, indicators, subjects), dtype=np.int64))


@dataclass(slots=True)
class CycleEvidence:
    """Everything found in one cycle."""

    cycle: Cycle
    readings: Readings
    risk: RiskMatrix
    signals: SignalReadings
    fired: tuple[HazardType, ...]
    undecided: tuple[HazardType, ...]


class Monitor:
    """Watches N channels; `update` per cycle, `finish` at the end; records come out as they close."""

    def __init__(
        self,
        channels: Sequence[str],
        *,
        settings: IndicatorSettings | None = None,
        profile: Profile = Profile.PRACTICAL,
        rules: Sequence[Rule] | None = None,
        thresholds: dict[Indicator, Threshold] | None = None,
        keep_worlds: bool = True,
    ) -> None:
        self.channels = tuple(channels)
        self.pairs = tuple("+".join(p) for p in combinations(self.channels, 2))
        self.settings = settings or IndicatorSettings()
        self.profile = profile
        self.rules = tuple(rules) if rules is not None else load_rules(profile)
        self.thresholds = thresholds or load_thresholds()
        self.panel = IndicatorPanel(len(self.channels), self.settings)
        self.reader = SignalReader(len(self.channels))
        self.hazards: TimeFilter[HazardType] = TimeFilter()
        self.violations: TimeFilter[tuple[Indicator, str]] = TimeFilter()
        self.unusable = Unusable()
        self.undecided: Counter[HazardType] = Counter()
        self.context: dict[str, str] = {}
        self._recorder = _Recorder(self) if keep_worlds else None
        scopes = ((CHANNEL_INDICATORS, self.channels), (PAIR_INDICATORS, self.pairs))
        self._bounds = [_bounds(self.thresholds, indicators) for indicators, _ in scopes]
        self._counts = [_Counts.of(len(indicators), len(names)) for indicators, names in scopes]
        self._keys = [
            [
                [((i, name), self.thresholds[i].bound is Bound.LOWER) for name in names]
                for i in indicators
            ]
            for indicators, names in scopes
        ]

    def update(self, cycle: Cycle, lap: Lap | None = None) -> CycleEvidence:
        """Judge one cycle. `lap(name)` is called when the part `name` is done, for profiling."""
        done = lap or _no_lap
        kept = [None if f is None else usable(f) for f in cycle.frames]
        frames = [None if u is None else u.frame for u in kept]
        self._count_unusable(kept)
        readings = self.panel.begin(frames)
        done("prepare")
        self.panel.comfort(frames, readings)
        done("comfort")
        self.panel.similarity(frames, readings)
        self.panel.counts([None if u is None else u.reported for u in kept], readings)
        done("similarity")
        self.panel.prediction(frames, readings)
        done("motion_prediction")
        risk = risk_matrix(frames)
        readings.channel[CHANNEL_ROW[Indicator.SAFETY_SCORE]] = risk.safety_scores
        readings.channel[CHANNEL_ROW[Indicator.RISK_BEHIND_SHARE]] = risk.behind_share
        done("risk")
        signals = self.reader.read(cycle.t, readings, risk, cycle.driving)
        evidence = self._apply_rules(cycle, readings, risk, signals)
        self._count_violations(cycle.t, readings)
        if self._recorder:
            self._recorder.update(cycle._replace(frames=tuple(frames)), evidence)
        done("hazards")
        return evidence

    def _apply_rules(
        self, cycle: Cycle, readings: Readings, risk: RiskMatrix, signals: SignalReadings
    ) -> CycleEvidence:
        fired, undecided = [], []
        for rule in self.rules:
            verdict = rule.fires(signals.values)
            if verdict:
                fired.append(rule.hazard)
                self.hazards.add(
                    rule.hazard,
                    cycle.t,
                    signals.values[rule.extreme.signal],
                    rule.extreme.of == "least",
                )
            elif verdict is None:
                undecided.append(rule.hazard)
                self.undecided[rule.hazard] += 1
        return CycleEvidence(cycle, readings, risk, signals, tuple(fired), tuple(undecided))

    def records(self) -> list[HazardRecord]:
        """Records that have closed since the last call."""
        return self._recorder.take() if self._recorder else []

    def finish(self) -> list[HazardRecord]:
        """The records still open at the end of the drive, flagged as cut."""
        return self._recorder.finish() if self._recorder else []

    def _count_unusable(self, kept: Sequence[Usable | None]) -> None:
        u = self.unusable
        for name, one in zip(self.channels, kept, strict=True):
            if one is None:
                u.absent[name] += 1
                continue
            u.objects[name] += one.unusable
            u.objects_beyond_limit[name] += one.beyond_limit
            if not np.isfinite(one.frame.ego).all():
                u.poses[name] += 1
            if len(one.frame.plan) == 0:
                u.plans[name] += 1
            u.shapes[name] += int((one.frame.polygon_size < 3).sum())

    def _count_violations(self, t: float, readings: Readings) -> None:
        for values, counts, (low, high), keys in zip(
            (readings.channel, readings.pair), self._counts, self._bounds, self._keys, strict=True
        ):
            np.add(counts.missing, np.isnan(values), out=counts.missing)
            beyond = (values < low) | (values > high)
            if not beyond.any():
                continue
            np.add(counts.violated, beyond, out=counts.violated)
            for row, column in np.argwhere(beyond).tolist():
                key, least = keys[row][column]
                self.violations.add(key, t, float(values[row, column]), least)

    @property
    def not_evaluated(self) -> Counter[tuple[Indicator, str]]:
        """Cycles in which an indicator had no value, by indicator and subject."""
        return self._tally([counts.missing for counts in self._counts])

    @property
    def violation_cycles(self) -> Counter[tuple[Indicator, str]]:
        """Cycles in which an indicator was beyond its threshold."""
        return self._tally([counts.violated for counts in self._counts])

    def _tally(self, tables: Sequence[NDArray[np.int64]]) -> Counter[tuple[Indicator, str]]:
        return Counter(
            {
                keys[row][column][0]: int(table[row, column])
                for table, keys in zip(tables, self._keys, strict=True)
                for row, column in np.argwhere(table).tolist()
            }
        )

    def violations_now(self, readings: Readings) -> list[Violation]:
        """The violations of one cycle, for reading aloud."""
        out = []
        for values, indicators, subjects in (
            (readings.channel, CHANNEL_INDICATORS, self.channels),
            (readings.pair, PAIR_INDICATORS, self.pairs),
        ):
            for row, indicator in enumerate(indicators):
                entry = self.thresholds[indicator]
                for subject, value in zip(subjects, values[row].tolist(), strict=True):
                    if entry.threshold is not None and entry.violated(value):
                        out.append(Violation(indicator, subject, value, entry.threshold))
        return out


def _no_lap(_: str) -> None:
    return


def _bounds(
    thresholds: dict[Indicator, Threshold], indicators: Sequence[Indicator]
) -> tuple[Floats, Floats]:
    """Least and greatest value of each indicator that raises no alarm."""
    low, high = np.full((len(indicators), 1), -np.inf), np.full((len(indicators), 1), np.inf)
    for row, indicator in enumerate(indicators):
        entry = thresholds[indicator]
        if entry.threshold is not None:
            (low if entry.bound is Bound.LOWER else high)[row] = entry.threshold
    return low, high


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


class _Recorder:
    """Gathers the worlds around hazards from 5 s before to 5 s after."""

    def __init__(self, monitor: Monitor) -> None:
        self.monitor = monitor
        self.rules = {rule.hazard: rule for rule in monitor.rules}
        self.past: deque[Cycle] = deque()
        self.open: dict[HazardType, _Open] = {}
        self.closed: list[HazardRecord] = []
        self.number = 0

    def update(self, cycle: Cycle, evidence: CycleEvidence) -> None:
        """Add the cycle to the past and to all open hazards."""
        cycle = cycle._replace(truth=None)  # a record holds what channels said
        t = cycle.t
        for hazard, one in list(self.open.items()):
            if hazard not in evidence.fired and t - one.t_end > AFTER + 1e-6:
                self._close(hazard)
        while self.past and t - self.past[0].t > BEFORE + 1e-6:
            self.past.popleft()
        for hazard in evidence.fired:
            self._fired(hazard, cycle, evidence)
        for one in self.open.values():
            if len(one.worlds) < WORLD_LIMIT:
                one.worlds.append(cycle)
            else:
                one.cut = True
        self.past.append(cycle)

    def _fired(self, hazard: HazardType, cycle: Cycle, evidence: CycleEvidence) -> None:
        rule = self.rules[hazard]
        value = evidence.signals.values[rule.extreme.signal]
        one = self.open.get(hazard)
        pause = self.monitor.hazards.pause
        if one is not None and cycle.t - one.t_end >= pause:
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
        one = self.open.pop(hazard)
        self.number += 1
        monitor = self.monitor
        involved, objects = _involved(hazard, one, monitor.channels)
        driving = one.signals.driving
        assumed = one.assumed and any(
            c.signal in (Signal.GAP, Signal.GAP_SIGNED) for a in one.rule.alternatives for c in a
        )
        flags = [name for name, set_ in (("assumed", assumed), ("cut", one.cut)) if set_]
        self.closed.append(
            HazardRecord(
                id=f"h{self.number:04d}",
                type=hazard,
                profile=monitor.profile.value,
                forms=monitor.settings.form.value,
                t_start=round(one.t_start, 3),
                t_end=round(one.t_end, 3),
                t_worst=round(one.t_worst, 3),
                count=one.count,
                extremes={
                    s.value: round(v, 6) for s, v in one.signals.values.items() if np.isfinite(v)
                },
                channels=monitor.channels,
                driving=None if driving is None else monitor.channels[driving],
                involved=involved,
                objects=objects,
                flags=tuple(flags),
                context=dict(monitor.context),
                worlds=tuple(one.worlds),
            )
        )

    def take(self) -> list[HazardRecord]:
        """Closed records, each once."""
        done, self.closed = self.closed, []
        return done

    def finish(self) -> list[HazardRecord]:
        """Close everything; what has not had its 5 s after is cut."""
        for hazard in list(self.open):
            one = self.open[hazard]
            one.cut |= not one.worlds or one.worlds[-1].t - one.t_end < AFTER - 1e-6
            self._close(hazard)
        return self.take()


def _involved(
    hazard: HazardType, one: _Open, channels: tuple[str, ...]
) -> tuple[tuple[str, ...], tuple[InvolvedObject, ...]]:
    """Channels and objects that a record names."""
    if hazard is HazardType.INCONSISTENT_LOCALISATION or not np.isfinite(one.risk.risk).any():
        pair = one.signals.gap_pair
        names = channels if pair is None else _pair(channels, pair)
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


def _pair(channels: tuple[str, ...], pair: int) -> tuple[str, ...]:
    return tuple(combinations(channels, 2))[pair]


def drive_events(
    monitor: Monitor,
) -> tuple[list[Event[HazardType]], list[Event[tuple[Indicator, str]]]]:
    """All hazard events and threshold-violation events of a finished drive, by start."""
    hazards = sorted(monitor.hazards.finish(), key=lambda e: (e.t_start, e.key.value))
    violations = sorted(
        monitor.violations.finish(), key=lambda e: (e.t_start, e.key[0].value, e.key[1])
    )
    return hazards, violations
