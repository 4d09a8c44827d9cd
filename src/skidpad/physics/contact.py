"""Contacts: oriented boxes against each other and against static segments, with impulses.

Rigid bodies in the plane that share an impulse at the middle of their overlap; height decides who
can meet at all (decision M-12). Which contacts began in a tick is the engine's business.
The impulse law is planar impact mechanics, as books on accident reconstruction have it (Brach and
Brach, 2005, named but not read); it follows from momentum, restitution and friction alone.
"""

from __future__ import annotations

from math import cos, exp, sin, sqrt
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Ints
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.states import ActorStates
from skidpad.physics.overlap import Boxes, box_box, box_segment, clipped_length, corners_room
from skidpad.physics.segments import STRAIGHT, Segments, candidates

NEAR = 64  # segments in reach of one actor at most
PASSES = 2  # over all contacts, so that a car squeezed between two feels both
Z_OVERLAP = 0.2  # m of shared height below which bodies pass over each other
DEPTH_KEPT = 0.01  # m of overlap left standing, so that resting contacts do not flicker


class ContactLaw(NamedTuple):
    """Restitution e = e_fast + e_slow exp(-v / v_scale), and Coulomb friction.

    e_fast 0.1 and friction 0.6: defaults of a reconstruction program, Steffan and Moser, SAE 960886
    (1996). e_slow, v_scale: trend of bumper tests, Antonetti, SAE 980552 (1998). Friction along
    barriers: our assumption, steel on paint.
    """

    e_fast: float = 0.1
    e_slow: float = 0.3
    v_scale: float = 2.0  # m/s
    friction_vehicle: float = 0.6
    friction_static: float = 0.3


CONTACT_LAW = ContactLaw()


class Bodies(NamedTuple):
    """n actors as rigid bodies, arrays of shape (n,). An inverse mass of 0 cannot be moved."""

    half_length: Floats
    half_width: Floats
    height: Floats
    inverse_mass: Floats  # 1/kg
    inverse_inertia: Floats  # 1/(kg m^2), about the centre of gravity
    x_cog: Floats  # m ahead of the footprint's centre


class Contacts(NamedTuple):
    """Room for the contacts of one tick; the first `count` rows are valid."""

    i: Ints
    j: Ints  # the other actor; -1: static
    segment: Ints  # index of the static segment; -1: an actor
    x: Floats  # point in the world
    y: Floats
    nx: Floats  # unit normal, pushes actor i
    ny: Floats
    depth: Floats  # m of overlap found
    length: Floats  # m of a static segment inside the body
    impulse: Floats  # N s along the normal, >= 0
    v_closing: Floats  # m/s before the impulse, positive when closing
    near: Ints  # (NEAR,) scratch: segments in reach of one actor
    corners: Floats  # scratch of `Boxes`

    @classmethod
    def room(cls, capacity: int = 512) -> Contacts:
        """Returns empty arrays for up to `capacity` contacts."""
        ints = [np.full(capacity, -1, dtype=np.int64) for _ in range(3)]
        near = np.empty(NEAR, dtype=np.int64)
        return cls._make([*ints, *np.zeros((8, capacity)), near, corners_room()])


def bodies(
    length: Floats, width: Floats, height: Floats, mass: Floats, yaw_inertia: Floats, x_cog: Floats
) -> Bodies:
    """Returns bodies from sizes (m), masses (kg; inf cannot be moved) and yaw inertias (kg m^2), each (n,).

    x_cog: m of the centre of gravity ahead of the footprint's centre.
    """
    return Bodies(
        0.5 * length, 0.5 * width, height.copy(), 1.0 / mass, 1.0 / yaw_inertia, x_cog.copy()
    )


@inner_kernel
def _restitution(law: ContactLaw, v: float) -> float:
    """Returns the coefficient of restitution at a closing speed v in m/s."""
    return law.e_fast + law.e_slow * exp(-v / law.v_scale)


@inner_kernel
def _point_velocity(states: ActorStates, i: int, x: float, y: float) -> tuple[float, float]:
    """Returns the velocity in m/s of actor i's body at a world point."""
    r = states.yaw_rate[i]
    return states.vx[i] - r * (y - states.y[i]), states.vy[i] + r * (x - states.x[i])


@inner_kernel
def _arm(states: ActorStates, b: Bodies, i: int, x: float, y: float) -> tuple[float, float]:
    """Returns the vector in m from actor i's centre of gravity to a world point."""
    x_cog = b.x_cog[i]
    return (
        x - states.x[i] - x_cog * cos(states.yaw[i]),
        y - states.y[i] - x_cog * sin(states.yaw[i]),
    )


@inner_kernel
def _push(states: ActorStates, b: Bodies, i: int, x: float, y: float, jx: float, jy: float) -> None:
    """Changes velocity and yaw rate of actor i by an impulse (jx, jy) in N s at a world point.

    The velocity in `states` is that of the footprint's centre.
    """
    arm_x, arm_y = _arm(states, b, i, x, y)
    d_r = (arm_x * jy - arm_y * jx) * b.inverse_inertia[i]
    states.vx[i] += jx * b.inverse_mass[i] + d_r * b.x_cog[i] * sin(states.yaw[i])
    states.vy[i] += jy * b.inverse_mass[i] - d_r * b.x_cog[i] * cos(states.yaw[i])
    states.yaw_rate[i] += d_r


@inner_kernel
def _yielding(
    states: ActorStates, b: Bodies, i: int, x: float, y: float, nx: float, ny: float
) -> float:
    """Returns the velocity that a unit impulse along (nx, ny) at the point gives that point, 1/kg."""
    arm_x, arm_y = _arm(states, b, i, x, y)
    cross = arm_x * ny - arm_y * nx
    return float(b.inverse_mass[i] + cross * cross * b.inverse_inertia[i])


@inner_kernel
def _exchange(states: ActorStates, b: Bodies, c: Contacts, k: int, law: ContactLaw) -> float:
    """Applies the impulse of contact k and returns its closing speed before; none where it does not close.

    Changes `states`; adds the normal part to `c.impulse[k]`.
    """
    i, j, x, y, nx, ny = c.i[k], c.j[k], c.x[k], c.y[k], c.nx[k], c.ny[k]
    vx, vy = _point_velocity(states, i, x, y)
    if j >= 0:
        wx, wy = _point_velocity(states, j, x, y)
        vx, vy = vx - wx, vy - wy
    closing = float(-(vx * nx + vy * ny))
    if closing <= 0.0:
        return closing
    tx, ty = -ny, nx
    give_n = _yielding(states, b, i, x, y, nx, ny)
    give_t = _yielding(states, b, i, x, y, tx, ty)
    friction = law.friction_static
    if j >= 0:
        give_n += _yielding(states, b, j, x, y, nx, ny)
        give_t += _yielding(states, b, j, x, y, tx, ty)
        friction = law.friction_vehicle
    if give_n <= 0.0:
        return closing
    normal = (1.0 + _restitution(law, closing)) * closing / give_n
    sliding = -(vx * tx + vy * ty) / give_t
    tangent = min(max(sliding, -friction * normal), friction * normal)
    jx, jy = normal * nx + tangent * tx, normal * ny + tangent * ty
    _push(states, b, i, x, y, jx, jy)
    if j >= 0:
        _push(states, b, j, x, y, -jx, -jy)
    c.impulse[k] += normal
    return closing


@inner_kernel
def _separate(states: ActorStates, b: Bodies, c: Contacts, k: int) -> None:
    """Moves the bodies of contact k apart until DEPTH_KEPT m of overlap are left, the lighter one further."""
    i, j = c.i[k], c.j[k]
    share = b.inverse_mass[i]
    total = share + (b.inverse_mass[j] if j >= 0 else 0.0)
    distance = c.depth[k] - DEPTH_KEPT
    if total <= 0.0 or distance <= 0.0:
        return
    states.x[i] += c.nx[k] * distance * share / total
    states.y[i] += c.ny[k] * distance * share / total
    if j >= 0:
        states.x[j] -= c.nx[k] * distance * (total - share) / total
        states.y[j] -= c.ny[k] * distance * (total - share) / total


@inner_kernel
def _record(
    c: Contacts, count: int, i: int, j: int, segment: int,
    found: tuple[bool, float, float, float, float, float],
) -> int:  # fmt: skip
    """Writes one contact at index `count` and returns the new count; unchanged where the table is full.

    found: as `box_box` returns it; not touching: nothing is written.
    """
    if not found[0] or count >= c.i.shape[0]:
        return count
    c.i[count], c.j[count], c.segment[count] = i, j, segment
    c.x[count], c.y[count] = found[1], found[2]
    c.nx[count], c.ny[count], c.depth[count] = found[3], found[4], found[5]
    c.impulse[count], c.length[count] = 0.0, 0.0
    return count + 1


@inner_kernel
def _record_piece(
    c: Contacts, count: int, i: int, m: int, segments: Segments,
    found: tuple[bool, float, float, float, float, float], length: float,
) -> int:  # fmt: skip
    """Writes the contact of actor i with segment m as `_record` does; pieces of one wall are one contact.

    Its point is the middle of what lies inside the body, its depth and normal those of the deepest piece.
    """
    goes_on = segments.joined[m, 0] or segments.joined[m, 1]
    for q in range(count - 1, -1, -1) if found[0] and goes_on else range(0):
        other = c.segment[q]
        if c.i[q] != i or other < 0:
            break
        if not (segments.joined[other, 0] or segments.joined[other, 1]):
            continue
        if c.nx[q] * found[3] + c.ny[q] * found[4] < STRAIGHT:
            continue
        share = length / max(c.length[q] + length, 1e-9)
        c.x[q] += share * (found[1] - c.x[q])
        c.y[q] += share * (found[2] - c.y[q])
        c.length[q] += length
        if found[5] > c.depth[q]:
            c.segment[q], c.nx[q], c.ny[q], c.depth[q] = m, found[3], found[4], found[5]
        return count
    new = _record(c, count, i, -1, m, found)
    if new > count:
        c.length[count] = length
    return new


@inner_kernel
def find_contacts(
    states: ActorStates, b: Bodies, segments: Segments, dt: float, out: Contacts
) -> int:
    """Fills `out` with all touching pairs, in order of i, then j, then segment, and returns their number.

    Pairs of which neither can move, or that share less than Z_OVERLAP m of height, do not touch. dt: s of
    the step that led here.
    """
    boxes = Boxes(states.x, states.y, states.yaw, b.half_length, b.half_width, out.corners)
    n = states.x.shape[0]
    count = 0
    for i in range(n):
        if not states.present[i]:
            continue
        reach = sqrt(b.half_length[i] ** 2 + b.half_width[i] ** 2)
        top = states.z[i] + b.height[i]
        for j in range(i + 1, n):
            if not states.present[j] or b.inverse_mass[i] + b.inverse_mass[j] <= 0.0:
                continue
            dx, dy = states.x[j] - states.x[i], states.y[j] - states.y[i]
            far = reach + b.half_length[j] + b.half_width[j]
            if abs(dx) > far or abs(dy) > far:
                continue
            if min(top, states.z[j] + b.height[j]) - max(states.z[i], states.z[j]) < Z_OVERLAP:
                continue
            count = _record(out, count, i, j, -1, box_box(boxes, i, j))
        if b.inverse_mass[i] <= 0.0:
            continue
        for q in range(candidates(segments, states.x[i], states.y[i], reach, out.near)):
            m = out.near[q]
            if min(top, segments.z_high[m]) - max(states.z[i], segments.z_low[m]) < Z_OVERLAP:
                continue
            back = (states.x[i] - states.vx[i] * dt, states.y[i] - states.vy[i] * dt)
            line = (segments.x0[m], segments.y0[m], segments.x1[m], segments.y1[m])
            joined = (segments.joined[m, 0], segments.joined[m, 1])
            found = box_segment(boxes, i, line, joined, back)
            length = clipped_length(boxes, i, line) if found[0] else 0.0
            count = _record_piece(out, count, i, m, segments, found, length)
    return count


@kernel
def resolve_contacts(
    states: ActorStates,
    b: Bodies,
    segments: Segments,
    law: ContactLaw,
    dt: float,
    out: Contacts,
) -> int:
    """Finds the contacts after a step of dt seconds, exchanges impulses and moves the bodies apart.

    Changes velocities, yaw rates and positions in `states`; fills `out` and returns how many.
    """
    count = find_contacts(states, b, segments, dt, out)
    for turn in range(PASSES):
        for k in range(count):
            closing = _exchange(states, b, out, k, law)
            if turn == 0:
                out.v_closing[k] = closing
    for k in range(count):
        _separate(states, b, out, k)
    return count
