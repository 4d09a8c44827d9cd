"""MOBIL: whether a lane change is safe and worth it for all concerned.

Source: Kesting, Treiber, Helbing (2007), General lane-changing model MOBIL for car-following
models, eqs. 2 and 4, symmetric rules; politeness from their table 1.
"""

from __future__ import annotations

from skidpad.core.kernels.jit import kernel

POLITENESS = 0.3
B_SAFE = 2.0  # m/s^2, the hardest braking imposed on the new follower; theirs is 4
GAP_CLEAR = 4.0  # m to leader and, by most, follower on the new lane, whatever the speeds


@kernel
def is_safe(
    a_self: float,
    a_new_follower: float,
    gap_ahead: float,
    gap_behind: float,
    b_safe: float,
    room: float,
) -> bool:
    """Returns whether neither has to brake harder than b_safe in m/s^2, and there is room.

    room: m to be free behind; ahead it is GAP_CLEAR. Accelerations in m/s^2, gaps in m.
    """
    return (
        gap_ahead > GAP_CLEAR
        and gap_behind > room
        and a_new_follower > -b_safe
        and a_self > -b_safe
    )


@kernel
def incentive(a_gain: float, a_gain_new_follower: float, a_gain_old_follower: float) -> float:
    """Returns the advantage in m/s^2, others' counted with politeness; worth it above `Care.a_change`."""
    return a_gain + POLITENESS * (a_gain_new_follower + a_gain_old_follower)
