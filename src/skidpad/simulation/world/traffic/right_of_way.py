"""Waiting for others at junctions: stop lines, gap acceptance, areas that are taken.

A driver decides before the junction: it enters when its way through is free, when no vehicle to which
it yields arrives too soon, and when there is room behind the junction. Once in, it keeps out of areas
in which another stands, and judges gaps anew when it had to stop.
"""

from __future__ import annotations

from math import cos, sin, sqrt

import numpy as np

from skidpad.core.kernels.jit import inner_kernel
from skidpad.simulation.world.traffic.care import (
    bend_speed_sq,
    drive_limit,
    firm_braking,
    reach,
)
from skidpad.simulation.world.traffic.occupancy import NOBODY, SLOTS, find_ahead
from skidpad.simulation.world.traffic.path import PATH
from skidpad.simulation.world.traffic.priority import LIGHT, STOP, YIELD
from skidpad.simulation.world.traffic.state import Drivers, Held, View

FREE, COMING, STOP_SIGN = int(Held.NOTHING), int(Held.RIGHT_OF_WAY), int(Held.STOP_SIGN)
EXIT_TAKEN, AREA_TAKEN = int(Held.EXIT_TAKEN), int(Held.AREA_TAKEN)
REACH = 60.0  # m before a junction from which a driver looks
DECIDE = 25.0  # m before it from which gaps are judged; before, a driver is only ready to stop
V_THROUGH = 8.0  # m/s through a junction
GAP_MARGIN = 1.0  # s beyond leaving the shared area: critical gaps near 4 to 7 s (HCM 2010)
JOIN_MARGIN = 2.5  # s, who joins must not be caught up at once
V_COMING = 15.0  # m/s, of others that come, where they are not looked at one by one
WATCH = 70.0  # m before the shared area in which others matter
HALTED = 0.5  # m/s
HALT_GAP = 4.5  # m to the line within which standing counts as a stop
PATIENCE = 4.0  # s, then who stands on the other side no longer counts
QUEUE_REACH = 26.0  # m before the area; who stands farther away stands in a queue
IMPATIENT = 40.0  # s of standing, about a cycle of lights, after which others let one go first
COURTESY_BRAKE = 3.0  # m/s^2 at most, to let one go first, or to judge a gap anew
TAKEN_TIME = 20.0  # s after which a driver in a junction creeps past others that leave room
CREEP_ROOM = 0.4  # m to them at least
EXIT_ROOM = 3.0  # m to be free behind the junction beside the own length
V_QUEUE = 2.0  # m/s, slower leaders make a queue
V_ANEW = 2.0  # m/s, below which a driver in a junction can always leave the way to others
INDICATED = 5  # lanes ahead that others can guess


@inner_kernel
def right_of_way_gap(view: View, d: Drivers, i: int) -> tuple[float, int, int]:
    """Returns the m from the front bumper to where driver i waits for others, for what, and the cause's row.

    inf where it need not wait; for what: `state.Held`; row -1: no actor is the cause. Counts in its state
    how long it waits, and notes its stops.
    """
    body, me = view.placed[i], d.state[i]
    start = -me.s - body.half_length  # from the front to the beginning of path[k]
    far = reach(view.care, body.speed, REACH)
    before, line = view.streets.entry[d.path[i, 0]], -1.0
    for k in range(PATH):
        lane = d.path[i, k]
        if lane < 0 or start > far:
            break
        entry = view.streets.entry[lane]
        if k > 0 and view.streets.entry[d.path[i, k - 1]].junction != entry.junction:
            before = view.streets.entry[d.path[i, k - 1]]
            line = start - (view.streets.net.lane[d.path[i, k - 1]].length - before.line)
        if entry.size > 0:
            if line > -0.5:
                if before.control == LIGHT and view.lights[before.signal] <= 1:
                    me.waited = 0.0  # the light is what it waits for
                    return np.inf, FREE, NOBODY
                cause, other = _waits(view, d, i, k, start, line, before.control)
                if cause != FREE:
                    me.waited += view.dt
                    return max(line, 0.1), cause, other
            else:
                me.halted = NOBODY if k == 0 else me.halted  # the stop is over
                blocked, cause, other = _gap_within(view, d, i, k, start, True)
                if blocked < np.inf:
                    me.waited += view.dt
                elif not view.care.on or body.speed > V_ANEW:  # else its patience would end at once
                    me.waited = 0.0
                if me.waited >= TAKEN_TIME:  # past those who leave room
                    blocked, cause, other = _gap_within(view, d, i, k, start, False)
                if blocked < np.inf:
                    return max(blocked, 0.1), cause, other
        start += view.streets.net.lane[lane].length
    return np.inf, FREE, NOBODY


@inner_kernel
def _waits(
    view: View, d: Drivers, i: int, k: int, start: float, line: float, control: int
) -> tuple[int, int]:
    """Returns for what driver i must be ready to stop before path[k], and the row of the cause.

    FREE and -1 where it need not. It is not yet past the line; start, line: m from its front to the lane
    and to the line. Notes a stop at a stop sign.
    """
    me, body = d.state[i], view.placed[i]
    lane = d.path[i, k]
    junction = view.streets.entry[lane].junction
    if control == STOP and me.halted != junction:
        if line < HALT_GAP and body.speed < HALTED:
            me.halted = junction
        else:
            return STOP_SIGN, NOBODY
    if line > reach(view.care, body.speed, DECIDE):
        return (COMING if control == YIELD and body.speed > V_THROUGH else FREE), NOBODY
    other = _queue_behind(view, d, i, k, start)
    if other != NOBODY:
        return EXIT_TAKEN, other
    entry = view.streets.entry[lane]
    firm = firm_braking(view.care, body.speed, COURTESY_BRAKE)
    can_wait = body.speed * body.speed <= 2.0 * firm * max(line, 0.1)
    for c in range(entry.first, entry.first + entry.size):
        conflict = view.streets.conflict[c]
        other = _on_area(view, i, conflict.other, conflict.other_start, conflict.other_end)
        if other != NOBODY:
            return AREA_TAKEN, other
        if not conflict.yields:
            other = _first_to_go(view, d, i, conflict.other) if can_wait else NOBODY
            if other != NOBODY:
                return COMING, other
            continue
        margin = JOIN_MARGIN if conflict.joins else GAP_MARGIN
        way = max(start + conflict.end + 2.0 * body.half_length, 1.0)
        clear = _time_through(view, d, i, way, entry.bend) + margin
        other = _coming(view, d, i, conflict.other, conflict.other_start, clear)
        if other != NOBODY:
            return COMING, other
    return FREE, NOBODY


@inner_kernel
def is_clear_of_line(view: View, d: Drivers, i: int) -> bool:
    """Returns whether driver i is neither in a junction nor close to the line before one."""
    entry = view.streets.entry[d.path[i, 0]]
    return bool(entry.junction < 0 and _gap_to_line(view, d, i) > HALT_GAP)


@inner_kernel
def _gap_to_line(view: View, d: Drivers, i: int) -> float:
    """Returns the m from the front bumper of driver i to the line at the end of its present lane."""
    line = view.streets.entry[d.path[i, 0]].line
    return float(line - d.state[i].s - view.placed[i].half_length)


@inner_kernel
def _is_impatient(view: View, d: Drivers, i: int) -> bool:
    """Returns whether driver i has stood so long that others let it go first."""
    return bool(view.care.on and d.state[i].active and d.state[i].stood > IMPATIENT)


@inner_kernel
def _first_to_go(view: View, d: Drivers, i: int, lane: int) -> int:
    """Returns the row of a driver that waits to go over `lane` and is let go first by driver i; -1: none.

    It has stood for long, and longer than i, which need not yield.
    Without it no left turn gets through while the stream that comes the other way fills each green,
    nor does any vehicle that yields to an endless stream.
    """
    if not view.care.on:
        return NOBODY
    longest = max(IMPATIENT, d.state[i].stood)
    found = _impatient_on(view, d, lane, lane, np.inf, longest)
    if found != NOBODY:
        return found
    row = view.streets.net.lane[lane]
    for p in range(row.prev_first, row.prev_first + row.prevs):
        before = view.streets.net.prev_lane[p]
        entry = view.streets.entry[before]
        if entry.control != LIGHT or view.lights[entry.signal] == 2:  # LightState.GREEN
            found = _impatient_on(view, d, before, lane, HALT_GAP, longest)
        if found != NOBODY:
            return found
    return NOBODY


@inner_kernel
def _impatient_on(
    view: View, d: Drivers, here: int, lane: int, reach: float, longest: float
) -> int:
    """Returns the row of a driver on lane `here` that goes over `lane` and has stood too long; -1: none.

    It is at most `reach` m from its line and has stood for more than `longest` s.
    One that waits for room behind the junction does not count: that room may depend on driver i.
    """
    entry = view.occ.head[here]
    while entry != NOBODY:
        j = entry // SLOTS
        other = d.state[j]
        turns = other.active and d.path[j, 0] == here and leads_to(d, j, lane)
        waits = other.stood > longest and other.held != EXIT_TAKEN
        if turns and waits and _gap_to_line(view, d, j) < reach:
            return int(j)
        entry = view.occ.next[entry]
    return NOBODY


@inner_kernel
def _time_through(view: View, d: Drivers, i: int, way: float, bend: float) -> float:
    """Returns the s that driver i takes for `way` m through a junction, no faster than its bend allows.

    bend: 1/m.
    """
    a_max = drive_limit(view.care, view.placed[i].speed, d.trait[i].a_max)
    v, v_max = max(view.placed[i].speed, 0.0), V_THROUGH
    if view.care.on and bend * V_THROUGH * V_THROUGH > 1.0:
        v_bend = sqrt(bend_speed_sq(view.care, bend, d.trait[i].a_curve))
        v, v_max = min(v, v_bend), min(v_max, v_bend)
    return _travel_time(v, way, a_max, v_max)


@inner_kernel
def _travel_time(v: float, way: float, a: float, v_max: float) -> float:
    """Returns the s for `way` m from speed v at acceleration a up to v_max; faster ones keep v."""
    if v >= v_max:
        return way / v
    t = (-v + sqrt(v * v + 2.0 * a * way)) / a
    t_max = (v_max - v) / a
    if t <= t_max:
        return t
    return t_max + (way - 0.5 * (v + v_max) * t_max) / v_max


@inner_kernel
def _on_area(view: View, i: int, lane: int, start: float, end: float) -> int:
    """Returns the row of an actor other than i whose body is on [start, end] m of a lane; -1: none."""
    entry = view.occ.head[lane]
    while entry != NOBODY:
        j = entry // SLOTS
        half = view.placed[j].half_length
        if j != i and view.occ.s[entry] + half > start and view.occ.s[entry] - half < end:
            return int(j)
        entry = view.occ.next[entry]
    return NOBODY


@inner_kernel
def _is_in_way(view: View, i: int, j: int, lane: int, front: float) -> bool:
    """Returns whether the body of actor j leaves driver i no room on a lane, from `front` m along it on."""
    me, other, row = view.placed[i], view.placed[j], view.streets.net.lane[lane]
    c, s = cos(other.yaw), sin(other.yaw)
    half_l = other.half_length + me.half_width + CREEP_ROOM
    half_w = other.half_width + me.half_width + CREEP_ROOM
    for k in range(row.first, row.first + row.size):
        point = view.streets.net.point[k]
        dx, dy = point.x - other.x, point.y - other.y
        if point.s > front and abs(c * dx + s * dy) < half_l and abs(-s * dx + c * dy) < half_w:
            return True
    return False


@inner_kernel
def _can_judge_anew(view: View, v: float, gap: float) -> bool:
    """Returns whether a driver in a junction, `gap` m before a shared area, can leave the way to others."""
    if v < V_ANEW:
        return True
    return bool(view.care.on and v * v <= 2.0 * firm_braking(view.care, v, COURTESY_BRAKE) * gap)


@inner_kernel
def _gap_within(
    view: View, d: Drivers, i: int, k: int, start: float, keeps_out: bool
) -> tuple[float, int, int]:
    """Returns the m to the nearest shared area on path[k] that driver i must not enter, for what, and a row.

    The row is that of the actor that is the cause. inf, FREE and -1 where there is no such area; the
    driver is in the junction.
    keeps_out: of areas in which another stands, else only of those whose way is not free. A driver that
    can still stop judges gaps anew.
    """
    entry, body = view.streets.entry[d.path[i, k]], view.placed[i]
    nearest, cause, by = np.inf, FREE, NOBODY
    for c in range(entry.first, entry.first + entry.size):
        conflict = view.streets.conflict[c]
        gap = start + conflict.start
        if gap < 0.0 or gap > nearest:
            continue
        other = NOBODY
        if keeps_out or view.care.on:
            other = _on_area(view, i, conflict.other, conflict.other_start, conflict.other_end)
        if (
            other != NOBODY
            and not keeps_out
            and not _is_in_way(view, i, other, d.path[i, k], -start)
        ):
            other = NOBODY
        if other != NOBODY:
            nearest, cause, by = gap, AREA_TAKEN, other
        elif conflict.yields and _can_judge_anew(view, body.speed, gap):
            way = max(start + conflict.end + 2.0 * body.half_length, 1.0)
            clear = _time_through(view, d, i, way, entry.bend) + GAP_MARGIN
            other = _coming(view, d, i, conflict.other, conflict.other_start, clear)
            if other != NOBODY:
                nearest, cause, by = gap, COMING, other
    return nearest, cause, by


@inner_kernel
def _queue_behind(view: View, d: Drivers, i: int, k: int, start: float) -> int:
    """Returns the row of the last in a queue that leaves no room behind junction lane path[k]; -1: none."""
    body, me = view.placed[i], d.state[i]
    room = start + view.streets.net.lane[d.path[i, k]].length + 2.0 * body.half_length + EXIT_ROOM
    if d.path[i, k + 1] >= 0 and view.streets.entry[d.path[i, k + 1]].size > 0:
        return NOBODY  # in roundabouts junctions follow each other
    leader, gap = find_ahead(
        view.streets.net, view.occ, view.placed, d.path[i], me.s, i, room + body.half_length
    )
    if leader != NOBODY and gap < room and view.placed[leader].v < V_QUEUE:
        return leader
    return NOBODY


@inner_kernel
def _coming(view: View, d: Drivers, i: int, lane: int, zone: float, clear: float) -> int:
    """Returns the row of an actor that arrives at `zone` m along `lane` within `clear` s; -1: none."""
    found = _arrives(view, d, i, lane, lane, zone, clear)
    if found != NOBODY:
        return found
    row = view.streets.net.lane[lane]
    for p in range(row.prev_first, row.prev_first + row.prevs):
        first = view.streets.net.prev_lane[p]
        if _held_by_light(view, first):
            continue
        way = zone + view.streets.net.lane[first].length
        found = _arrives(view, d, i, first, lane, way, clear)
        if found != NOBODY:
            return found
        if way > _watch_distance(view, V_COMING, clear):
            continue
        row_2 = view.streets.net.lane[first]
        for q in range(row_2.prev_first, row_2.prev_first + row_2.prevs):
            second = view.streets.net.prev_lane[q]
            before = way + view.streets.net.lane[second].length
            found = _arrives(view, d, i, second, lane, before, clear)
            if found != NOBODY:
                return found
    return NOBODY


@inner_kernel
def _watch_distance(view: View, v: float, clear: float) -> float:
    """Returns the m before the shared area in which an actor at v m/s matters for `clear` s."""
    return max(WATCH, v * clear) if view.care.on else WATCH


@inner_kernel
def _held_by_light(view: View, lane: int) -> bool:
    """Returns whether a red light stands at the end of a lane."""
    entry = view.streets.entry[lane]
    return bool(entry.control == LIGHT and view.lights[entry.signal] == 0)


@inner_kernel
def _arrives(
    view: View, d: Drivers, i: int, lane: int, target: int, way: float, clear: float
) -> int:
    """Returns the row of an actor on `lane` that gets to the shared area within `clear` s; -1: none.

    way: m from the lane's beginning to the area; target: lane that its path must go over.
    """
    entry = view.occ.head[lane]
    while entry != NOBODY:
        j = entry // SLOTS
        distance = way - view.occ.s[entry] - view.placed[j].half_length
        v = max(view.placed[j].v, 0.0)
        entry_now, entry = entry, view.occ.next[entry]
        far = distance > _watch_distance(view, v, clear)
        if j == i or far or distance < -2.0 * view.placed[j].half_length:
            continue
        if v < HALTED and (distance > QUEUE_REACH or d.state[i].waited > PATIENCE):
            continue
        if v < HALTED and _is_impatient(view, d, i) and d.state[i].stood > d.state[j].stood:
            continue
        if d.state[j].active and not leads_to(d, j, target):
            continue
        if view.occ.s[entry_now] > way:
            continue
        if _travel_time(v, max(distance, 0.0), 1.0, max(v, V_THROUGH)) < clear:
            return int(j)
    return NOBODY


@inner_kernel
def leads_to(d: Drivers, j: int, lane: int) -> bool:
    """Returns whether driver j's path goes over a lane within INDICATED: its indicators say so."""
    found = False
    for k in range(INDICATED):
        found = found or d.path[j, k] == lane
    return found
