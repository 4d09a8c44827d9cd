"""Speed caps: the limiter and the cap after a stop at a light (A-172 to A-178)."""

from __future__ import annotations

from math import inf

from skidpad.core.run import Function
from skidpad.core.stack_settings import CapScope, ResumeEnd
from skidpad.stack.configurations import Functions
from skidpad.stack.timing import ticks_to_reach

STOPPED_BELOW_KMH = 5.0  # km/h
RESUME_DURATION = 15.0  # s
RESUME_KMH = 80.0  # km/h
CURVE = 1.0 / 500.0  # 1/m, sharper is a curve (A-177; ours, the source gives no figure)


class ResumeProtocol:
    """Counts from the last stop at a light; its end is a time, or the end of the first curve."""

    def __init__(self, dt: float, end: ResumeEnd) -> None:
        self.dt, self.end = dt, end
        self.duration = ticks_to_reach(RESUME_DURATION, dt)
        self.reset()

    def reset(self) -> None:
        """Resets the protocol to no stop and no curve."""
        self.ticks: int | None = None
        self.in_curve = self.past_curve = False

    @property
    def timer(self) -> float | None:
        """Seconds since the last tick at a stop; None: no stop yet, and none after `reset`."""
        return None if self.ticks is None else self.ticks * self.dt

    @property
    def active(self) -> bool:
        """Whether the cap after a stop holds, for a time or until the first curve ends (A-174, A-176)."""
        if self.ticks is None:
            return False
        if self.ticks < self.duration:
            return True
        return self.end is ResumeEnd.FIRST_CURVE and not self.past_curve

    def update(self, stop_requested: bool, v_kmh: float, curvature: float) -> None:
        """Takes in one tick; the count starts anew in each at a requested stop below STOPPED_BELOW_KMH.

        curvature: of the ego's lane in 1/m.
        """
        if stop_requested and v_kmh < STOPPED_BELOW_KMH:
            self.ticks, self.in_curve, self.past_curve = 0, False, False
        elif self.ticks is not None:
            self.ticks += 1
            bends = abs(curvature) > CURVE
            self.past_curve = self.past_curve or (self.in_curve and not bends)
            self.in_curve = bends


class SpeedCaps:
    """The speeds in km/h that cruise aims at and that following may not accelerate beyond."""

    def __init__(
        self, functions: Functions, v_cruise_kmh: float, v_limiter_kmh: float, scope: CapScope
    ) -> None:
        self.limiter = v_limiter_kmh if Function.LIMITER in functions else inf
        self.v_cruise_kmh = min(v_cruise_kmh, self.limiter)
        self.resumes = {Function.TLA, Function.RESUME} <= functions
        self.scope = scope

    def _resume(self, resume_active: bool) -> float:
        """Returns the speed cap in km/h while resuming; inf where there is none."""
        return RESUME_KMH if self.resumes and resume_active else inf

    def cruise_kmh(self, resume_active: bool) -> float:
        """Returns the target in km/h of cruise without a lead (A-135, A-174)."""
        return min(self.v_cruise_kmh, self._resume(resume_active))

    def following_kmh(self, resume_active: bool) -> float:
        """Returns the km/h above which following gives no throttle; inf: no cap (A-129, A-178)."""
        if self.scope is CapScope.CRUISE:
            return inf
        return min(self.limiter, self._resume(resume_active))
