"""What the kernel that drives many ticks is given, and why it comes back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Flags, Floats
from skidpad.core.kernels.jit import Held
from skidpad.core.states import ActorStates
from skidpad.envelope.govern_kernel import (
    EnvelopeParts,
)
from skidpad.recording.run.ticks import ActorColumns
from skidpad.roads.kernels import LaneArrays
from skidpad.sensors.object_level.objects import Common
from skidpad.simulation.world.step import Arena
from skidpad.stack.memory import Memory
from skidpad.stack.perception.lights import StopLines
from skidpad.stack.road import RoadParts
from skidpad.stack.think import Parts

# why the kernel came back
DONE = 0  # all ticks that were asked for are driven
MOVED = 1  # actors have moved, and Python is to look after the traffic before they settle
STEPPED = 2  # the world has made its step, in which something happened
UNUSUAL = 3  # the tick has begun, and the supervisor may have something to do in it
REFUSED = 4  # the stack's command is out of range
ARRIVED = 5  # the ego has come to the end of its way
TOLD = 6  # the story of a scenario goes on in Python


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
    find_limits: int
    keep_inside: int
    play_tick: int


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
    way: Floats  # (n, 3) places of the ego's way; n = 0: it has no end
    reached: NDArray[np.int64]  # (1,) index of the furthest one that it came by


class Rules(NamedTuple):
    """What holds for all ticks of a call."""

    dt: float  # s
    substeps: int
    moving: int  # stages of a step of the world before actors settle
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
    stage: int  # of the rain sensor, where an envelope governs the stack
    is_cold: bool  # by the thermometer, likewise


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
    inside: Held[EnvelopeParts] | None  # of the envelope that governs the stack; None: none does


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
