"""The safety case with the fleet's current evidence for and against each claim (C-033, C-195)."""

from __future__ import annotations

from dataclasses import dataclass

from skidpad.evidence.channels.indicators.catalogue import safety_case
from skidpad.evidence.statistics import Interval
from skidpad.fleet.insight.trends import Trend

SUPPORTED_BELOW = 0.01  # share of cycles in violation; assumption


@dataclass(frozen=True, slots=True)
class Claim:
    """A statement of the safety case and what speaks for it."""

    id: str
    argument: str
    claim: str
    verdict: str  # no evidence, supported, challenged, open
    indicators: tuple[str, ...]
    share: float | None  # of cycles in violation, worst indicator
    interval: Interval | None
    vehicles: int


def claims(trends: list[Trend]) -> list[Claim]:
    """Returns every statement of the safety case with its worst indicator, each in its newest stretch."""
    newest: dict[str, Trend] = {}
    for trend in trends:
        if trend.indicator not in newest or trend.at >= newest[trend.indicator].at:
            newest[trend.indicator] = trend
    out = []
    for argument in safety_case().arguments:
        for statement in argument.statements:
            names = tuple(i.value for i in statement.indicators)
            known = [newest[name] for name in names if name in newest]
            worst = max(known, key=lambda t: (t.share, t.indicator), default=None)
            out.append(
                Claim(
                    statement.id, argument.claim, statement.claim, _verdict(worst), names,
                    None if worst is None else worst.share,
                    None if worst is None else worst.interval,
                    0 if worst is None else worst.vehicles,
                )
            )  # fmt: skip
    return out


def _verdict(worst: Trend | None) -> str:
    """Returns "no evidence", "supported", "challenged" or "open", by the interval of the share violated.

    Supported takes all of it at most SUPPORTED_BELOW and 10 vehicles; challenged all of it above.
    """
    if worst is None:
        return "no evidence"
    if worst.interval.high <= SUPPORTED_BELOW and worst.vehicles >= 10:
        return "supported"
    return "challenged" if worst.interval.low > SUPPORTED_BELOW else "open"
