"""All drivers in one kernel: each follows its path, chooses lane and acceleration, then pedals."""

from __future__ import annotations

from math import cos
from typing import Any

import numpy as np

from skidpad.core.arrays import Floats, Ints32
from skidpad.core.kernels.jit import inner_kernel
from skidpad.simulation.world.traffic import occupancy as occ_
from skidpad.simulation.world.traffic.care import (
    braking,
    change_pace,
    character,
    firm_braking,
)
from skidpad.simulation.world.traffic.idm import Character, idm
from skidpad.simulation.world.traffic.mobil import (
    B_SAFE,
    incentive,
    is_safe,
)
from skidpad.simulation.world.traffic.occupancy import NOBODY
from skidpad.simulation.world.traffic.outlook import (
    desired_speed,
    end_gap,
    merge_gap,
    stop_gap,
)
from skidpad.simulation.world.traffic.path import (
    PATH,
    along,
    begin,
    extend,
    offset_from,
    straight_path,
    uniform,
)
from skidpad.simulation.world.traffic.right_of_way import (
    is_clear_of_line,
    right_of_way_gap,
)
from skidpad.simulation.world.traffic.state import CHANGE_TIME, Drivers, View
from skidpad.simulation.world.traffic.tracking import pedals, steer
from skidpad.simulation.world.traffic.zebras import zebra_gap

REACH_AHEAD = 150.0  # m
REACH_BEHIND = 120.0  # m
CHANGE_COOLDOWN = 10.0  # s between two changes
CHANGE_MIN_SPEED = 5.0  # m/s
CHANGE_MAX_CURVE = 1.0 / 250.0  # 1/m: nobody changes lane in a tight bend
LOOK_PERIOD = 4  # ticks between two looks at limits and bends ahead: 0.2 s
CHANGE_PERIOD = 10  # ticks between two looks at the neighbour lanes
FAST_LIMIT = 80.0 / 3.6 - 0.1  # m/s: limits from here on are those of motorways
END_MARGIN = 200.0  # m before a lane's end from which a driver must leave it
LEFT_BEHIND = 0.6  # of a change, after which the leader on the old lane no longer counts
HEADWAY_STOP = 0.5  # s kept to a stop line
STUCK_SPEED = 0.5  # m/s
TOO_FAST_TIME = 0.7  # s in which too much speed before a bend or limit is taken off
TOO_FAST_BRAKE = 4.0  # m/s^2
CAUSE_GAP = 12.0  # m: a leader or stop line this near explains standing
STRAYED = 1.0  # m beyond the lane's edge
WRONG_WAY = -0.5  # cosine of 120 deg


@inner_kernel
def follow_path(view: View, d: Drivers, i: int) -> None:
    """Updates where driver i is along its path, entering the next lane when it is reached.

    Writes its state; passing a speed sign ends its cap.
    """
    net, path, me, body = view.streets.net, d.path[i], d.state[i], view.placed[i]
    start = me.at + 1
    at, t = along(net, path[0], me.at, body.x, body.y)
    while t > 1.0 and path[1] >= 0:
        for k in range(PATH - 1):
            path[k] = path[k + 1]
        path[PATH - 1] = -1
        me.turns += 1
        start = net.lane[path[0]].first
        at, t = along(net, path[0], start, body.x, body.y)
    for k in range(start, at + 1):
        if net.point[k].sign:
            me.cap = np.inf
    me.at = at
    me.s = net.point[at].s + t * (net.point[at + 1].s - net.point[at].s)
    me.offset, me.heading = offset_from(net, at, t, body.x, body.y)
    extend(net, path, me.s, me.key, me.turns, view.free_choice)


@inner_kernel
def turn_to(view: View, d: Drivers, i: int, lane: int, s: float) -> None:
    """Sets driver i's path to `lane` from about s on, sliding over from the present lateral offset."""
    me, target = d.state[i], view.streets.net.lane[lane]
    cap = me.cap
    begin(d.path[i], lane)
    me.at = target.first + int((target.size - 1) * s / target.length)
    follow_path(view, d, i)
    me.cap = cap  # no sign was passed
    me.shift = me.offset
    me.change = 0.0
    occ_.add(view.occ, i, lane, me.s)


@inner_kernel
def character_of(view: View, d: Drivers, i: int, v: float) -> Character:
    """Returns how driver i follows at speed v in m/s on the road where it is."""
    trait = d.trait[i]
    fast = view.streets.net.point[d.state[i].at].limit >= FAST_LIMIT
    headway = trait.headway if fast else trait.headway_town
    return character(view.care, v, headway, trait.a_max, trait.is_exact)


@inner_kernel
def acceleration_along(
    view: View, d: Drivers, i: int, path: Ints32, s: float, v_desired: float
) -> tuple[float, float, int]:
    """Returns the IDM acceleration in m/s^2 of i on `path` at `s`, the gap in m to its leader, and its row.

    inf and -1 where there is no leader within REACH_AHEAD.
    """
    leader, gap = occ_.find_ahead(view.streets.net, view.occ, view.placed, path, s, i, REACH_AHEAD)
    v_lead = view.placed[leader].v if leader != NOBODY else 0.0
    v = view.placed[i].speed
    return idm(v, v_desired, gap, v_lead, character_of(view, d, i, v)), gap, leader


@inner_kernel
def follower_acceleration(view: View, d: Drivers, j: int, gap: float, v_lead: float) -> float:
    """Returns the m/s^2 of follower j behind a vehicle at `gap` m; 0 where j is -1.

    It is taken to want its own speed.
    """
    if j == NOBODY:
        return 0.0
    v = max(view.placed[j].v, 0.0)
    return idm(v, max(v, 1.0), gap, v_lead, character_of(view, d, j, v))


@inner_kernel
def change_gain(view: View, d: Drivers, i: int, lane: int, a_now: float, v_desired: float) -> float:
    """Returns MOBIL's advantage of moving to `lane` in m/s^2; -inf when it is not safe.

    a_now: m/s^2 in the present lane; overwrites `d.aside`.
    """
    me, v = d.state[i], view.placed[i].speed
    s = occ_.beside(view.streets.net, d.path[i, 0], me.s, lane)
    straight_path(view.streets.net, lane, d.aside)
    a_new, gap_ahead, _ = acceleration_along(view, d, i, d.aside, s, v_desired)
    behind, gap_behind = occ_.find_behind(
        view.streets.net, view.occ, view.placed, lane, s, i, REACH_BEHIND
    )
    a_behind = follower_acceleration(view, d, behind, gap_behind, v)
    trait = d.trait[i]
    b_safe = min(trait.imposed, braking(view.care, v) * (trait.imposed / B_SAFE))
    if not is_safe(a_new, a_behind, gap_ahead, gap_behind, b_safe, trait.room):
        return -np.inf
    old, gap_old = occ_.find_behind(
        view.streets.net, view.occ, view.placed, d.path[i, 0], me.s, i, REACH_BEHIND
    )
    a_old = follower_acceleration(view, d, old, gap_old, v)
    return incentive(a_new - a_now, min(a_behind, 0.0), max(-a_old, 0.0))


@inner_kernel
def may_enter(view: View, d: Drivers, i: int, lane: int, left: bool) -> bool:
    """Returns whether there is such a driving lane, it goes on, and the marking may be crossed.

    lane: index, -1 for none; broken markings and none may be crossed.
    """
    if lane < 0 or view.streets.net.lane[lane].kind != 0 or view.streets.net.lane[lane].ahead < 0:
        return False  # LaneKind.DRIVING only: ramps are entered at forks
    here = view.streets.net.point[d.state[i].at]
    return bool((here.marking_left if left else here.marking_right) <= 1)  # Marking.NONE, BROKEN


@inner_kernel
def consider_change(
    view: View, d: Drivers, i: int, a_now: float, v_desired: float, gap_stop: float
) -> None:
    """Begins a lane change when MOBIL, a draw or the lane's end says so.

    Not on the way to a line where one has to stop, gap_stop m ahead (inf: none). a_now: m/s^2.
    """
    me = d.state[i]
    if me.change < CHANGE_TIME + CHANGE_COOLDOWN or view.placed[i].speed < CHANGE_MIN_SPEED:
        return
    bend = abs(view.streets.net.point[me.at].curvature)
    if (view.tick + 3 * i) % CHANGE_PERIOD != 0 or bend > CHANGE_MAX_CURVE:
        return
    must = end_gap(view, d, i) < END_MARGIN
    if view.care.on and gap_stop < np.inf and not must:
        return
    way = view.placed[i].speed * CHANGE_PERIOD * view.dt
    drawn = uniform(me.key, view.tick, 2) < view.care.drawn * d.trait[i].eager * way
    drawn_left = uniform(me.key, view.tick, 3) < 0.5
    lane_now = view.streets.net.lane[d.path[i, 0]]
    best, best_gain = -1, view.care.a_change
    for left in (True, False):
        lane = lane_now.left if left else lane_now.right
        if not may_enter(view, d, i, lane, left):
            continue
        gain = change_gain(view, d, i, lane, a_now, v_desired)
        if gain > -np.inf and (must or (drawn and left == drawn_left)):
            gain = np.inf
        if gain > best_gain:
            best, best_gain = lane, gain
    if best >= 0:
        turn_to(view, d, i, best, occ_.beside(view.streets.net, d.path[i, 0], me.s, best))


@inner_kernel
def note_cause(
    me: Any,
    leader: tuple[float, int],
    merging: tuple[float, int],
    stops: tuple[float, float, float, float],
    yielding: tuple[int, int],
) -> None:
    """Notes in `me` what of leader, merging traffic and places to stop is nearest and close, and whose it is.

    leader, merging: gap in m and row. stops: gaps to light, road's end, right of way and zebra.
    yielding: for what (`state.Held`) and which row the driver waits at the third of them.
    """
    nearest, me.held, me.blocker = CAUSE_GAP, 0, NOBODY
    if leader[0] <= nearest:
        nearest, me.held, me.blocker = leader[0], 1, leader[1]
    if merging[0] < nearest:
        nearest, me.held, me.blocker = merging[0], 2, merging[1]
    for k in range(4):
        if stops[k] < nearest:
            nearest, me.held, me.blocker = stops[k], 3 + k, NOBODY
    if me.held == 5:
        me.held, me.blocker = yielding


@inner_kernel
def plan(view: View, d: Drivers, i: int) -> None:
    """Chooses lane and acceleration (`target`) of driver i; notes how long it has stood or been stuck."""
    me, trait, body = d.state[i], d.trait[i], view.placed[i]
    if (view.tick + i) % LOOK_PERIOD == 0 or me.v_desired == 0.0:
        me.v_desired = desired_speed(view.streets.net, me, trait, d.path[i], body.speed, view.care)
    v, v_desired = body.speed, me.v_desired
    c = character_of(view, d, i, v)
    a, gap, leader = acceleration_along(view, d, i, d.path[i], me.s, v_desired)
    if body.lane >= 0 and body.lane != d.path[i, 0] and me.change < LEFT_BEHIND * CHANGE_TIME:
        straight_path(view.streets.net, body.lane, d.aside)
        a_old, gap_old, leader_old = acceleration_along(view, d, i, d.aside, body.s, v_desired)
        a = min(a, a_old)
        if gap_old < gap:
            gap, leader = gap_old, leader_old
    merging, gap_merge = merge_gap(view, d, i)
    if merging != NOBODY:
        v_merging = view.placed[merging].v
        a = min(a, idm(v, v_desired, gap_merge, v_merging, c))
    a_lane = a  # what the lane allows, without what holds on every lane
    gap_yield, cause, other = right_of_way_gap(view, d, i)
    stops = (stop_gap(view, d, i), end_gap(view, d, i), gap_yield, zebra_gap(view, d, i))
    gap_stop = min(stops)
    if gap_stop < np.inf:
        stop = Character(HEADWAY_STOP, c.a_max, c.b, c.a_min, False)
        a = min(a, idm(v, v_desired, gap_stop, 0.0, stop))
    if v > v_desired:  # the profile ahead is comfortable: falling behind it is not an option
        firm = firm_braking(view.care, v, TOO_FAST_BRAKE)
        a = min(a, max((v_desired - v) / TOO_FAST_TIME, -firm))
    me.target = a
    consider_change(view, d, i, a_lane, v_desired, gap_stop)
    strayed = abs(me.offset) > view.streets.net.point[me.at].half_width + STRAYED
    if v < STUCK_SPEED:
        me.stood += view.dt
    elif is_clear_of_line(view, d, i):
        me.stood = 0.0
    note_cause(me, (gap, leader), (gap_merge, merging), stops, (cause, other))
    standing = v < STUCK_SPEED and me.held == 0
    wrong_way = cos(body.yaw - me.heading) < WRONG_WAY
    if standing or (strayed and me.change > CHANGE_TIME) or wrong_way:
        me.stuck += view.dt
    else:
        me.stuck = 0.0


@inner_kernel
def keep_lane_if_pushed(view: View, d: Drivers, i: int) -> None:
    """Lets a vehicle that finds itself on another lane without having changed stay on that one."""
    me, body = d.state[i], view.placed[i]
    if me.change <= CHANGE_TIME or body.lane < 0 or body.lane == d.path[i, 0]:
        return
    kind = view.streets.net.lane[body.lane].kind
    if abs(me.offset) > 1.5 * view.streets.net.point[me.at].half_width and (kind == 0 or kind == 7):
        turn_to(view, d, i, body.lane, body.s)


@inner_kernel
def drive_all(view: View, d: Drivers, commands: Floats) -> None:
    """Moves all active drivers on by one tick; writes throttle, brake, steer, ... into commands (n, 5)."""
    occ_.fill(view.streets.net, view.placed, view.occ)
    for i in range(len(d.state)):
        if d.state[i].active and view.placed[i].present:
            d.state[i].change += view.dt * change_pace(view.care, view.placed[i].speed)
            follow_path(view, d, i)
            keep_lane_if_pushed(view, d, i)
            occ_.add(view.occ, i, d.path[i, 0], d.state[i].s)
    for i in range(len(d.state)):
        if d.state[i].active and view.placed[i].present:
            plan(view, d, i)
            throttle, brake = pedals(view, d, i)
            commands[i, 0], commands[i, 1] = throttle, brake
            commands[i, 2] = steer(view, d, i)
            commands[i, 3] = commands[i, 4] = 0.0
