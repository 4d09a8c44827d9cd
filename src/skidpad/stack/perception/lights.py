"""Traffic lights from the map and their states from the frame (A-155 to A-163, A-168 to A-170)."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, hypot, nan, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import Held, hold, kernel
from skidpad.core.vocabulary import LightSource, LightState
from skidpad.roads.kernels import LaneArrays, advance_kernel
from skidpad.roads.lanes import SignalKind
from skidpad.roads.queries import RoadMap

SCAN_MIN = 80.0  # m
SCAN_TIME = 6.0  # s
COS_AHEAD = 0.2  # of the angle between heading and direction to the light
# Trigger volume: CARLA's are boxes of a few metres about the stop line. m before and behind it.
TRIGGER_BEFORE = 5.0
TRIGGER_BEHIND = 1.0
YELLOW_DECELERATION = 1.5  # m/s^2, a yellow light that needs more is passed (D-070)
LANE_STEP = 0.01  # m beyond a lane's end, to arrive on the next one
MAX_LANES = 64
States = Mapping[int, LightState]  # by signal id


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
        if lane < 0:
            return NO_WAYPOINT
        if trigger >= 0:
            for k in range(trigger, self.lines.start[lane + 1]):
                here, signal = float(self.lines.s[k]) - s, int(self.lines.signal[k])
                state = states.get(signal, LightState.UNKNOWN)
                if -TRIGGER_BEHIND <= here <= TRIGGER_BEFORE and state is not LightState.GREEN:
                    source = LightSource.IMMEDIATE_TRIGGER
                    return LightReading(source, signal, max(here, 0.0), state)
        if line < 0:
            return NO_LIGHT
        signal = int(self.lines.signal[line])
        state = states.get(signal, LightState.UNKNOWN)
        return LightReading(LightSource.MAP_SCAN, signal, distance, state)


class StopRequest(NamedTuple):
    """A stop that the light assist asks for."""

    distance: float  # m along the lane to the stop line


class StopLock:
    """Whether to stop. Once committed, the chosen line is kept until its light lets go (A-169)."""

    def __init__(self, dt: float, hsv_required: bool) -> None:
        self.dt, self.hsv_required = dt, hsv_required
        self.reset()

    def reset(self) -> None:
        """Resets the lock, so that no stop is committed to."""
        self.signal: int | None = None
        self.remaining = 0.0

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
        if self.signal is not None:
            if states.get(self.signal) not in (LightState.RED, LightState.YELLOW):
                self.reset()
            elif light.signal == self.signal and light.distance is not None:
                self.remaining = light.distance
            else:
                self.remaining = max(self.remaining - v * self.dt, 0.0)
        if self.signal is None and light.distance is not None and self._demands(light, v, hsv):
            self.signal, self.remaining = light.signal, light.distance
        return StopRequest(self.remaining) if self.signal is not None else None

    def _demands(self, light: LightReading, v: float, hsv: LightState | None) -> bool:
        """Returns whether the light demands a stop at v in m/s: red, or yellow with room to brake.

        Never where the camera has to agree and does not.
        """
        if self.hsv_required and hsv is not light.state:
            return False
        if light.state is LightState.RED:
            return True
        if light.state is LightState.YELLOW and light.distance is not None:
            return v * v <= 2.0 * YELLOW_DECELERATION * light.distance
        return False
