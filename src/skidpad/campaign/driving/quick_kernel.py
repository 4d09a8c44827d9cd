"""Many ticks of the loop as one compiled call, which ends where Python has something to do.

It calls the kernels that Python calls one by one, by their addresses: world, motion, sensors, stack,
supervisor and log keep their own machine code, so nothing of them is compiled again.
"""

from __future__ import annotations

from math import inf, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Flags, Floats
from skidpad.core.kernels.calls import call
from skidpad.core.kernels.jit import Held, kernel
from skidpad.core.states import ActorStates
from skidpad.physics.fleet import shown_gear
from skidpad.recording.run.ticks import APPLIED, REPORT, REQUESTED, ActorColumns, copy_actors
from skidpad.roads.kernels import LaneArrays
from skidpad.sensors.object_level.objects import Common, sense
from skidpad.simulation.recovery import WRONG_WAY_DOT, find_ego, has_reason
from skidpad.simulation.world.feel import feel_motion
from skidpad.simulation.world.lights import ROUNDING
from skidpad.simulation.world.step import DECIDE, MOVE, SETTLE, Arena, advance
from skidpad.simulation.world.touch import EGO
from skidpad.simulation.world.traffic.manager import CHECK_PERIOD
from skidpad.stack.memory import Memory
from skidpad.stack.perception.lights import NONE_AHEAD, StopLines, heed_light
from skidpad.stack.road import RoadParts, read_road
from skidpad.stack.think import Parts, think, write_report

# why the kernel came back
DONE = 0  # all ticks that were asked for are driven
MOVED = 1  # actors have moved, and Python is to look after the traffic before they settle
STEPPED = 2  # the world has made its step, in which something happened
UNUSUAL = 3  # the tick has begun, and the supervisor may have something to do in it
REFUSED = 4  # the stack's command is out of range


class Addresses(NamedTuple):
    """Where the machine code of the stages is."""

    advance: int
    feel_motion: int
    sense: int
    read_road: int
    think: int
    find_ego: int
    has_reason: int
    heed_light: int
    copy_actors: int


class Tables(NamedTuple):
    """Arrays that the stages read and write, besides those that have a pointer of their own."""

    memory: Memory  # of the stack, as what follows
    samples: Floats
    history: Floats
    kept: NDArray[np.int64]
    ways: Floats
    room: Floats
    on_highway: Flags
    lines: NDArray[np.uint8]  # LightState at each stop line that the stack knows
    ticks: NDArray[np.int64]  # of the log: tick, supervision, weather
    rows: Floats  # of the log: estimate, applied and requested command, report
    elapsed: Floats  # s for which each light has shown its state
    first: NDArray[np.int64]  # of each group, the light that says when it changes
    limit: Floats  # s after which it does
    stop_lane: NDArray[np.int64]  # of each signal of a light
    stop_s: Floats  # m along that lane
    shown: NDArray[np.uint8]  # LightState there


class Rules(NamedTuple):
    """What holds for all ticks of a call."""

    dt: float  # s
    substeps: int
    weather: int  # number of it in the log
    bumper_first: bool  # of the two cameras
    supervised: bool
    stuck_speed: float  # m/s
    stuck_time: float  # s
    holding: int  # tiers that explain standing, as bits
    reach: float  # m to a light that explains standing
    v_told: float  # m/s
    far: float  # m from the ego up to which vehicles stay; below 0: some wait for room
    stuck: float  # s for which they may stand
    assists: bool  # the stack stops at lights
    hsv_required: bool  # only at those whose lamp it sees


class Joined(NamedTuple):
    """All that the kernel is given, behind one pointer, as each would cost a call 0.4 us."""

    at: Addresses
    rules: Rules
    tables: Tables
    arena: Held[Arena]
    states: Held[ActorStates]
    map: Held[LaneArrays]
    sensors: Held[Common]
    road: Held[RoadParts]
    stack: Held[Parts]
    columns: Held[ActorColumns]
    lines: Held[StopLines]


class Request(NamedTuple):
    """What the stack asks for."""

    throttle: float
    brake: float
    steer: float
    handbrake: bool


class Stop(NamedTuple):
    """Where the kernel came back."""

    ticks: int  # driven to their end
    why: int
    touches: int  # contacts of the step
    crossed: int  # markings as bits
    request: Request  # of the last tick


count_gear = kernel(shown_gear)


@kernel
def is_change_due(t: Tables, dt: float) -> bool:
    """Returns whether a light changes in a step of dt s."""
    due = False
    for g in range(len(t.first)):
        due |= t.elapsed[t.first[g]] + dt + ROUNDING >= t.limit[g]
    return due


@kernel
def is_traffic_due(a: Arena, far: float, stuck: float) -> bool:
    """Returns whether a vehicle that drives itself is farther from the ego, or stands for longer."""
    s, state, due = a.rows.states, a.drivers.state, far < 0.0
    for i in range(len(state)):
        if not state[i].active:
            continue
        dx, dy = s.x[i] - s.x[EGO], s.y[i] - s.y[EGO]
        due |= state[i].stuck > stuck or (s.present[i] and dx * dx + dy * dy > 0.999 * far * far)
    return due


@kernel
def drive_ticks(
    joined: Held[Joined], begun: bool, tick: int, n: int, k: int, grace: int, standing: int,
    throttle: float, brake: float, steer: float, handbrake: bool,
) -> tuple[int, int, int, int, float, float, float, bool, int, float, float, int]:  # fmt: skip
    """Drives up to n ticks after `tick` and writes rows of the log from k on.

    begun: the world has made the step of the first tick already, and stands at `tick`. grace: ticks without
    the detector of an ego that is stuck. standing: ticks for which it stands without a reason. throttle,
    brake, steer, handbrake: of the tick before. Returns ticks that are whole, why it came back, contacts and
    crossed markings of the step, the last request, lane (-1: not looked for), s and offset of the ego, and
    `standing`.
    """
    at, rules, t = joined.value.at, joined.value.rules, joined.value.tables
    arena, states, map, sensors = (
        joined.value.arena, joined.value.states, joined.value.map, joined.value.sensors,
    )  # fmt: skip
    a, eyes = arena.value, sensors.value
    s, commands = a.rows.states, a.rows.commands
    near = eyes.one if rules.bumper_first else eyes.other
    far = eyes.other if rules.bumper_first else eyes.one
    echoes = eyes.around.radar.echoes
    done, why, touches, crossed = 0, DONE, 0, 0
    lane, along, offset, stands = -1, nan, nan, False
    while done < n:
        if not begun:
            commands[EGO, 0], commands[EGO, 1], commands[EGO, 2] = throttle, brake, steer
            commands[EGO, 3], commands[EGO, 4] = 1.0 if handbrake else 0.0, 0.0
            tick += 1
            looks = tick % CHECK_PERIOD == 0
            stages = DECIDE | MOVE if looks else DECIDE | MOVE | SETTLE
            touches, crossed = call(
                at.advance, advance, (arena, stages, tick, rules.dt, rules.substeps, 0.0, 0.0)
            )
            if looks and is_traffic_due(a, rules.far, rules.stuck):
                why = MOVED
                break
            if looks:
                _, crossed = call(
                    at.advance, advance, (arena, SETTLE, tick, rules.dt, rules.substeps, 0.0, 0.0)
                )
            if touches > 0 or crossed or is_change_due(t, rules.dt):
                why = STEPPED
                break
            for i in range(len(t.elapsed)):
                t.elapsed[i] += rules.dt
        begun = False
        if rules.supervised:
            found = call(at.find_ego, find_ego, (map, states))
            usual = found[0] >= 0 and found[4] and found[3] >= WRONG_WAY_DOT
            v2, slow2 = s.vx[EGO] * s.vx[EGO] + s.vy[EGO] * s.vy[EGO], rules.stuck_speed**2
            stands = grace - done - 1 <= 0 and v2 < 1.001 * slow2
            if usual and stands:
                stands = not call(
                    at.has_reason,
                    has_reason,
                    (map, states, t.stop_lane, t.stop_s, t.shown, rules.reach),
                )
            if stands:  # close to the limits the supervisor decides itself
                usual &= v2 < 0.999 * slow2 and (standing + 1) * rules.dt < rules.stuck_time
            if not usual:
                why = UNUSUAL
                break
            lane, along, offset = found[0], found[1], found[2]
        felt = call(at.feel_motion, feel_motion, (arena, EGO))
        x, y, z, yaw, v = felt[0], felt[1], felt[2], felt[5], felt[6]
        m_one, m_other, m_radar = call(at.sense, sense, (sensors, map, tick))
        m_near, m_far = (m_one, m_other) if rules.bumper_first else (m_other, m_one)
        way = call(
            at.read_road,
            read_road,
            (t.memory, joined.value.road, t.on_highway, t.ways, x, y, z, yaw, v, True),
        )
        source, state, there, stop = NONE_AHEAD, -1, nan, nan
        if rules.assists:
            source, ahead, there, stop = call(
                at.heed_light, heed_light,
                (t.memory, joined.value.lines, t.lines, way, rules.hsv_required, v, rules.dt),
            )  # fmt: skip
            if ahead >= 0:
                state = int(t.lines[ahead])
        told = call(
            at.think, think,
            (
                t.memory, joined.value.stack, t.samples, t.history, t.kept, t.ways, t.room,
                near.runs[0, :m_near], near.runs[1, :m_near], near.runs[2, :m_near],
                near.runs[3, :m_near], near.runs[4, :m_near], near.classes[:m_near],
                far.runs[0, :m_far], far.runs[1, :m_far], far.runs[2, :m_far],
                far.runs[3, :m_far], far.runs[4, :m_far], far.classes[:m_far],
                echoes[0, :m_radar], echoes[1, :m_radar], echoes[2, :m_radar], echoes[3, :m_radar],
                t.on_highway, x, y, z, yaw, v, True, stop, inf, rules.v_told,
            ),
        )  # fmt: skip
        throttle, brake, steer, handbrake = told[1], told[2], way[4], told[3]
        fits = 0.0 <= throttle <= 1.0 and 0.0 <= brake <= 1.0 and -1.0 <= steer <= 1.0
        if not fits:
            why = REFUSED
            break
        standing = standing + 1 if stands and not (rules.holding >> told[0]) & 1 else 0
        t.ticks[k, 0], t.ticks[k, 1], t.ticks[k, 2] = tick, 0, rules.weather
        row = t.rows[k]
        row[0], row[1], row[2], row[3] = x, y, yaw, v
        row[4], row[5], row[6] = felt[7], felt[8], felt[9]
        row[7] = count_gear(v, commands[EGO, 4] != 0.0)
        for c in range(5):
            row[APPLIED + c] = commands[EGO, c]
        row[REQUESTED], row[REQUESTED + 1], row[REQUESTED + 2] = throttle, brake, steer
        row[REQUESTED + 3], row[REQUESTED + 4] = 1.0 if handbrake else 0.0, 0.0
        light = source, state, there, stop
        write_report(row, REPORT, told, way, light, rules.assists, rules.dt)
        call(at.copy_actors, copy_actors, (states, a.rows.mu, joined.value.columns, k))
        k += 1
        done += 1
    return (
        done, why, touches, crossed, throttle, brake, steer, handbrake, lane, along, offset,
        standing,
    )  # fmt: skip
