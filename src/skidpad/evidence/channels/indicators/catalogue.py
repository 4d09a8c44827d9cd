"""The indicators by name, their thresholds and the safety case, read from data (C-030 to C-036).

Every threshold is configuration (C-103): `load_thresholds` takes a file of the user's own.
"""

from __future__ import annotations

from enum import Enum
from functools import cache
from importlib.resources import files
from pathlib import Path

import msgspec

from skidpad.core.errors import ConfigError
from skidpad.core.reading import decode_yaml, read_bytes


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
    """On which side of its threshold an indicator raises an alarm."""

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


CHANNEL_INDICATORS = tuple(Indicator)[:8]
PAIR_INDICATORS = tuple(Indicator)[8:]


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

    def violated(self, value: float) -> bool:
        """Whether an evaluated `value` raises an alarm; equality passes (C-101)."""
        if self.threshold is None:
            return False
        return value < self.threshold if self.bound is Bound.LOWER else value > self.threshold


def load_thresholds(path: Path | None = None) -> dict[Indicator, Threshold]:
    """Thresholds of all indicators: the built-in ones, or those of the file at `path`."""
    if path is None:
        return dict(_own_thresholds())
    return _thresholds(read_bytes(path, "thresholds"), str(path))


@cache
def _own_thresholds() -> dict[Indicator, Threshold]:
    return _thresholds(_built_in("thresholds.yaml"), "thresholds.yaml")


def _thresholds(data: bytes, name: str) -> dict[Indicator, Threshold]:
    table: dict[Indicator, Threshold] = decode_yaml(data, name, dict[Indicator, Threshold])
    missing = [i.value for i in Indicator if i not in table]
    if missing:
        raise ConfigError(f"{name}: no entry for {', '.join(missing)}")
    return table


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
    """The tree of C-030 and C-031, with the homes of indicators settled as in DC-28."""
    return msgspec.yaml.decode(_built_in("safety_case.yaml"), type=SafetyCase)


def _built_in(name: str) -> bytes:
    return files("skidpad.evidence.channels.indicators").joinpath(name).read_bytes()
