"""Traffic lights from the map and their states from the frame (A-155 to A-163, A-168 to A-170)."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, hypot, sin
from typing import NamedTuple

from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import LightSource, LightState
from skidpad.roads.lanes import SignalKind
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.stack.perception.lane_view import LaneView

SCAN_MIN = 80.0  # m
SCAN_TIME = 6.0  # s
COS_AHEAD = 0.2  # of the angle between heading and direction to the light
# Trigger volume: CARLA's are boxes of a few metres about the stop line. m before and behind it.
TRIGGER_BEFORE = 5.0
TRIGGER_BEHIND = 1.0
YELLOW_DECELERATION = 1.5  # m/s^2, a yellow light that needs more is passed (D-070)
LANE_STEP = 0.01  # m beyond a lane's end, to arrive on the next one
MAX_LANES = 64


class StopLine(NamedTuple):
    """One light as it governs one lane."""

    s: float  # m along the lane
    signal: int
    x: float  # of the signal head, world frame
    y: float


class LightReading(NamedTuple):
    """The light ahead; distance in m along the lane to its stop line, None: no light."""

    source: LightSource
    signal: int | None = None
    distance: float | None = None
    state: LightState | None = None


NO_LIGHT = LightReading(LightSource.NO_LIGHT)
NO_WAYPOINT = LightReading(LightSource.NO_WAYPOINT)


def scan_distance(v: float) -> float:
    """Returns how far ahead lights are looked for in m, at v in m/s (eq. 16)."""
    return max(SCAN_MIN, SCAN_TIME * v)


def stop_lines(map: RoadMap) -> dict[int, tuple[StopLine, ...]]:
    """Returns the stop lines of lights by lane index, in driving order (A-162).

    Lanes without are left out.
    """
    signals = map.signals
    lines: dict[int, list[StopLine]] = {}
    for i in range(len(signals.id)):
        if signals.kind[i] == SignalKind.LIGHT:
            line = StopLine(
                float(signals.s[i]), int(signals.id[i]), float(signals.x[i]), float(signals.y[i])
            )
            lines.setdefault(int(signals.lane[i]), []).append(line)
    return {lane: tuple(sorted(found)) for lane, found in lines.items()}


class LightScan:
    """Finds the next light on the walked lane; any stop line counts (M-5)."""

    def __init__(self, map: RoadMap) -> None:
        self.map = map
        self.lines = stop_lines(map)

    def look(
        self, pose: Pose, v: float, view: LaneView, states: Mapping[int, LightState]
    ) -> LightReading:
        """Returns the light that governs the ego at `pose` with speed v (m/s).

        NO_LIGHT for none, NO_WAYPOINT off every lane. states: by signal id, a missing one is UNKNOWN.
        """
        if view.ego is None:
            return NO_WAYPOINT
        if not self.lines:
            return NO_LIGHT
        return self._triggering_light(view.ego, states) or self._walk(pose, v, view.ego, states)

    def _triggering_light(
        self, ego: LanePoint, states: Mapping[int, LightState]
    ) -> LightReading | None:
        """Returns the reading of a light, not green, at the ego on its own lane; None where there is none."""
        for line in self.lines.get(ego.lane, ()):
            distance = line.s - ego.s
            state = states.get(line.signal, LightState.UNKNOWN)
            if -TRIGGER_BEHIND <= distance <= TRIGGER_BEFORE and state is not LightState.GREEN:
                return LightReading(
                    LightSource.IMMEDIATE_TRIGGER, line.signal, max(distance, 0.0), state
                )
        return None

    def _walk(
        self, pose: Pose, v: float, ego: LanePoint, states: Mapping[int, LightState]
    ) -> LightReading:
        """Returns the first light ahead along the lanes within the scan distance; NO_LIGHT where none is."""
        reach = scan_distance(v)
        here, start = ego, -ego.s  # start: of lane `here`, m from the ego
        for _ in range(MAX_LANES):
            for line in self.lines.get(here.lane, ()):
                distance = start + line.s
                if 0.0 <= distance <= reach and _is_ahead(pose, line):
                    state = states.get(line.signal, LightState.UNKNOWN)
                    return LightReading(LightSource.MAP_SCAN, line.signal, distance, state)
            length = float(self.map.lanes.length[here.lane])
            start += length
            onward = self.map.ahead(here, length - here.s + LANE_STEP)
            if start > reach or onward is None:
                break
            here = onward
        return NO_LIGHT


def _is_ahead(pose: Pose, line: StopLine) -> bool:
    """Returns whether a stop line lies ahead of the pose within the angle of COS_AHEAD."""
    dx, dy = line.x - pose.x, line.y - pose.y
    return dx * cos(pose.yaw) + dy * sin(pose.yaw) > COS_AHEAD * hypot(dx, dy)


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
        states: Mapping[int, LightState],
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
