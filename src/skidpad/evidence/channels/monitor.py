"""The channels monitor: indicators, risk, rules and hazards of one drive, cycle by cycle (C-001).

It reads what channels report and nothing else; truth and words about the drive are not its input.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame, Cycle
from skidpad.core.errors import ConfigError, require_range
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.choices import Identify, Profile
from skidpad.evidence.channels.frames import Usable, usable
from skidpad.evidence.channels.hazards import Rule, SignalReader, SignalReadings, load_rules
from skidpad.evidence.channels.identifier.features import feature_row
from skidpad.evidence.channels.identifier.model import Detector, LearnedIdentifier
from skidpad.evidence.channels.indicators.catalogue import (
    AnyIndicator,
    Bound,
    Indicator,
    Threshold,
    load_thresholds,
)
from skidpad.evidence.channels.indicators.layout import IndicatorReadings, Place
from skidpad.evidence.channels.indicators.panel import IndicatorPanel, Lap, no_lap
from skidpad.evidence.channels.indicators.settings import IndicatorSettings
from skidpad.evidence.channels.recorder import CycleEvidence, Recorder
from skidpad.evidence.channels.risk import RiskForm, RiskMatrix, risk_matrix
from skidpad.evidence.channels.timefilter import Event, TimeFilter
from skidpad.evidence.channels.tracked.distance import GRIPS, SafeDistance
from skidpad.evidence.channels.tracked.vote import Tracked
from skidpad.recording.hazards.records import HazardRecord


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
        """Returns the counts above zero by kind and channel."""
        kinds = ("absent", "poses", "plans", "objects", "objects_beyond_limit", "shapes")
        return {kind: dict(+getattr(self, kind)) for kind in kinds}


@dataclass(frozen=True, slots=True, kw_only=True)
class MonitorSettings:
    """How a drive is judged."""

    indicators: IndicatorSettings = field(default_factory=IndicatorSettings)
    profile: Profile = Profile.TRACKED
    rules: tuple[Rule, ...] = ()  # empty: the built-in ones of the profile
    thresholds: Mapping[AnyIndicator, Threshold] = field(default_factory=load_thresholds)
    identify: Identify = Identify.RULES
    detectors: Mapping[HazardType, Detector] = field(default_factory=dict)
    keep_worlds: bool = True  # gather records of hazards
    grip: float | None = None  # of the road, as told to the rules `tracked`; None: a dry one

    def __post_init__(self) -> None:
        if self.identify is not Identify.RULES and not self.detectors:
            raise ConfigError(f"--identifier {self.identify.value} needs a trained model")
        if self.grip is not None:
            require_range("grip", self.grip, *GRIPS)
            if self.profile is not Profile.TRACKED:
                raise ConfigError(
                    f"grip is a setting of the rules `tracked`, the rules are `{self.profile.value}`"
                )

    @property
    def safe_distance(self) -> SafeDistance:
        """Returns the safe distance of the rules `tracked`, on the stated grip or on a dry road."""
        return SafeDistance() if self.grip is None else SafeDistance.on(self.grip)


class Monitor:
    """Watches N channels; `update` per cycle, `finish` at the end; records come out as they close."""

    def __init__(self, channels: Sequence[str], settings: MonitorSettings | None = None) -> None:
        self.channels = tuple(channels)
        self.settings = settings = settings or MonitorSettings()
        self.rules = settings.rules or load_rules(settings.profile)
        self.thresholds = settings.thresholds
        printed = settings.profile is Profile.AS_PRINTED
        self.risk_form = RiskForm.AS_PRINTED if printed else RiskForm.RECOMMENDED
        self.panel = IndicatorPanel(self.channels, settings.indicators)
        self.layout = self.panel.layout
        self.reader = SignalReader(self.layout)
        self.hazards: TimeFilter[HazardType] = TimeFilter()
        self.violations: TimeFilter[Place] = TimeFilter()
        self.unusable = Unusable()
        self.ghosts = GhostCue(self.channels)
        self.undecided: Counter[HazardType] = Counter()
        self.learned = (
            None if settings.identify is Identify.RULES else LearnedIdentifier(settings.detectors)
        )
        self._recorder = (
            Recorder(
                self.channels,
                self.rules,
                settings.profile.value,
                settings.indicators.form.value,
                self.hazards.pause,
            )
            if settings.keep_worlds
            else None
        )
        self.tracked = (
            Tracked(self.channels, settings.safe_distance)
            if settings.profile is Profile.TRACKED
            else None
        )
        self._low, self._high = self._bounds()
        self._missing, self._violated = np.zeros((2, len(self.layout.places)), dtype=np.int64)

    def update(self, cycle: Cycle, lap: Lap = no_lap) -> CycleEvidence:
        """Judges one cycle and returns all that was found in it; adds its hazards, violations and records.

        `lap(name)` is called when the part `name` is done, for profiling.
        """
        kept = [None if f is None else usable(f) for f in cycle.frames]
        frames = [None if u is None else u.frame for u in kept]
        self._count_unusable(kept)
        readings = self.panel.update(kept, lap)
        self.ghosts.update(frames, readings.shared_rows())
        risk = risk_matrix(frames, form=self.risk_form)
        readings[Indicator.SAFETY_SCORE][:] = risk.safety_scores
        readings[Indicator.RISK_BEHIND_SHARE][:] = risk.behind_share
        lap("risk")
        signals = self.reader.read(cycle.t, readings, risk, cycle.driving)
        if self.tracked is not None:
            signals.values.update(self.tracked.update(cycle.t, frames))
        evidence = self._apply_rules(cycle, readings, risk, signals)
        self._count_violations(cycle.t, readings)
        if self._recorder:
            self._recorder.update(cycle._replace(frames=tuple(frames)), evidence)
        lap("hazards")
        return evidence

    def _apply_rules(
        self, cycle: Cycle, readings: IndicatorReadings, risk: RiskMatrix, signals: SignalReadings
    ) -> CycleEvidence:
        """Returns the cycle's evidence with the rules that fired and those undecided; adds the hazards."""
        fired, undecided = [], []
        learned = self._learned_hazards(cycle.t, readings, risk, signals)
        for rule in self.rules:
            verdict = rule.fires(signals.values)
            # what was not learned stays with its rule
            if (
                self.settings.identify is Identify.LEARNED
                and rule.hazard in self.settings.detectors
            ):
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

    def _learned_hazards(
        self, t: float, readings: IndicatorReadings, risk: RiskMatrix, signals: SignalReadings
    ) -> list[HazardType]:
        """Returns the hazards that the learned identifier finds at `t` s; empty without one."""
        if self.learned is None:
            return []
        return self.learned.update(t, feature_row(readings, risk, signals))

    def note(self, entries: dict[str, str]) -> None:
        """Adds words about the drive, which are copied into records; nothing is judged by them."""
        if self._recorder:
            self._recorder.context.update(entries)

    @property
    def context(self) -> dict[str, str]:
        """Returns the words about the drive so far; {} when no records are kept."""
        return dict(self._recorder.context) if self._recorder else {}

    def records(self) -> list[HazardRecord]:
        """Returns the records that have closed since the last call; [] when none are kept."""
        return self._recorder.take() if self._recorder else []

    def finish(self) -> list[HazardRecord]:
        """Closes the records that are still open at the end of the drive and returns them, flagged as cut."""
        return self._recorder.finish() if self._recorder else []

    def _count_unusable(self, kept: Sequence[Usable | None]) -> None:
        """Counts per channel what could not be used in the cycle; None stands for an absent frame."""
        u = self.unusable
        for name, one in zip(self.channels, kept, strict=True):
            if one is None:
                u.absent[name] += 1
                continue
            if one.unusable or one.beyond_limit:
                u.objects[name] += one.unusable
                u.objects_beyond_limit[name] += one.beyond_limit
            if not all(map(isfinite, one.frame.ego.tolist())):
                u.poses[name] += 1
            if len(one.frame.plan) == 0:
                u.plans[name] += 1
            flat = [size for size in one.frame.polygon_size.tolist() if size < 3]
            if flat:
                u.shapes[name] += len(flat)

    def _count_violations(self, t: float, readings: IndicatorReadings) -> None:
        """Counts the cycle's missing and violated values, and adds the violations at `t` s."""
        self._missing += np.isnan(readings.values)
        beyond = (readings.values < self._low) | (readings.values > self._high)
        self._violated += beyond
        for k in np.flatnonzero(beyond).tolist():
            place = self.layout.places[k]
            least = self.thresholds[place.indicator].bound is Bound.LOWER
            self.violations.add(place, t, float(readings.values[k]), least)

    @property
    def not_evaluated(self) -> Counter[Place]:
        """Returns in how many cycles an indicator had no value, by indicator and subject; none at 0."""
        return self._tally(self._missing)

    @property
    def violation_cycles(self) -> Counter[Place]:
        """Returns in how many cycles an indicator was beyond its threshold, by indicator and subject."""
        return self._tally(self._violated)

    def _tally(self, cycles: NDArray[np.int64]) -> Counter[Place]:
        """Returns the counts of cycles by place, those at 0 left out."""
        return Counter({self.layout.places[k]: int(cycles[k]) for k in np.flatnonzero(cycles)})

    def _bounds(self) -> tuple[Floats, Floats]:
        """Returns least and greatest value at each place of a row that raise no alarm; inf: no bound."""
        low, high = np.full((2, len(self.layout.places)), [[-np.inf], [np.inf]])
        for k, place in enumerate(self.layout.places):
            entry = self.thresholds[place.indicator]
            if entry.threshold is not None:
                (low if entry.bound is Bound.LOWER else high)[k] = entry.threshold
        return low, high


def drive_events(
    monitor: Monitor,
) -> tuple[list[Event[HazardType]], list[Event[Place]]]:
    """Returns all hazard events and all threshold-violation events of a drive, each by start; ends them."""
    hazards = sorted(monitor.hazards.finish(), key=lambda e: (e.t_start, e.key.value))
    violations = sorted(
        monitor.violations.finish(), key=lambda e: (e.t_start, e.key[0].value, e.key[1])
    )
    return hazards, violations


# --- a cue for ghosts: objects that one channel alone reports, and only for a moment (C-130)
MOMENT = 0.5  # s


class GhostCue:
    """Counts brief objects per channel; only channels that give identities can be followed."""

    def __init__(self, channels: Sequence[str]) -> None:
        self.channels = tuple(channels)
        self.brief: Counter[str] = Counter()
        self._since: list[dict[int, float]] = [{} for _ in channels]  # id -> first seen, s
        self._shared: list[set[int]] = [set() for _ in channels]  # ids that another channel knew

    def update(self, frames: Sequence[ChannelFrame | None], shared: Sequence[set[int]]) -> None:
        """Takes in one cycle; `shared` holds per channel the rows that were paired with another channel.

        An object counts in `brief` when it goes within MOMENT of its first cycle and was never shared.
        """
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
