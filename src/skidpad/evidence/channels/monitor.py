"""The channels monitor: indicators, risk, rules and hazards of one drive, cycle by cycle (C-001).

It reads what channels report and nothing else; truth and words about the drive are not its input.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.channels import Cycle
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.frames import Usable, usable
from skidpad.evidence.channels.ghosts import GhostCue
from skidpad.evidence.channels.hazards import (
    SCORED_HAZARDS,
    Profile,
    Rule,
    SignalReader,
    SignalReadings,
    load_rules,
)
from skidpad.evidence.channels.identifier.features import feature_row
from skidpad.evidence.channels.identifier.model import Detector, Identify, LearnedIdentifier
from skidpad.evidence.channels.indicators.catalogue import (
    CHANNEL_INDICATORS,
    PAIR_INDICATORS,
    Bound,
    Indicator,
    Threshold,
    Violation,
    load_thresholds,
)
from skidpad.evidence.channels.indicators.panel import (
    CHANNEL_ROW,
    IndicatorPanel,
    IndicatorSettings,
    Readings,
)
from skidpad.evidence.channels.recorder import CycleEvidence, Recorder
from skidpad.evidence.channels.risk import RiskMatrix, risk_matrix
from skidpad.evidence.channels.timefilter import Event, TimeFilter
from skidpad.recording.hazards import HazardRecord

Floats = NDArray[np.float64]
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

    def as_dict(self) -> dict[str, dict[str, int]]:
        """Counts above zero by kind and channel."""
        kinds = ("absent", "poses", "plans", "objects", "objects_beyond_limit", "shapes")
        return {kind: dict(+getattr(self, kind)) for kind in kinds}


class _Counts(NamedTuple):
    """Cycles per indicator and subject."""

    missing: NDArray[np.int64]
    violated: NDArray[np.int64]

    @classmethod
    def of(cls, indicators: int, subjects: int) -> _Counts:
        return cls(*np.zeros((2, indicators, subjects), dtype=np.int64))


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
        identify: Identify = Identify.RULES,
        detectors: Mapping[HazardType, Detector] | None = None,
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
        self.ghosts = GhostCue(self.channels)
        self.undecided: Counter[HazardType] = Counter()
        self.identify = identify
        self.learned = (
            LearnedIdentifier(detectors or {}) if identify is not Identify.RULES else None
        )
        self._recorder = (
            Recorder(
                self.channels,
                self.rules,
                profile.value,
                self.settings.form.value,
                self.hazards.pause,
            )
            if keep_worlds
            else None
        )
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
        self.ghosts.update(frames, self.panel.paired_rows())
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
        learned = self._learned(cycle.t, readings, risk, signals)
        for rule in self.rules:
            verdict = rule.fires(signals.values)
            if self.identify is Identify.LEARNED and rule.hazard in SCORED_HAZARDS:
                verdict = rule.hazard in learned
            elif rule.hazard in learned:
                verdict = True
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

    def _learned(
        self, t: float, readings: Readings, risk: RiskMatrix, signals: SignalReadings
    ) -> list[HazardType]:
        if self.learned is None:
            return []
        return self.learned.update(t, feature_row(readings, risk, signals))

    def note(self, entries: dict[str, str]) -> None:
        """Words about the drive, copied into records; nothing is judged by them."""
        if self._recorder:
            self._recorder.context.update(entries)

    @property
    def context(self) -> dict[str, str]:
        """Words about the drive so far."""
        return dict(self._recorder.context) if self._recorder else {}

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


def drive_events(
    monitor: Monitor,
) -> tuple[list[Event[HazardType]], list[Event[tuple[Indicator, str]]]]:
    """All hazard events and threshold-violation events of a finished drive, by start."""
    hazards = sorted(monitor.hazards.finish(), key=lambda e: (e.t_start, e.key.value))
    violations = sorted(
        monitor.violations.finish(), key=lambda e: (e.t_start, e.key[0].value, e.key[1])
    )
    return hazards, violations
