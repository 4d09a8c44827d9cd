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
from skidpad.env.observation import Lead
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


def check_weights(given: Mapping[str, float]) -> dict[str, float]:
    """Returns weights by term; ConfigError for a term that does not exist."""
    for name in given:
        if name not in WEIGHTS:
            raise ConfigError(f"rewards: unknown term {name!r}; there are {', '.join(WEIGHTS)}")
    return dict(given)


def terms_of(
    truth: WorldTruth, lead: Lead | None, reason: RelocationReason | None, dt: float
) -> dict[str, float]:
    """Returns what a tick adds to each metric. reason: why the supervisor ends the drive in it."""
    states = truth.states
    v = hypot(float(states.vx[0]), float(states.vy[0]))
    critical = lead is not None and lead.gap < TTC_CRITICAL * lead.closing_speed
    return {
        "distance_km": v * dt / 1000.0,
        "contacts": float(len(truth.contacts)),
        "off_road": float(reason in OFF_ROAD),
        "wrong_way": float(reason is RelocationReason.WRONG_WAY),
        "stuck_relocations": float(reason is RelocationReason.STUCK),
        "ttc_below_1_5_s": dt if critical else 0.0,
    }
