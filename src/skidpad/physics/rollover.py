"""Roll-over: when inner wheels leave the road, how a vehicle tips over the outer ones and slides then.

A turn pushes the centre of gravity, h above the road, against the outer wheels, half a track T away. On
stiff springs the inner wheels lift at a = g T/2h, the static stability factor; the body leans outwards by
the roll gradient, which takes h times the lean off the half track: assumption, a roll axis on the road.
Once lifted, the body turns about the outer wheels as a rigid one, with b the half track that is left:
I q'' = m a (h cos q + b sin q) - m g (b cos q - h sin q) (torque: arts.bev.net/roperldavid/torque.xml).
At 90 degrees it has rolled over (Gillespie, 1994, as quoted by softecksblog.in, "Vehicle Rollover"), lies
on its side and slides with the friction of its body. Assumptions: inertia about the roll axis as that of
a full box; load transfer after 80 ms as without roll-over. Sliding: 0.4, between the 0.2 and 0.6 g of a
roll-over on film (SAE 2009-01-0093), and never more than the tyres have.

Valid: untripped roll-over by tyre forces, the first quarter turn. Kerbs, soft ground, impacts and side
wind above the centre of gravity trip no vehicle here, loads do not shift, bodies stay boxes that stand.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.maths.constants import G
from skidpad.physics.antilock import MEMORY as FIRST
from skidpad.physics.types import VehicleType

# Columns of a vehicle's memory
TILT, TILT_RATE, OVER = (
    FIRST,
    FIRST + 1,
    FIRST + 2,
)  # rad, left side up; rad/s; 1: it lies on its side
MEMORY = FIRST + 3

ON_SIDE = 0.5 * pi  # rad
SLIDING = 0.4  # friction of the body on the road
A_LEAN = 1.2 * G  # m/s^2 beyond which springs lean no further: bump stops
GAP = 0.02  # of the half track that is always left


def static_stability(kind: VehicleType) -> float:
    """Returns T/2h, which NHTSA rates as the static stability factor."""
    return 0.5 * kind.track / kind.cog_height


def rollover_threshold(kind: VehicleType) -> float:
    """Returns the steady lateral acceleration over g at which the inner wheels lift, springs included."""
    return static_stability(kind) / (1.0 + kind.roll_gradient * G)


def roll_inertias(types: Sequence[VehicleType]) -> Floats:
    """Returns (n,): inertia about the outer wheels over the mass, m^2."""
    box = [(t.width**2 + t.height**2) / 12.0 for t in types]
    arm = [0.25 * t.track**2 + t.cog_height**2 for t in types]
    return np.array(box, dtype=np.float64) + np.array(arm, dtype=np.float64)


@inner_kernel
def left_arm(half_track: float, cog_height: float, roll_gradient: float, a_y: float) -> float:
    """Returns the half track in m that the leaning body leaves at a_y in m/s^2; GAP of it at least."""
    lean = roll_gradient * min(abs(a_y), A_LEAN)
    return max(half_track - cog_height * lean, GAP * half_track)


@inner_kernel
def tip(
    m: Floats, a_y: float, down: float, arm: float, height: float, inertia: float, h: float
) -> None:
    """Moves the body's turn about its outer wheels on by h seconds, in the memory `m`.

    Sets OVER at 90 degrees. Nothing changes while all wheels are down and the turn does not lift one.
    a_y: lateral acceleration by the tyres, left positive. down: of the road on the body, both m/s^2.
    arm, height: m of the centre of gravity from the outer wheels. inertia: over the mass, m^2.
    """
    tilt, rate = m[TILT], m[TILT_RATE]
    side = 1.0 if (tilt if tilt != 0.0 else a_y) >= 0.0 else -1.0
    angle = abs(tilt)
    c, s = cos(angle), sin(angle)
    turn = side * a_y * (height * c + arm * s) - down * (arm * c - height * s)
    if angle == 0.0 and turn <= 0.0:
        return
    rate = side * rate + h * turn / inertia
    angle += h * rate
    if angle <= 0.0:  # back on its wheels, which take up the blow
        angle = rate = 0.0
    elif angle >= ON_SIDE:
        angle, rate, m[OVER] = ON_SIDE, 0.0, 1.0
    m[TILT], m[TILT_RATE] = side * angle, side * rate
