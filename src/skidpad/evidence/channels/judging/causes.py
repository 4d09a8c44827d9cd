"""Why a detection was false or a hazard missed, told from signals and motion (C-215, CF-05)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.channels import Cycle
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.hazards import Rule, Signal
from skidpad.evidence.channels.matching import Span, match

REACH = 1.0  # s around a hazard that is looked at
V_STANDING = 2.0  # m/s
YAW_RATE_TURN = 0.12  # rad/s, 7 m/s on a radius of 58 m
SIGNALS = {
    Signal.GAP: "the channels' objects agreed",
    Signal.GAP_SIGNED: "the channels' objects agreed",
    Signal.SAFETY_SCORE: "no conflict predicted",
    Signal.TTC_AHEAD: "no collision predicted",
    Signal.TTC_BEHIND: "no collision predicted",
    Signal.RISK_AHEAD_LEAD: "the larger risk was on the other side",
    Signal.COMFORT_LEAST: "comfort outside the rule's range",
    Signal.COMFORT_DRIVING: "comfort outside the rule's range",
    Signal.LOCATION_VARIANCE: "positions moved apart too slowly",
    Signal.EGO_LOCATION: "positions were near each other",
    Signal.SHIFT_SHORT: "positions moved apart too slowly",
    Signal.SHIFT_LONG: "positions moved apart too little",
}


class FalseCause(str, Enum):
    """What was going on at a false alarm."""

    OTHER_TRUTH = "true in the other world"
    OTHER_HAZARD = "another hazard was true"
    STANDING = "ego standing or nearly so"
    TURN = "ego turning"
    BESIDES = "an object that conflicts, and no hazard by definition"
    UNEXPLAINED = "unexplained"


EXPLAINED = (FalseCause.STANDING, FalseCause.TURN, FalseCause.BESIDES)  # those named by the sources


def false_cause(
    found: Span,
    true: Sequence[Span],
    other: Sequence[Span],
    motion: Mapping[str, Floats],
    safety: Floats,
) -> FalseCause:
    """Returns the first cause, in the order of FalseCause, that applies within REACH s of a false alarm.

    true: hazards of the truth it is judged by; other: those of the other truth. motion: t in s, v and
    yaw_rate (k,) of the ego; safety: score (k,), below 0.8 a conflict.
    """
    if any(s.hazard is found.hazard and _near(s, found) for s in other):
        return FalseCause.OTHER_TRUTH
    if any(s.hazard is not found.hazard and _near(s, found) for s in true):
        return FalseCause.OTHER_HAZARD
    at = (motion["t"] >= found.t_start - REACH) & (motion["t"] <= found.t_end + REACH)
    if at.any() and np.nanmin(motion["v"][at]) < V_STANDING:
        return FalseCause.STANDING
    if at.any() and np.nanmax(np.abs(motion["yaw_rate"][at])) > YAW_RATE_TURN:
        return FalseCause.TURN
    if at.any() and np.isfinite(safety[at]).any() and np.nanmin(safety[at]) < 0.8:
        return FalseCause.BESIDES
    return FalseCause.UNEXPLAINED


def missed_cause(
    missed: Span, rule: Rule, signals: Sequence[tuple[float, dict[Signal, float]]]
) -> str:
    """Returns what the clause lacked that held in the fewest cycles within REACH s of a missed hazard.

    signals: time in s and values of each cycle. When all clauses held it says "never together".
    """
    near = [v for t, v in signals if missed.t_start - REACH <= t <= missed.t_end + REACH]
    if not near:
        return "no cycle was recorded"
    fewest: tuple[int, str] | None = None
    for clauses in rule.alternatives:
        for clause in clauses:
            held = sum(clause.holds(values) is True for values in near)
            unknown = all(clause.holds(values) is None for values in near)
            text = "not evaluated" if unknown else SIGNALS.get(clause.signal, clause.signal.value)
            if fewest is None or held < fewest[0]:
                fewest = held, text
    assert fewest is not None
    return fewest[1] if fewest[0] < len(near) else "clauses held, never together"


@dataclass(frozen=True, slots=True)
class Mistake:
    """A false alarm or a missed hazard, and why."""

    identifier: str
    truth: str
    hazard: HazardType
    missed: bool  # else false
    t_start: float
    t_end: float
    cause: str


NO_RULE = "probability below its limit"
OTHER = {"sim": "world", "world": "sim"}


def moments(cycles: Sequence[Cycle], safety: Sequence[float]) -> Floats:
    """Returns (k, 3): speed in m/s and yaw rate in rad/s of the ego, and the least safety score per cycle."""
    motion = ego_motion(cycles)
    out: Floats = np.column_stack([motion["v"], motion["yaw_rate"], np.array(safety, np.float64)])
    return out


def mistakes(
    detected: Mapping[str, Sequence[Span]],
    truths: Mapping[str, Sequence[Span]],
    t: Floats,
    motion: Floats,
    why_missed: Callable[[str, Span], str],
) -> Iterator[Mistake]:
    """Yields every surplus detection and every missed hazard with its cause.

    detected: spans by identifier; t: (k,) s; motion: of `moments`; why_missed: called with an
    identifier and a missed span, returns the cause.
    """
    moving = {"t": t, "v": motion[:, 0], "yaw_rate": motion[:, 1]}
    for identifier, spans in detected.items():
        for truth, true in truths.items():
            other = truths.get(OTHER.get(truth, ""), ())
            matching = match(spans, true)
            for i in matching.false_alarms:
                s = spans[i]
                cause = false_cause(s, true, other, moving, motion[:, 2]).value
                yield Mistake(identifier, truth, s.hazard, False, s.t_start, s.t_end, cause)
            for i in matching.missed:
                s, cause = true[i], why_missed(identifier, true[i])
                yield Mistake(identifier, truth, s.hazard, True, s.t_start, s.t_end, cause)


def ego_motion(cycles: Sequence[Cycle]) -> dict[str, Floats]:
    """Returns t in s, v in m/s and yaw_rate in rad/s (k,) of the first channel with a finite pose.

    NaN where no channel has one; the yaw rate, over ten cycles, is 0 in the first and last five.
    """
    t = np.array([c.t for c in cycles])
    egos = np.full((len(cycles), 5), np.nan)
    for k, cycle in enumerate(cycles):
        frame = next((f for f in cycle.frames if f is not None and np.isfinite(f.ego).all()), None)
        if frame is not None:
            egos[k] = frame.ego
    heading = egos[:, 2]
    turned = np.zeros(len(cycles))
    if len(cycles) > 10:
        change = heading[10:] - heading[:-10]
        turned[5:-5] = (change + np.pi) % (2.0 * np.pi) - np.pi
        turned[5:-5] /= t[10:] - t[:-10]
    return {"t": t, "v": np.hypot(egos[:, 3], egos[:, 4]), "yaw_rate": turned}


def _near(a: Span, b: Span) -> bool:
    """Returns True when two spans are at most REACH s apart."""
    return a.t_start <= b.t_end + REACH and b.t_start <= a.t_end + REACH
