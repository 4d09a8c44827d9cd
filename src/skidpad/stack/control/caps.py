"""Speed caps: the limiter, and the cap after a stop at a light (A-172 to A-178)."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

from skidpad.core.kernels.jit import kernel
from skidpad.core.run import Function
from skidpad.core.settings.stack import CapScope, ResumeEnd, StackSettings
from skidpad.stack.configurations import Functions
from skidpad.stack.memory import Record
from skidpad.stack.timing import ticks_to_reach

STOPPED_BELOW_KMH = 5.0  # km/h
RESUME_DURATION = 15.0  # s
RESUME_KMH = 80.0  # km/h
CURVE = 1.0 / 500.0  # 1/m, sharper is a curve (A-177; ours, the source gives no figure)


class CapRules(NamedTuple):
    """What caps the speed of one stack."""

    cruise_kmh: float  # with the limiter, if that is on
    limiter_kmh: float  # inf: off
    resumes: bool  # there is a cap after a stop at a light
    for_following: bool  # caps hold for following, too
    duration: int  # ticks of the cap after a stop
    until_curve: bool  # it lasts until the first curve ends


def cap_rules(
    functions: Functions, v_cruise_kmh: float, v_limiter_kmh: float, s: StackSettings, dt: float
) -> CapRules:
    """Returns the caps of a set of functions; dt: s, one tick."""
    limiter = v_limiter_kmh if Function.LIMITER in functions else inf
    return CapRules(
        cruise_kmh=min(v_cruise_kmh, limiter),
        limiter_kmh=limiter,
        resumes={Function.TLA, Function.RESUME} <= functions,
        for_following=s.cap_scope is not CapScope.CRUISE,
        duration=ticks_to_reach(RESUME_DURATION, dt),
        until_curve=s.resume_end is ResumeEnd.FIRST_CURVE,
    )


@kernel
def count_resume(m: Record, stopping: bool, v_kmh: float, curvature: float) -> None:
    """Counts the ticks since the last one at a stop below STOPPED_BELOW_KMH (A-173), and notes curves.

    stopping: a light asks for a stop; curvature: of the ego's lane in 1/m.
    """
    if stopping and v_kmh < STOPPED_BELOW_KMH:
        m.resume_ticks, m.in_curve, m.past_curve = 0, False, False
    elif m.resume_ticks >= 0:
        bends = abs(curvature) > CURVE
        m.past_curve = m.past_curve or (m.in_curve and not bends)
        m.in_curve = bends
        m.resume_ticks += 1


@kernel
def caps_kmh(m: Record, rules: CapRules) -> tuple[float, float]:
    """Returns the km/h that cruise aims at, and above which following gives no throttle (A-129, A-135).

    The cap after a stop holds for a time, or until the first curve ends (A-174, A-176). inf: no cap.
    """
    active = m.resume_ticks >= 0 and (
        m.resume_ticks < rules.duration or (rules.until_curve and not m.past_curve)
    )
    resume = RESUME_KMH if rules.resumes and active else inf
    following = min(rules.limiter_kmh, resume) if rules.for_following else inf
    return min(rules.cruise_kmh, resume), following
