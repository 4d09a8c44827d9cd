"""A roll-out by stages with a test that was fixed before the first vehicle drove.

Every drive under an update is judged twice, by what the vehicle had and by the update, so it gives
one difference of errors (false alarms and missed hazards). A look asks two questions by the test of
`evidence.statistics.compare_pairs`: is the update worse, and is it shown to be no worse by more than
the margin. With at most L looks in all and alpha / L for each, the chance of any wrong answer stays
below alpha however often it is looked (Bonferroni).
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from enum import Enum

import msgspec
import numpy as np

from skidpad.core.errors import ConfigError
from skidpad.evidence.statistics import compare_pairs


class Decision(str, Enum):
    """What a look leads to."""

    WAIT = "wait"
    ADVANCE = "advance"
    REVERT = "revert"


class Plan(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Holds the plan of a release, which is fixed with it; ConfigError for one out of range."""

    stages: tuple[float, ...] = (0.1, 0.3, 1.0)  # shares of vehicles
    least_drives: int = 12  # of a stage before it is looked at; assumption
    least_hours: float = 0.0  # of a stage before it is looked at
    looks: int = 2  # at one stage; after the last one without an answer it is reverted
    margin: float = 0.25  # errors per drive by which it may be worse; assumption
    alpha: float = 0.05

    def __post_init__(self) -> None:
        rising = all(a < b for a, b in zip(self.stages, self.stages[1:], strict=False))
        if not self.stages or not rising or not self.stages[0] > 0.0 or self.stages[-1] != 1.0:
            raise ConfigError("plan.stages must rise within (0, 1] and end with 1")
        if not (1 <= self.looks <= 20 and 1 <= self.least_drives <= 10**6):
            raise ConfigError("plan.looks must be 1 to 20 and plan.least_drives 1 to 1000000")
        if not (
            0.0 <= self.margin <= 100.0 and 0.0 < self.alpha <= 0.2 and self.least_hours >= 0.0
        ):
            raise ConfigError("plan.margin must be 0 to 100, plan.alpha within (0, 0.2]")
        if 2.0 ** -min(self.least_drives, 40) > self.alpha_of_look:
            raise ConfigError(
                f"plan.least_drives {self.least_drives} could never decide: the smallest p is "
                f"2^-{self.least_drives}, and a look asks for {self.alpha_of_look:.2g}"
            )

    @property
    def alpha_of_look(self) -> float:
        """Returns the alpha of one question of one look: alpha over all looks at all stages."""
        return self.alpha / (self.looks * len(self.stages))


class Finding(msgspec.Struct, frozen=True):
    """Statistics and decision of one look at a release."""

    decision: Decision
    drives: int
    mean: float  # errors per drive, update less before
    low: float | None  # 95 % interval; None: too few drives for one, or all alike
    high: float | None
    p_worse: float  # against "it is no worse"
    p_no_worse: float  # against "it is worse by the margin or more"
    reason: str


def look(differences: Sequence[float], plan: Plan, looks_left: int) -> Finding:
    """Returns what the differences (errors, update less before) of all drives so far lead to.

    looks_left: at this stage after this one; with 0 left, an undecided release is reverted.
    """
    d = np.asarray(differences, dtype=np.float64)
    seen, shifted = compare_pairs(d), compare_pairs(d - plan.margin)
    if seen.p_greater <= plan.alpha_of_look and seen.mean > 0.0:
        decision, reason = Decision.REVERT, "it is worse"
    elif shifted.p_less <= plan.alpha_of_look:
        decision, reason = Decision.ADVANCE, "it is no worse by the margin"
    elif looks_left <= 0:
        decision, reason = Decision.REVERT, "it could not be shown to be no worse"
    else:
        decision, reason = Decision.WAIT, "undecided"
    low, high = seen.interval or (None, None)
    return Finding(decision, d.size, seen.mean, low, high, seen.p_greater, shifted.p_less, reason)


def choose_vehicles(release: str, vehicles: Iterable[str], share: float) -> frozenset[str]:
    """Returns the vehicles that are among a share, 0 to 1, by a hash: a larger share holds the smaller.

    However small the share, at least one vehicle is; none of no vehicles.
    """
    ranks = {vehicle: _rank(release, vehicle) for vehicle in vehicles}
    first = min(ranks, key=lambda vehicle: ranks[vehicle], default=None)
    return frozenset(v for v, rank in ranks.items() if rank < share * 2.0**64 or v == first)


def _rank(release: str, vehicle: str) -> int:
    """Returns a number that orders vehicles for a release, always the same and as if drawn."""
    word = hashlib.sha256(f"{release}/{vehicle}".encode()).digest()
    return int.from_bytes(word[:8], "big")
