"""One tick of a story in which nothing begins or ends, as a kernel over a table.

The table is made by `playing/table.py` of a story that stands still: its actors, what each waiting condition
says now, and the changes of speed and offset that go on. The kernel moves all of it on by a tick. Where a
condition may say something else than before, a change is over, or an actor does what only Python can, it
leaves the table as it was and says so: Python then plays the tick.
"""

from __future__ import annotations

from math import cos, inf, pi, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.kernels.jit import Held, inner_kernel, kernel
from skidpad.core.states import ActorStates
from skidpad.roads.kernels import LaneArrays
from skidpad.scenarios.conditions.distances import SLOWEST
from skidpad.scenarios.movement.following import follow
from skidpad.scenarios.movement.motion import SLOW
from skidpad.scenarios.scene import JUST, STANDING
from skidpad.simulation.scripted import Hands

F, I, B = np.float64, np.int64, np.bool_
ACTORS = np.dtype(
    [
        # as `scene.Actor` has them; x to vy of the box's centre, px to pz of the reference point
        *((name, F) for name in ("x", "y", "yaw", "vx", "vy", "px", "py", "pz")),
        *((name, F) for name in ("a", "ax", "ay", "travelled", "stood", "at_end_s", "way_back")),
        # as `motion.Guide` has them
        *((name, F) for name in ("v", "v_rate", "dv", "dv_rate", "pace")),
        *((name, F) for name in ("offset", "offset_rate", "offset_bend", "along")),
        ("adds_offset", B),
        ("at_end", B),
        ("followed", B),  # the point of its lane is that of the last tick
        ("lane", I),
        *((name, F) for name in ("s", "left", "lx", "ly", "lz", "heading", "curvature", "width")),
        *((name, F) for name in ("throttle", "brake", "steer")),
        # what stays
        ("row", I),  # among the states of the world
        ("is_told", B),  # the file drives it
        *((name, F) for name in ("forward", "aside")),  # of the box's centre, m
        *((name, F) for name in Hands._fields),
    ],
    align=True,
)
CONDITIONS = np.dtype(
    [
        ("kind", I),
        ("actor", I),
        ("other", I),  # -1: the place (x, y), or none
        ("x", F),
        ("y", F),
        ("rule", I),  # index among RULES
        ("value", F),
        ("slack", F),  # m by which bodies may be nearer or further than their reference points
        ("says", B),  # what it says as long as the table holds
    ],
    align=True,
)
CHANGES = np.dtype(
    [
        ("actor", I),
        ("is_speed", B),  # else of the offset
        ("start", F),
        ("end", F),
        ("span", F),  # s, or m
        ("span_squared", F),
        ("shape", I),  # index among SHAPES
        ("began", F),  # s, of a change of speed
        ("done", F),  # s or m, of a change of offset
        ("done_next", F),
        ("by_way", B),
        ("to_lane", B),
        ("noted", B),
    ],
    align=True,
)
Rows = NDArray[np.void]
Row = Any  # one of them, as kernels take it

RULES = ("equalTo", "notEqualTo", "greaterThan", "lessThan", "greaterOrEqual", "lessOrEqual")
EQUAL, DIFFERENT, GREATER, _, GREATER_OR_EQUAL, _ = range(6)
SHAPES = ("linear", "sinusoidal", "cubic", "step")
LINEAR, SINUSOIDAL, CUBIC, STEP = range(4)
KINDS = (
    "time", "travelled", "stood", "speed", "speed along", "speed across", "acceleration",
    "acceleration along", "acceleration across", "distance", "distance along", "distance across",
    "distance in x", "distance in y", "headway", "headway along", "headway across",
    "collision time", "collision time along", "collision time across",
)  # fmt: skip
(
    TIME, TRAVELLED, STOOD, SPEED, SPEED_ALONG, SPEED_ACROSS, ACCELERATION, ACCELERATION_ALONG,
    ACCELERATION_ACROSS, DISTANCE, DISTANCE_ALONG, DISTANCE_ACROSS, DISTANCE_X, DISTANCE_Y,
    HEADWAY, HEADWAY_ALONG, HEADWAY_ACROSS, COLLISION_TIME, COLLISION_TIME_ALONG,
    COLLISION_TIME_ACROSS,
) = range(20)  # fmt: skip
UNSURE = 1e-6  # of a value, at least of 1: so near to it Python decides
ON_TYRES = STANDING[0]  # m/s


class Table(NamedTuple):
    """The rows of a story that stands still."""

    actors: Rows
    next: Rows  # the actors a tick later
    conditions: Rows
    changes: Rows
    pedals: NDArray[np.float64]  # (n, 3) of actors: throttle, brake, steer


@kernel
def play_tick(
    map: Held[LaneArrays], states: Held[ActorStates], held: Held[Table], t: float, dt: float
) -> bool:
    """Moves a story on to t s, and what goes on in it by dt s more; False: Python has to play this tick.

    states: of the world at t s.
    """
    table, s = held.value, states.value
    actors, later = table.actors, table.next
    for i in range(len(actors)):
        later[i] = actors[i]
        observe(later[i], s, dt)
    for k in range(len(table.conditions)):
        if not stays(table.conditions[k], later, t):
            return False
    for k in range(len(table.changes)):
        change = table.changes[k]
        on = later[change.actor]
        if change.is_speed:
            p = t + dt - change.began
            if change.shape == STEP or p >= change.span - 1e-9:
                return False
            on.v, on.v_rate, _ = value_at(change, p)
        elif not move_aside(change, on, dt):
            return False
    for i in range(len(actors)):
        if later[i].is_told and not drive_on(map.value, later[i], table.pedals[i]):
            return False
    for i in range(len(actors)):
        actors[i] = later[i]
    for k in range(len(table.changes)):
        table.changes[k].done = table.changes[k].done_next
    return True


@inner_kernel
def observe(one: Row, s: ActorStates, dt: float) -> None:
    """Takes over an actor's motion, as `scene.Actor.observe`."""
    i = one.row
    vx, vy = s.vx[i], s.vy[i]
    v, now = sqrt(one.vx * one.vx + one.vy * one.vy), sqrt(vx * vx + vy * vy)
    one.a, one.ax, one.ay = (now - v) / dt, (vx - one.vx) / dt, (vy - one.vy) / dt
    one.x, one.y, one.yaw, one.vx, one.vy = s.x[i], s.y[i], s.yaw[i], vx, vy
    one.px, one.py, one.pz = one.x, one.y, s.z[i]
    if one.forward != 0.0 or one.aside != 0.0:
        c, si = cos(one.yaw), sin(one.yaw)
        one.px = one.x + -one.forward * c - -one.aside * si
        one.py = one.y + -one.forward * si + -one.aside * c
        one.pz = one.pz + 0.0
    one.travelled = one.travelled + now * dt
    one.way_back = one.way_back + max(-(vx * cos(one.yaw) + vy * sin(one.yaw)), 0.0) * dt
    one.stood = one.stood + dt if max(v, now) < ON_TYRES else 0.0
    if one.at_end:
        one.at_end_s = one.at_end_s + dt if one.at_end_s != 0.0 else JUST
    else:
        one.at_end_s = 0.0


@inner_kernel
def stays(condition: Row, actors: Rows, t: float) -> bool:
    """Returns whether a condition surely says what it said before."""
    kind = condition.kind
    if kind == TIME:
        return compares(condition, t, 0.0)
    own = actors[condition.actor]
    if kind == TRAVELLED:
        return bool((own.travelled >= condition.value) == condition.says)
    if kind == STOOD:
        return bool((own.stood >= condition.value) == condition.says)
    vx, vy, x, y = own.vx, own.vy, condition.x, condition.y
    if condition.other >= 0:
        its = actors[condition.other]
        vx, vy, x, y = vx - its.vx, vy - its.vy, its.px, its.py
    c, s = cos(own.yaw), sin(own.yaw)
    if kind <= ACCELERATION_ACROSS:
        q = own.a
        if kind == SPEED:
            q = signed_speed(own)
            if condition.other >= 0:
                q = q - signed_speed(actors[condition.other])
        elif kind == SPEED_ALONG:
            q = vx * c + vy * s
        elif kind == SPEED_ACROSS:
            q = vy * c - vx * s
        elif kind == ACCELERATION_ALONG:
            q = own.ax * c + own.ay * s
        elif kind == ACCELERATION_ACROSS:
            q = own.ay * c - own.ax * s
        return compares(condition, q, 0.0)
    dx, dy = x - own.px, y - own.py
    along, across = dx * c + dy * s, dy * c - dx * s
    direct = sqrt(dx * dx + dy * dy)
    if kind >= COLLISION_TIME:
        reach, closing = direct, 0.0
        if kind == COLLISION_TIME_ALONG:
            reach, closing = abs(along), closing_speed(along, vx * c + vy * s)
        elif kind == COLLISION_TIME_ACROSS:
            reach, closing = abs(across), closing_speed(across, vy * c - vx * s)
        elif direct > 0.0:
            closing = (vx * dx + vy * dy) / direct
        if abs(closing - SLOWEST) < UNSURE:
            return False
        if closing < SLOWEST:
            return compares(condition, inf, 0.0)
        return compares(condition, reach / closing, condition.slack / closing)
    if kind >= HEADWAY:
        v = sqrt(own.vx * own.vx + own.vy * own.vy)
        if v == 0.0:
            return not condition.says
        if kind == HEADWAY_ALONG and along < condition.slack + UNSURE:
            return bool(along < -condition.slack - UNSURE and not condition.says)
        reach = direct
        if kind == HEADWAY_ALONG:
            reach = along
        elif kind == HEADWAY_ACROSS:
            reach = abs(across)
        return compares(condition, reach / v, condition.slack / v)
    reach = direct
    if kind == DISTANCE_ALONG:
        reach = abs(along)
    elif kind == DISTANCE_ACROSS:
        reach = abs(across)
    elif kind == DISTANCE_X:
        reach = abs(dx)
    elif kind == DISTANCE_Y:
        reach = abs(dy)
    return compares(condition, reach, condition.slack)


@inner_kernel
def compares(condition: Row, q: float, slack: float) -> bool:
    """Returns whether a quantity within `slack` of q surely compares as before."""
    difference = q - condition.value
    if not abs(difference) > slack + UNSURE * max(
        abs(condition.value), 1.0
    ):  # nor what is no number
        return False
    rule = condition.rule
    if rule in (EQUAL, DIFFERENT):
        says = rule == DIFFERENT
    elif rule in (GREATER, GREATER_OR_EQUAL):
        says = difference > 0.0
    else:
        says = difference < 0.0
    return bool(says == condition.says)


@inner_kernel
def signed_speed(one: Row) -> float:
    """Returns the speed over ground, m/s, negative backwards."""
    v = sqrt(one.vx * one.vx + one.vy * one.vy)
    return v if one.vx * cos(one.yaw) + one.vy * sin(one.yaw) >= 0.0 else -v


@inner_kernel
def closing_speed(way: float, speed: float) -> float:
    """Returns the speed at which a way becomes shorter, m/s."""
    return speed if way >= 0.0 else -speed


@inner_kernel
def value_at(change: Row, p: float) -> tuple[float, float, float]:
    """Returns value, rate and bend of a change before its end, as `Transition.at`."""
    u, size = p / change.span, change.end - change.start
    if change.shape == LINEAR:
        share, rate, bend = u, 1.0, 0.0
    elif change.shape == SINUSOIDAL:
        share, rate = 0.5 - 0.5 * cos(pi * u), 0.5 * pi * sin(pi * u)
        bend = 0.5 * pi * pi * cos(pi * u)
    else:
        share, rate, bend = u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u), 6.0 - 12.0 * u
    return (
        change.start + share * size,
        rate * size / change.span,
        bend * size / change.span_squared,
    )


@inner_kernel
def move_aside(change: Row, on: Row, dt: float) -> bool:
    """Moves an actor aside, as `ChangeOfOffset.step`; False: it is over, or has something to note."""
    change.done_next = change.done
    if change.shape == STEP or change.done >= change.span - 1e-9:
        return False
    v = abs(on.v)
    if v < SLOW:
        on.offset_rate, on.offset_bend = 0.0, 0.0
        return True
    on.adds_offset = not change.to_lane
    if change.to_lane:
        on.pace = on.v
    _, slope, _ = value_at(change, change.done)
    pace = v / sqrt(1.0 + slope * slope) if change.by_way else 1.0
    if not change.by_way and abs(slope) > v:
        pace = v / abs(slope)
        if not change.noted:
            return False
    change.done_next = change.done + pace * dt
    now = change.done_next if change.to_lane else change.done
    if now >= change.span - 1e-9:
        return False
    on.offset, slope, bend = value_at(change, now)
    on.offset_rate, on.offset_bend = slope * pace, bend * pace * pace
    return True


@inner_kernel
def drive_on(map: LaneArrays, one: Row, pedals: NDArray[np.float64]) -> bool:
    """Lets an actor follow its lane, as `Guide.command`; False where it goes backwards."""
    if one.v < 0.0:
        return False
    found = follow(
        map, one, one.lane, one.s, one.lx, one.ly, one.heading, one.curvature,
        one.x, one.y, one.yaw, one.vx, one.vy, one.v + one.dv, one.v_rate + one.dv_rate,
        one.along, one.offset, one.offset_rate, one.offset_bend,
    )  # fmt: skip
    one.at_end = found[0] < 0
    if not one.at_end:
        one.followed, one.lane, one.s, one.left = True, found[0], found[1], found[2]
        one.lx, one.ly, one.lz, one.heading = found[3], found[4], found[5], found[6]
        one.curvature, one.width = found[7], found[8]
        one.throttle, one.brake, one.steer = found[9], found[10], found[11]
    pedals[0], pedals[1], pedals[2] = found[9], found[10], found[11]
    return True
