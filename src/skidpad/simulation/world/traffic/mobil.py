"""MOBIL: whether a lane change is safe and worth it for all concerned.

Source: Kesting, Treiber, Helbing (2007), General lane-changing model MOBIL for car-following
models, eqs. 2 and 4, symmetric rules; politeness and threshold from their table 1.
"""

from __future__ import annotations

from skidpad.core.jit import kernel

POLITENESS = 0.3
A_THRESHOLD = 0.1  # m/s^2
B_SAFE = 2.0  # m/s^2, the hardest braking imposed on the new follower; theirs is 4
GAP_CLEAR = 4.0  # m to leader and follower on the new lane, whatever the speeds
# Naturalistic driving: 0.36 lane changes per mile (Lee, Olsen, Wierwille 2004, DOT HS 809 702),
# at 25 m/s 0.0056 /s; the share for which MOBIL sees no reason (turn-offs, habit) is drawn.
RANDOM_RATE = 0.004  # 1/s


@kernel
def is_safe(a_self: float, a_new_follower: float, gap_ahead: float, gap_behind: float) -> bool:
    """Nobody has to brake hard, and there is room."""
    return (
        gap_ahead > GAP_CLEAR
        and gap_behind > GAP_CLEAR
        and a_new_follower > -B_SAFE
        and a_self > -B_SAFE
    )


@kernel
def incentive(a_gain: float, a_gain_new_follower: float, a_gain_old_follower: float) -> float:
    """Advantage in m/s^2, others' counted with politeness; worth it above A_THRESHOLD."""
    return a_gain + POLITENESS * (a_gain_new_follower + a_gain_old_follower)
