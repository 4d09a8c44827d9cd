"""How near one may follow: the safe distance of RSS (Shalev-Shwartz et al. 2017, definition 1)."""

from __future__ import annotations

from dataclasses import dataclass

from skidpad.core.errors import require_range
from skidpad.core.maths.constants import G

GRIPS = (0.05, 1.5)  # between wet ice and racing tyres
NOMINAL_GRIP = 0.9  # of a dry road (`mu_ref` of decision M-1)
HARD_BRAKING = 6.0  # m/s^2 of the leader, decision C-3


@dataclass(frozen=True, slots=True, kw_only=True)
class SafeDistance:
    """What is assumed of both; the follower reacts, then brakes, the leader brakes at once.

    RSS asks for the follower's least and the leader's hardest braking. As a rule about hazards, not
    about proper response, both get what decision C-3 calls dangerous, on a dry road: rules do not
    know the grip, unless they are told (`on`).
    """

    response: float = 1.0  # s
    a_response: float = 0.0  # m/s^2 of the follower while it reacts: it keeps its speed
    b_follower: float = NOMINAL_GRIP * G  # m/s^2, all grip
    b_leader: float = HARD_BRAKING  # m/s^2

    @classmethod
    def on(cls, grip: float) -> SafeDistance:
        """Returns distances with one coefficient of friction for both; ConfigError out of range."""
        require_range("grip", grip, *GRIPS)
        return cls(b_follower=grip * G, b_leader=min(HARD_BRAKING, grip * G))

    def of(self, v_follower: float, v_leader: float) -> float:
        """Returns the least gap in m that keeps the follower from hitting, speeds in m/s.

        RSS compares where both stand; a follower that brakes harder than its leader may come
        nearest before, when both are equally fast.
        """
        rho = self.response
        v = v_follower + self.a_response * rho
        reacting = v_follower * rho + 0.5 * self.a_response * rho * rho
        at_rest = (
            reacting + v * v / (2.0 * self.b_follower) - v_leader * v_leader / (2.0 * self.b_leader)
        )
        nearest = max(at_rest, 0.0)
        if self.b_follower > self.b_leader:
            t = (v + self.b_follower * rho - v_leader) / (self.b_follower - self.b_leader)
            if rho <= t <= v_leader / self.b_leader and v >= self.b_follower * (t - rho):
                braked = t - rho
                follower = reacting + v * braked - 0.5 * self.b_follower * braked * braked
                leader = v_leader * t - 0.5 * self.b_leader * t * t
                nearest = max(nearest, follower - leader)
        return nearest
