"""The tier as text for people, made at the edge (A-139). Nothing decides by it."""

from __future__ import annotations

from skidpad.core.states import StackReport
from skidpad.core.vocabulary import Tier

LABELS = {tier: tier.name.replace("_", " ") for tier in Tier} | {
    Tier.NONE: "NO ACTION",
    Tier.COAST: "CRUISE (COAST)",
}
BY_GAP = frozenset({Tier.EMERGENCY, Tier.ACC_HOLD, Tier.ACC_OPEN, Tier.ACC_CLOSE})
BY_DISTANCE = frozenset({Tier.HARD_STOP, Tier.STOPPED_TOO_CLOSE, Tier.STOPPED_BEHIND_CAR})
BY_LIGHT = frozenset({Tier.APPROACH, Tier.LIGHT_STOP, Tier.HOLDING_AT_LINE})


def mode_text(report: StackReport, lca_on: bool, verified_by: str = "") -> str:
    """Writes the mode in words, for example `ACC CLOSE 1.9 s [LCA on]`.

    verified_by: the camera pair that confirmed a target at standstill, shown in brackets.
    """
    tier = report.tier if report.tier is not None else Tier.NONE
    parts = [LABELS[tier]]
    if tier is Tier.STOPPED_TOO_CLOSE and verified_by:
        parts.append(f"({verified_by})")
    if tier in BY_GAP and report.time_gap is not None:
        parts.append(f"{report.time_gap:.1f} s")
    if tier in BY_DISTANCE and report.distance is not None:
        parts.append(f"{report.distance:.1f} m")
    if tier in BY_LIGHT and report.light_distance is not None:
        parts.append(f"{report.light_distance:.1f} m")
    parts.append(f"[LCA {'on' if lca_on else 'off'}]")
    return " ".join(parts)
