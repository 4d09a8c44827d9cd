"""The indicators by name, their thresholds and the safety case, read from data (C-030 to C-036).

Every threshold is configuration (C-103): `load_thresholds` takes a file of the user's own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import msgspec

from skidpad.core.errors import ConfigError
from skidpad.core.files.reading import decode_yaml, read_bytes
from skidpad.core.objects.registry import Registry


class Scope(str, Enum):
    """What an indicator is about (C-036)."""

    CHANNEL = "channel"
    PAIR = "pair"


class Category(str, Enum):
    """Groups of indicators (C-035), and two that are not indicators of the safety case."""

    COMFORT = "comfort"
    SIMILARITY = "similarity"
    MOTION_PREDICTION = "motion_prediction"
    RISK = "risk"
    CONFIDENCE = "confidence"


class Bound(str, Enum):
    """The side of its threshold on which an indicator raises an alarm."""

    LOWER = "lower"
    UPPER = "upper"
    NONE = "none"


class Indicator(str, Enum):
    """Everything that is computed per cycle; the value is its name in recordings."""

    HISTORY_COMFORT = "history_comfort"
    PLANNED_PATH_COMFORT = "planned_path_comfort"
    MOTION_VALIDATION = "object_motion_prediction_validation"
    CHANNEL_PATH = "channel_planned_path_similarity"
    CHANNEL_PATH_VARIANCE = "channel_planned_path_variance"
    OBJECTS_LEFT = "objects_left"
    SAFETY_SCORE = "safety_score"
    RISK_BEHIND_SHARE = "risk_behind_share"
    EGO_LOCATION = "ego_location_similarity"
    EGO_LOCATION_VARIANCE = "ego_location_variance"
    EGO_SHIFT_SHORT = "ego_shift_short"
    EGO_SHIFT_LONG = "ego_shift_long"
    EGO_ORIENTATION = "ego_orientation_similarity"
    OBJECT_COUNT = "object_count_similarity"
    OBJECT_LOCATION = "object_location_similarity"
    OBJECT_ORIENTATION = "object_orientation_similarity"
    OBJECT_AREA = "object_area_similarity"
    CLASS_AGREEMENT = "object_class_agreement"
    OBJECT_TRAJECTORY = "object_trajectory_similarity"
    EGO_TRAJECTORY = "ego_trajectory_similarity"
    CROSS_PATH = "cross_channel_planned_path_similarity"
    CROSS_PATH_VARIANCE = "cross_channel_planned_path_variance"
    AGREEMENT = "channel_agreement"


class AddedName(str):
    """The name of an indicator that a package added; `value` is its name in recordings."""

    __slots__ = ()

    @property
    def value(self) -> str:
        """The name in recordings, as of an `Indicator`."""
        return str(self)


AnyIndicator = Indicator | AddedName


class Threshold(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One indicator's bound and what a violation means."""

    label: str  # abbreviation of the source
    scope: Scope
    category: Category
    bound: Bound
    meaning: str
    claim: str | None = None  # statement of the safety case
    threshold: float | None = None
    reporting_only: bool = False

    def __post_init__(self) -> None:
        if (self.threshold is None) != (self.bound is Bound.NONE):
            raise ValueError("a threshold goes with the bound lower or upper, and with no other")


def built_in_thresholds() -> dict[Indicator, Threshold]:
    """Returns the bounds of Skidpad's own indicators, in the order of their table."""
    return dict(_own_thresholds())


def load_thresholds(path: Path | None = None) -> dict[AnyIndicator, Threshold]:
    """Returns the bounds of all indicators: the built-in ones, changed by the file at `path`.

    An indicator that the file does not name keeps its built-in bound, so files that are older than
    an indicator can still be used. ConfigError for a name that no indicator has.
    """
    table: dict[AnyIndicator, Threshold] = dict(_own_thresholds().items())
    table |= {added.key: added.default_threshold() for added in INDICATORS.foreign_entries()}
    if path is not None:
        given = decode_yaml(read_bytes(path, "thresholds"), str(path), dict[str, Threshold])
        known = {indicator.value: indicator for indicator in table}
        for name, threshold in given.items():
            if name not in known:
                raise ConfigError(
                    f"{path}: unknown indicator {name!r}; choose of: {', '.join(known)}"
                )
            table[known[name]] = threshold
    return table


@cache
def _own_thresholds() -> dict[Indicator, Threshold]:
    """Returns the built-in threshold of each indicator."""
    data = _built_in("thresholds.yaml")
    table: dict[Indicator, Threshold] = decode_yaml(
        data, "thresholds.yaml", dict[Indicator, Threshold]
    )
    return table


@dataclass(frozen=True, slots=True)
class IndicatorType:
    """An indicator of the monitor.

    Attributes:
        name: Its name in recordings; the name of the entry point.
        title: A few words for tables.
        units: The unit of its value.
        scope: CHANNEL for a value per channel, PAIR for one per pair of channels.
        meaning: What a violation points at.
        bound: The side of the threshold on which it raises an alarm.
        threshold: The bound itself; None with Bound.NONE.
        factory: `factory()` is called once per channel or pair and returns a function, which is
            called with a ChannelFrame, or with those of both channels, in every cycle in which
            they have one. It returns the value, or NaN where it cannot be evaluated. None: the
            indicator is computed by Skidpad itself.
        category: The group of the indicator.
    """

    name: str
    title: str
    units: str
    scope: Scope
    meaning: str
    bound: Bound = Bound.NONE
    threshold: float | None = None
    factory: Callable[[], Callable[..., float]] | None = None
    category: Category = Category.SIMILARITY

    @property
    def key(self) -> AddedName:
        """Returns the name as thresholds and layouts use it."""
        return AddedName(self.name)

    def default_threshold(self) -> Threshold:
        """Returns what a file of thresholds says of it when it does not name it."""
        return Threshold(
            label=self.title,
            scope=self.scope,
            category=self.category,
            bound=self.bound,
            meaning=self.meaning,
            threshold=self.threshold,
        )

    def make(self) -> Callable[..., Any]:
        """Returns a new function for the value of one channel or pair; only for a package's indicator."""
        assert self.factory is not None, "Skidpad computes its own indicators"
        return self.factory()


def _own_types() -> tuple[IndicatorType, ...]:
    """Returns the built-in indicators as entries of the registry, in the order of Indicator."""
    table = built_in_thresholds()
    return tuple(
        IndicatorType(
            i.value, t.label, "", t.scope, t.meaning, t.bound, t.threshold, None, t.category
        )
        for i in Indicator
        for t in [table[i]]
    )


INDICATORS = Registry("indicator", "skidpad.indicators", IndicatorType, _own_types)


class Statement(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A claim of the safety case and the indicators that support it."""

    id: str
    claim: str
    indicators: tuple[Indicator, ...]


class Argument(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One of the four arguments below the goal."""

    id: str
    claim: str
    statements: tuple[Statement, ...]


class SafetyCase(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Goal, arguments, statements, indicators (C-033)."""

    goal: str
    arguments: tuple[Argument, ...]


@cache
def safety_case() -> SafetyCase:
    """Returns the safety case that comes with Skidpad, read once from its file."""
    return msgspec.yaml.decode(_built_in("safety_case.yaml"), type=SafetyCase)


def _built_in(name: str) -> bytes:
    """Returns the bytes of a file beside this module."""
    return files("skidpad.evidence.channels.indicators").joinpath(name).read_bytes()


def _of_scope(scope: Scope) -> tuple[Indicator, ...]:
    """Returns the built-in indicators of a scope, in the order of the file."""
    return tuple(i for i, threshold in _own_thresholds().items() if threshold.scope is scope)


CHANNEL_INDICATORS = _of_scope(Scope.CHANNEL)  # in the order of thresholds.yaml
PAIR_INDICATORS = _of_scope(Scope.PAIR)
