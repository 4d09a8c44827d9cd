"""Hazard rules as data, read against indicator and safety-score values only (C-120 to C-130)."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache
from importlib.resources import files
from pathlib import Path

import msgspec
import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.errors import ConfigError
from skidpad.core.files.reading import decode_yaml, read_bytes
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.choices import Form, Profile
from skidpad.evidence.channels.indicators.catalogue import Indicator
from skidpad.evidence.channels.indicators.layout import IndicatorReadings, Layout
from skidpad.evidence.channels.risk import RiskMatrix
from skidpad.evidence.comparisons import OPERATORS

SCORED_HAZARDS = (
    HazardType.INCONSISTENT_LOCALISATION,
    HazardType.EGO_TAILGATING,
    HazardType.EGO_TAILGATED,
)
STEADY_TIME = 20.0  # s over which a stuck vehicle's indicators hardly move (C-129)
STEADY_RANGE = 0.1
DIP = 0.2  # a fall of cross-channel path similarity below its recent best that counts as a dip


def default_form(profile: Profile) -> Form:
    """Returns the comfort formulas that go with the rules of `profile` (decision C-16)."""
    return Form.COMPLETED if profile is Profile.AS_PRINTED else Form.CORRECTED


class Signal(str, Enum):
    """What a clause may name; each is one number per cycle for any number of channels (C-7)."""

    LOCATION_VARIANCE = "location_variance"  # greatest over pairs
    EGO_LOCATION = "ego_location"  # least over pairs
    SHIFT_SHORT = "shift_short"  # m, greatest over pairs
    SHIFT_LONG = "shift_long"  # m
    GAP = "gap"  # |OLSS - OCSS| of the pair where it is largest
    GAP_SIGNED = "gap_signed"  # OLSS - OCSS of that pair
    SAFETY_SCORE = "safety_score"  # least over channels
    TTC_AHEAD = "ttc_ahead"  # s, least over plans and worlds, of objects ahead; inf: no overlap
    TTC_BEHIND = "ttc_behind"  # s
    RISK_AHEAD_LEAD = "risk_ahead_lead"  # largest risk ahead less largest risk behind
    COMFORT_DRIVING = "comfort_driving"  # planned-path comfort of the driving channel
    COMFORT_LEAST = "comfort_least"
    CROSS_PATH = "cross_path"  # least over pairs
    CROSS_PATH_VARIANCE = "cross_path_variance"
    CHANNEL_PATH_VARIANCE = "channel_path_variance"  # greatest over channels
    EGO_TRAJECTORY = "ego_trajectory"
    STEADY_SHARE = "steady_share"  # share of the other indicators that hardly moved for 20 s
    CROSS_PATH_DIPS = "cross_path_dips"  # in those 20 s
    SCORE_RANGE = "score_range"  # of the safety score, in those 20 s
    COUNT_RANGE = "count_range"  # of the object count similarity
    # of the profile tracked alone, see tracked/vote.py
    REAR_DEFICIT = "rear_deficit"  # m that the gap behind is surely shorter than the safe one
    FRONT_DEFICIT = "front_deficit"  # m
    UNSEEN_DEFICIT = "unseen_deficit"  # m, of an object that another channel does not report
    OFFSET_CHI2 = "offset_chi2"  # of positions, greatest over pairs
    POSITION_LEAP = "position_leap"  # m by which one leaves what odometry says, over channels
    PLANS_APART = "plans_apart"  # s until two plans share no ground, least over pairs


NOT_TRACKED = dict.fromkeys(
    (
        Signal.REAR_DEFICIT, Signal.FRONT_DEFICIT, Signal.UNSEEN_DEFICIT, Signal.OFFSET_CHI2,
        Signal.POSITION_LEAP, Signal.PLANS_APART,
    ),
    float("nan"),
)  # fmt: skip
_UNSTEADY = {
    Indicator.CROSS_PATH,
    Indicator.CROSS_PATH_VARIANCE,
    Indicator.OBJECT_COUNT,
    Indicator.EGO_SHIFT_LONG,  # needs 10 s of its own
    Indicator.AGREEMENT,
    Indicator.OBJECTS_LEFT,
    Indicator.SAFETY_SCORE,
    Indicator.RISK_BEHIND_SHARE,
}
_STEADY = tuple(i for i in Indicator if i not in _UNSTEADY)


@dataclass(frozen=True, slots=True)
class Clause:
    """Compares a signal with a value, written `signal operator value`."""

    signal: Signal
    operator: str
    value: float

    @classmethod
    def parse(cls, text: str) -> Clause:
        """Returns the clause in a text such as "gap > 0.3"; raises ConfigError for any other form."""
        try:
            signal, symbol, value = text.split()
            if symbol not in OPERATORS:
                raise ValueError
            return cls(Signal(signal), symbol, float(value))
        except ValueError:
            raise ConfigError(
                f"hazard clause {text!r} must read SIGNAL OPERATOR NUMBER with an operator of "
                f"{' '.join(OPERATORS)} and a signal of {', '.join(s.value for s in Signal)}"
            ) from None

    def holds(self, signals: dict[Signal, float]) -> bool | None:
        """Returns whether the clause holds; None while its signal is not evaluated."""
        value = signals[self.signal]
        return None if np.isnan(value) else OPERATORS[self.operator](value, self.value)


class Extreme(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The signal whose extreme an event keeps."""

    signal: Signal
    of: str  # least or greatest

    def __post_init__(self) -> None:
        if self.of not in ("least", "greatest"):
            raise ValueError(f"of must be least or greatest, got {self.of!r}")


class _RuleText(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    any: list[list[str]]
    extreme: Extreme

    def __post_init__(self) -> None:
        if not self.any or not all(self.any):
            raise ValueError("any needs alternatives of at least one clause each")


@dataclass(frozen=True, slots=True)
class Rule:
    """The rule of a hazard, which is present when all clauses of any alternative hold."""

    hazard: HazardType
    alternatives: tuple[tuple[Clause, ...], ...]
    extreme: Extreme

    def fires(self, signals: dict[Signal, float]) -> bool | None:
        """Returns True where an alternative holds, False where none can; None while it cannot be decided."""
        verdict: bool | None = False
        for clauses in self.alternatives:
            held = [clause.holds(signals) for clause in clauses]
            if all(held):  # neither False nor None
                return True
            if False not in held:
                verdict = None
        return verdict


def load_rules(profile: Profile, path: Path | None = None) -> tuple[Rule, ...]:
    """Returns the built-in rules of `profile`, or those in the YAML file at `path`.

    Raises ConfigError when the file lacks the profile or a clause is not usable.
    """
    if path is None:
        return _own_rules(profile)
    return _rules(profile, read_bytes(path, "hazard rules"), str(path))


@cache
def _own_rules(profile: Profile) -> tuple[Rule, ...]:
    """Returns the built-in rules of the profile."""
    built_in = files("skidpad.evidence.channels").joinpath("hazard_rules.yaml")
    return _rules(profile, built_in.read_bytes(), built_in.name)


def load_only_rules(path: Path) -> tuple[Profile, tuple[Rule, ...]]:
    """Returns the one profile that the file at `path` holds, and its rules; ConfigError for more or none."""
    tables = _tables(read_bytes(path, "hazard rules"), str(path))
    if len(tables) != 1:
        raise ConfigError(f"{path}: must hold the rules of one profile, holds {len(tables)}")
    ((profile, table),) = tables.items()
    return profile, _compile_rules(table)


def _tables(data: bytes, name: str) -> dict[Profile, dict[HazardType, _RuleText]]:
    """Returns the rule texts by profile and hazard in the YAML `data`; `name` stands in errors."""
    tables: dict[Profile, dict[HazardType, _RuleText]] = decode_yaml(
        data, name, dict[Profile, dict[HazardType, _RuleText]]
    )
    return tables


def _rules(profile: Profile, data: bytes, name: str) -> tuple[Rule, ...]:
    """Returns the profile's rules in the YAML `data`; raises ConfigError where it lacks the profile."""
    tables = _tables(data, name)
    if profile not in tables:
        raise ConfigError(f"{name}: holds no profile {profile.value}")
    return _compile_rules(tables[profile])


def _compile_rules(table: Mapping[HazardType, _RuleText]) -> tuple[Rule, ...]:
    """Returns a rule per hazard with its clauses parsed."""
    return tuple(
        Rule(
            hazard,
            tuple(tuple(Clause.parse(text) for text in clauses) for clauses in rule.any),
            rule.extreme,
        )
        for hazard, rule in table.items()
    )


@dataclass(frozen=True, slots=True)
class SignalReadings:
    """The signals of a cycle, and their source."""

    values: dict[Signal, float]  # NaN: not evaluated
    gap_pair: int | None  # pair with the largest gap
    assumed: bool  # no objects were paired there, so OLSS counts as 1 (decision C-6)
    driving: int | None  # channel whose comfort was read


class SignalReader:
    """Signals of a cycle from readings and risk; remembers what a stuck vehicle looks like."""

    def __init__(self, layout: Layout) -> None:
        self.steadiness = _Steadiness(layout)

    def read(
        self, t: float, readings: IndicatorReadings, risk: RiskMatrix, driving: int | None
    ) -> SignalReadings:
        """Returns the signals of the cycle at `t` s, NaN where not evaluated; to be called once per cycle.

        driving: number of the channel that drives; None: the one with the highest safety score is taken.
        """
        scores = readings[Indicator.SAFETY_SCORE]
        comfort = readings[Indicator.PLANNED_PATH_COMFORT]
        if driving is None:
            known = [(score, -i) for i, score in enumerate(scores.tolist()) if score == score]
            driving = -max(known)[1] if known else None
        gap, pair, assumed = _largest_gap(readings)
        values = {
            Signal.LOCATION_VARIANCE: _greatest(readings[Indicator.EGO_LOCATION_VARIANCE]),
            Signal.EGO_LOCATION: _least(readings[Indicator.EGO_LOCATION]),
            Signal.SHIFT_SHORT: _greatest(readings[Indicator.EGO_SHIFT_SHORT]),
            Signal.SHIFT_LONG: _greatest(readings[Indicator.EGO_SHIFT_LONG]),
            Signal.GAP: abs(gap),
            Signal.GAP_SIGNED: gap,
            Signal.SAFETY_SCORE: _least(scores),
            Signal.TTC_AHEAD: _least(risk.ttc_ahead.ravel()),
            Signal.TTC_BEHIND: _least(risk.ttc_behind.ravel()),
            Signal.RISK_AHEAD_LEAD: _greatest(risk.risk_ahead.ravel())
            - _greatest(risk.risk_behind.ravel()),
            Signal.COMFORT_DRIVING: float(comfort[driving]) if driving is not None else np.nan,
            Signal.COMFORT_LEAST: _least(comfort),
            Signal.CROSS_PATH: _least(readings[Indicator.CROSS_PATH]),
            Signal.CROSS_PATH_VARIANCE: _greatest(readings[Indicator.CROSS_PATH_VARIANCE]),
            Signal.CHANNEL_PATH_VARIANCE: _greatest(readings[Indicator.CHANNEL_PATH_VARIANCE]),
            Signal.EGO_TRAJECTORY: _least(readings[Indicator.EGO_TRAJECTORY]),
            **NOT_TRACKED,
        }
        values.update(self.steadiness.update(t, readings, values))
        return SignalReadings(values, pair, assumed, driving)


def _largest_gap(readings: IndicatorReadings) -> tuple[float, int | None, bool]:
    """Returns location less count similarity of objects of the pair where it is largest by size.

    Besides, the pair's number, and whether the location counted as 1 for want of matched objects.
    (nan, None, False) where no pair was evaluated.
    """
    count = readings[Indicator.OBJECT_COUNT]
    location = readings[Indicator.OBJECT_LOCATION]
    best, best_pair, best_assumed = float("nan"), None, False
    for p, (n, d) in enumerate(zip(count.tolist(), location.tolist(), strict=True)):
        if np.isnan(n):
            continue
        assumed = bool(np.isnan(d))
        gap = (1.0 if assumed else d) - n
        if best_pair is None or abs(gap) > abs(best):
            best, best_pair, best_assumed = gap, p, assumed
    return best, best_pair, best_assumed


class _Steadiness:
    """Least and greatest values per second over the last 20 s, and dips of the cross path."""

    def __init__(self, layout: Layout) -> None:
        self.steady = layout.indices(_STEADY)
        self.blocks: deque[tuple[float, Floats, Floats]] = deque()  # start, least, greatest
        self.before: tuple[Floats, Floats] | None = (
            None  # extremes of all blocks when the last began
        )
        self.dips: deque[float] = deque()
        self.down = False

    def update(
        self, t: float, readings: IndicatorReadings, values: dict[Signal, float]
    ) -> dict[Signal, float]:
        """Takes in a cycle's values at `t` s and returns the signals over the last 20 s; nan until known.

        A step back in time, or of more than 2 s, starts anew.
        """
        count = _least(readings[Indicator.OBJECT_COUNT])
        row = np.concatenate([[values[Signal.SAFETY_SCORE], count], readings.values[self.steady]])
        if self.blocks and not 0.0 <= t - self.blocks[-1][0] <= 2.0:
            self.blocks.clear()
            self.dips.clear()
        if not self.blocks or t - self.blocks[-1][0] >= 1.0 - 1e-6:
            self.blocks.append((t, row, row))
            while self.blocks[0][0] < t - STEADY_TIME:
                self.blocks.popleft()
            self.before = (
                np.fmin.reduce([block[1] for block in self.blocks]),
                np.fmax.reduce([block[2] for block in self.blocks]),
            )
        else:
            start, low, high = self.blocks[-1]
            self.blocks[-1] = (start, np.fmin(low, row), np.fmax(high, row))
        self._count_dips(t, values[Signal.CROSS_PATH])
        return self._signals(t)

    def _count_dips(self, t: float, cross_path: float) -> None:
        """Notes a begin of a dip of the cross path at `t` s; drops those older than STEADY_TIME."""
        down = cross_path < 1.0 - DIP
        if down and not self.down:
            self.dips.append(t)
        self.down = down
        while self.dips and self.dips[0] < t - STEADY_TIME:
            self.dips.popleft()

    def _signals(self, t: float) -> dict[Signal, float]:
        """Returns the share of steady indicators, dips and ranges; all nan until nearly 20 s are known."""
        if self.before is None or t - self.blocks[0][0] < STEADY_TIME - 1.5:
            nan = float("nan")
            return {
                Signal.STEADY_SHARE: nan,
                Signal.CROSS_PATH_DIPS: nan,
                Signal.SCORE_RANGE: nan,
                Signal.COUNT_RANGE: nan,
            }
        _, low, high = self.blocks[-1]
        span = np.fmax(high, self.before[1]) - np.fmin(low, self.before[0])
        known = np.isfinite(span[2:])
        steady = (span[2:][known] < STEADY_RANGE).mean() if known.any() else float("nan")
        return {
            Signal.STEADY_SHARE: float(steady),
            Signal.CROSS_PATH_DIPS: float(len(self.dips)),
            Signal.SCORE_RANGE: float(span[0]),
            Signal.COUNT_RANGE: float(span[1]),
        }


def _greatest(values: Floats) -> float:
    """Returns the greatest value that is not nan; nan where there is none."""
    return max((v for v in values.tolist() if v == v), default=float("nan"))  # v == v: not NaN


def _least(values: Floats) -> float:
    """Returns the least value that is not nan; nan where there is none."""
    return min((v for v in values.tolist() if v == v), default=float("nan"))
