"""Traffic lights from the map and their states from the frame (A-155 to A-163, A-168 to A-170)."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, hypot, isnan, nan, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import Held, hold, kernel
from skidpad.core.vocabulary import LightSource, LightState
from skidpad.roads.along import advance_kernel
from skidpad.roads.kernels import LaneArrays
from skidpad.roads.lanes import SignalKind
from skidpad.roads.queries import RoadMap
from skidpad.stack.memory import Memory, new_memory

SCAN_MIN = 80.0  # m
SCAN_TIME = 6.0  # s
COS_AHEAD = 0.2  # of the angle between heading and direction to the light
# Trigger volume: CARLA's are boxes of a few metres about the stop line. m before and behind it.
TRIGGER_BEFORE = 5.0
TRIGGER_BEHIND = 1.0
YELLOW_DECELERATION = 1.5  # m/s^2, a yellow light that needs more is passed (D-070)
LANE_STEP = 0.01  # m beyond a lane's end, to arrive on the next one
MAX_LANES = 64
# numbers of words, as kernels have them
RED, YELLOW, GREEN, UNKNOWN = map(
    int, (LightState.RED, LightState.YELLOW, LightState.GREEN, LightState.UNKNOWN)
)
NONE_AHEAD, AT_TRIGGER, BY_SCAN, OFF_LANES = map(int, LightSource)
NOT_SEEN = -1  # in place of the LightState that a camera sees
States = Mapping[int, LightState]  # by signal id
Way = tuple[int, float, float, float, float, int, int, float]  # what `read_road` returns


class StopLines(NamedTuple):
    """Stop lines of lights as they govern lanes, by lane and in driving order (A-162)."""

    start: NDArray[np.int64]  # (lanes + 1,) lines of lane i: rows start[i] to start[i + 1]
    s: Floats  # m along the lane
    signal: NDArray[np.int64]
    x: Floats  # of the signal head, world frame
    y: Floats


class LightReading(NamedTuple):
    """The light ahead; distance in m along the lane to its stop line, None: no light."""

    source: LightSource
    signal: int | None = None
    distance: float | None = None
    state: LightState | None = None


NO_LIGHT = LightReading(LightSource.NO_LIGHT)
NO_WAYPOINT = LightReading(LightSource.NO_WAYPOINT)


@kernel
def scan_distance(v: float) -> float:
    """Returns how far ahead lights are looked for in m, at v in m/s (eq. 16)."""
    return max(SCAN_MIN, SCAN_TIME * v)


def stop_lines(map: RoadMap) -> StopLines:
    """Returns the stop lines of a map's lights."""
    signals = map.signals
    chosen = np.flatnonzero(signals.kind == SignalKind.LIGHT)
    rows = chosen[np.lexsort((signals.id[chosen], signals.s[chosen], signals.lane[chosen]))]
    start = np.searchsorted(signals.lane[rows], np.arange(len(map.lanes.road) + 1))
    signal = signals.id[rows].astype(np.int64)
    return StopLines(start, signals.s[rows], signal, signals.x[rows], signals.y[rows])


@kernel
def find_trigger(lines: StopLines, lane: int, s: float) -> int:
    """Returns the first line of a lane whose trigger volume holds the place at s (A-157); -1: none."""
    for k in range(lines.start[lane], lines.start[lane + 1]):
        if -TRIGGER_BEHIND <= lines.s[k] - s <= TRIGGER_BEFORE:
            return k
    return -1


@kernel
def find_light(
    a: LaneArrays, lines: StopLines, lane: int, s: float, x: float, y: float, yaw: float, v: float
) -> tuple[int, float]:
    """Returns the first line ahead along the lanes within the scan distance, and the m to it; -1: none.

    lane, s: where the ego is; x, y, yaw: its pose; v: m/s (A-156, A-158).
    """
    reach, start = scan_distance(v), -s  # start: of the lane, m from the ego
    for _ in range(MAX_LANES):
        for k in range(lines.start[lane], lines.start[lane + 1]):
            distance = start + lines.s[k]
            if 0.0 <= distance <= reach and is_ahead(lines, k, x, y, yaw):
                return k, distance
        length = a.length[lane]
        start += length
        lane, s = advance_kernel(a, lane, s, length - s + LANE_STEP, nan)
        if start > reach or lane < 0:
            break
    return -1, nan


@kernel
def is_ahead(lines: StopLines, k: int, x: float, y: float, yaw: float) -> bool:
    """Returns whether a line's light lies ahead of the pose within the angle of COS_AHEAD (A-159)."""
    dx, dy = lines.x[k] - x, lines.y[k] - y
    return bool(dx * cos(yaw) + dy * sin(yaw) > COS_AHEAD * hypot(dx, dy))


@kernel
def scan_lights(
    map: Held[LaneArrays], lines: Held[StopLines], lane: int, s: float, x: float, y: float, yaw: float,
    v: float,
) -> tuple[int, int, float]:  # fmt: skip
    """Returns what `find_trigger` and `find_light` find; -1, -1 and NaN off every lane."""
    if lane < 0:
        return -1, -1, nan
    line, distance = find_light(map.value, lines.value, lane, s, x, y, yaw, v)
    return find_trigger(lines.value, lane, s), line, distance


class LightScan:
    """Finds the next light on the walked lane; any stop line counts (M-5)."""

    UNSAVED = ("lines", "held")  # of the map

    def __init__(self, map: RoadMap) -> None:
        self.lines = stop_lines(map)
        self.held = hold(self.lines)

    def look(
        self, map: RoadMap, pose: Pose, v: float, lane: int, s: float, states: States
    ) -> LightReading:
        """Returns the light that governs the ego at `pose`, which is at s of a lane (-1: none), at v m/s."""
        found = scan_lights(map.held, self.held, lane, s, pose.x, pose.y, pose.yaw, v)
        return self.name_light(lane, s, *found, states)

    def name_light(
        self, lane: int, s: float, trigger: int, line: int, distance: float, states: States
    ) -> LightReading:
        """Returns the light that governs the ego at s of a lane, by `find_trigger` and `find_light`.

        NO_LIGHT for none, NO_WAYPOINT off every lane. states: by signal id, a missing one is UNKNOWN.
        """
        if lane >= 0 and trigger < 0 and line < 0:
            return NO_LIGHT
        shown = self.show(states)
        source, k, there = choose_light(self.held, shown, lane, s, trigger, line, distance)
        if k < 0:
            return LightReading(LightSource(source))
        signal, state = int(self.lines.signal[k]), LightState(shown[k])
        return LightReading(LightSource(source), signal, there, state)

    def show(self, states: States) -> NDArray[np.uint8]:
        """Returns the LightState of each stop line; a missing one is UNKNOWN."""
        signals = self.lines.signal.tolist()
        return np.array([states.get(id, LightState.UNKNOWN) for id in signals], dtype=np.uint8)


@kernel
def choose_light(
    held: Held[StopLines], shown: NDArray[np.uint8], lane: int, s: float, trigger: int, line: int,
    distance: float,
) -> tuple[int, int, float]:  # fmt: skip
    """Returns the LightSource, the line (-1: none) and the m to it that govern the ego at s of a lane.

    shown: LightState of each line; trigger, line, distance: of `find_trigger` and `find_light`.
    """
    lines = held.value
    if lane < 0:
        return OFF_LANES, -1, nan
    if trigger >= 0:
        for k in range(trigger, lines.start[lane + 1]):
            here = lines.s[k] - s
            if -TRIGGER_BEHIND <= here <= TRIGGER_BEFORE and shown[k] != GREEN:
                return AT_TRIGGER, k, max(here, 0.0)
    if line < 0:
        return NONE_AHEAD, -1, nan
    return BY_SCAN, line, distance


class StopRequest(NamedTuple):
    """A stop that the light assist asks for."""

    distance: float  # m along the lane to the stop line


class StopLock:
    """Whether to stop. Once committed, the chosen line is kept until its light lets go (A-169).

    memory: of the stack, where the lock is kept.
    """

    def __init__(self, dt: float, hsv_required: bool, memory: Memory | None = None) -> None:
        self.dt, self.hsv_required = dt, hsv_required
        self.memory = new_memory() if memory is None else memory
        self.reset()

    @property
    def signal(self) -> int | None:
        """The light at whose line the stack stops; None: at none."""
        m = self.memory[0]
        return int(m["stop_signal"]) if m["stops"] else None

    def reset(self) -> None:
        """Resets the lock, so that no stop is committed to."""
        m = self.memory[0]
        m["stops"], m["stop_signal"], m["stop_left"] = False, 0, 0.0

    def update(
        self,
        light: LightReading,
        v: float,
        states: States,
        hsv: LightState | None,
    ) -> StopRequest | None:
        """Returns the stop asked for in this tick, None for none; call it once per tick.

        hsv: what the camera saw, None: nothing or not evaluated. v: m/s.
        """
        signal, there, distance, state = self.signal, -1, nan, LightState.UNKNOWN
        if light.signal is not None and light.distance is not None and light.state is not None:
            there, distance, state = light.signal, light.distance, light.state
        kept = LightState.UNKNOWN if signal is None else states.get(signal, LightState.UNKNOWN)
        seen = NOT_SEEN if hsv is None else int(hsv)
        left = lock_stop(
            self.memory, int(kept), there, distance, int(state), seen, self.hsv_required, v, self.dt
        )
        return None if left != left else StopRequest(left)


@kernel
def lock_stop(
    memory: Memory, kept: int, signal: int, distance: float, state: int, hsv: int,
    hsv_required: bool, v: float, dt: float,
) -> float:  # fmt: skip
    """Returns the m to the line at which to stop, NaN for none, and keeps it in memory (A-169).

    kept: LightState at the line of the tick before; signal, distance, state: of the light ahead, NaN m
    for none; hsv: LightState that the camera saw, or NOT_SEEN.
    """
    m = memory[0]
    there = not isnan(distance)
    if m.stops:
        if kept != RED and kept != YELLOW:
            m.stops = False
        elif there and signal == m.stop_signal:
            m.stop_left = distance
        else:
            m.stop_left = max(m.stop_left - v * dt, 0.0)
    if not m.stops and there and demands_stop(distance, state, hsv, hsv_required, v):
        m.stops, m.stop_signal, m.stop_left = True, signal, distance
    return m.stop_left if m.stops else nan


@kernel
def demands_stop(distance: float, state: int, hsv: int, hsv_required: bool, v: float) -> bool:
    """Returns whether the light demands a stop at v in m/s: red, or yellow with room to brake.

    Never where the camera has to agree and does not.
    """
    if hsv_required and hsv != state:
        return False
    if state == YELLOW:
        return v * v <= 2.0 * YELLOW_DECELERATION * distance
    return state == RED


@kernel
def heed_light(
    memory: Memory, lines: Held[StopLines], shown: NDArray[np.uint8], way: Way, hsv_required: bool,
    v: float, dt: float,
) -> tuple[int, int, float, float]:  # fmt: skip
    """Returns what `choose_light` does where no lamp is seen, and the m of `lock_stop`.

    way: of `read_road`.
    """
    m, held = memory[0], lines.value
    lane, trigger, line, distance = way[0], way[5], way[6], way[7]
    source, k, there = choose_light(lines, shown, lane, m.s, trigger, line, distance)
    kept = UNKNOWN
    if m.stops:
        for i in range(len(held.signal)):
            if held.signal[i] == m.stop_signal:
                kept = int(shown[i])
                break
    signal = held.signal[k] if k >= 0 else -1
    state = int(shown[k]) if k >= 0 else UNKNOWN
    left = lock_stop(memory, kept, signal, there, state, NOT_SEEN, hsv_required, v, dt)
    return source, k, there, left
