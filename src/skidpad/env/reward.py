"""Rewards: weighted terms that are named and counted as the project's metrics are.

Each term is what one tick adds to the metric of that name; their sums over an episode stand in the
info of its last step.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot

from skidpad.core.errors import ConfigError
from skidpad.core.states import WorldTruth
from skidpad.core.vocabulary import RelocationReason
from skidpad.env.observation import CLOSING, GAP, Observations
from skidpad.evidence.drive.conflict import TTC_CRITICAL

OFF_ROAD = (RelocationReason.OFF_ROAD, RelocationReason.ROLL_OVER)
WEIGHTS: Mapping[str, float] = {
    "distance_km": 1.0,
    "contacts": -1.0,
    "off_road": -1.0,
    "wrong_way": -1.0,
    "stuck_relocations": -1.0,
    "ttc_below_1_5_s": -0.1,
}
TERMS = tuple(WEIGHTS)  # columns of every array of terms
DISTANCE, CONTACTS, OFF, WRONG_WAY, STUCK, CRITICAL = range(len(TERMS))


def weigh(given: Mapping[str, float]) -> dict[int, float]:
    """Returns weights by the index of a term; ConfigError for a term that does not exist."""
    for name in given:
        if name not in WEIGHTS:
            raise ConfigError(f"rewards: unknown term {name!r}; there are {', '.join(WEIGHTS)}")
    return {TERMS.index(name): weight for name, weight in given.items()}


def terms_of(
    truth: WorldTruth, observed: Observations, reason: RelocationReason | None, dt: float
) -> list[float]:
    """Returns what a tick adds to each of TERMS for the ego.

    observed: by the ego, (12,). reason: why the supervisor ends the drive in it.
    """
    states = truth.states
    v = hypot(float(states.vx[0]), float(states.vy[0]))
    return [
        v * dt / 1000.0,
        float(len(truth.contacts)),
        float(reason in OFF_ROAD),
        float(reason is RelocationReason.WRONG_WAY),
        float(reason is RelocationReason.STUCK),
        dt if observed[GAP] < TTC_CRITICAL * observed[CLOSING] else 0.0,
    ]
