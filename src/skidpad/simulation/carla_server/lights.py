"""Traffic lights: states, groups and timing as CARLA's clients read and set them.

A group is a junction. Its lights that look along one axis share a phase; phases take turns, each
green, then yellow, then red for all.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from math import cos, pi, sin

from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import LightState
from skidpad.roads.lanes import SignalKind
from skidpad.roads.queries import RoadMap

GREEN_S, YELLOW_S, RED_S = 10.0, 3.0, 2.0  # CARLA's default times
AXIS = pi / 4.0  # headings this close belong to one axis
BOX_DEPTH = 1.5  # m, half depth of a trigger volume
BOX_HEIGHT = 1.0  # m, half
SAME_LINE = 10.0  # m along the road within which stop lines of one light are one


@dataclass(slots=True, eq=False)
class Light:
    """One traffic light of the map."""

    signal: int  # OpenDRIVE id
    rows: list[int]  # of the signal table: one per lane that it governs
    group: int
    pose: Pose  # origin at the stop line; x along it, as `get_stop_waypoints` walks
    half_width: float  # m, of the governed lanes
    pole: int = 0  # index within its group
    actor: int = 0
    state: LightState = LightState.RED
    green: float = GREEN_S
    yellow: float = YELLOW_S
    red: float = RED_S
    elapsed: float = 0.0  # s in this state


@dataclass(slots=True)
class Group:
    """The lights of one junction and whose turn it is."""

    id: int
    phases: list[list[Light]] = field(default_factory=list)
    turn: int = 0
    frozen: bool = False

    def lights(self) -> Iterable[Light]:
        """All of them."""
        return (light for phase in self.phases for light in phase)

    def reset(self) -> None:
        """The first phase has green, all timers start anew."""
        self.turn = 0
        for i, phase in enumerate(self.phases):
            for light in phase:
                _show(light, LightState.GREEN if i == 0 else LightState.RED)

    def advance(self, dt: float) -> bool:
        """Time passes; True when a lamp changed."""
        changed = False
        for light in self.lights():
            light.elapsed += dt
        if self.frozen or not self.phases:
            return False
        phase = self.phases[self.turn]
        first = phase[0]
        if first.state is LightState.GREEN and first.elapsed >= first.green:
            changed = _show_all(phase, LightState.YELLOW)
        elif first.state is LightState.YELLOW and first.elapsed >= first.yellow:
            changed = _show_all(phase, LightState.RED)
        elif first.state is LightState.RED and first.elapsed >= first.red:
            self.turn = (self.turn + 1) % len(self.phases)
            changed = _show_all(self.phases[self.turn], LightState.GREEN)
        return changed


def _show(light: Light, state: LightState) -> None:
    light.state, light.elapsed = state, 0.0


def _show_all(phase: list[Light], state: LightState) -> bool:
    for light in phase:
        _show(light, state)
    return True


class LightControl:
    """All lights of a map."""

    def __init__(self, roads: RoadMap) -> None:
        self.lights = _lights(roads)
        self.by_row = {row: light for light in self.lights for row in light.rows}
        self.groups = _groups(self.lights)
        self.all_frozen = False

    def advance(self, dt: float) -> bool:
        """Time passes; True when a lamp changed."""
        if self.all_frozen:
            for light in self.lights:
                light.elapsed += dt
            return False
        changes = [group.advance(dt) for group in self.groups.values()]
        return any(changes)

    def set_state(self, light: Light, state: LightState) -> None:
        """A client sets one lamp; its group's clock goes on from there."""
        _show(light, state)
        group = self.groups[light.group]
        for i, phase in enumerate(group.phases):
            if light in phase and state is not LightState.RED:
                group.turn = i

    def phase_of(self, light: Light) -> list[Light]:
        """The lights that change together with this one; they share their times."""
        phases = self.groups[light.group].phases
        return next(phase for phase in phases if light in phase)

    def frozen(self, light: Light) -> bool:
        """Whether its time stands still."""
        return self.all_frozen or self.groups[light.group].frozen

    def reset(self) -> None:
        """All groups from the beginning."""
        for group in self.groups.values():
            group.reset()


def _lights(roads: RoadMap) -> list[Light]:
    signals = roads.signals
    by_id: dict[int, list[int]] = {}
    for row in range(len(signals.id)):
        if signals.kind[row] == SignalKind.LIGHT:
            by_id.setdefault(int(signals.id[row]), []).append(row)
    return [_light(roads, rows) for rows in by_id.values()]


def _light(roads: RoadMap, rows: list[int]) -> Light:
    """The light whose stop line crosses the lanes of these rows."""
    signals = roads.signals
    places = [roads.at(int(signals.lane[row]), float(signals.s[row])) for row in rows]
    middle = places[len(places) // 2].pose
    c, s = cos(middle.yaw), sin(middle.yaw)
    left = right = 0.0
    for p in places:
        along = (p.x - middle.x) * c + (p.y - middle.y) * s
        across = (p.y - middle.y) * c - (p.x - middle.x) * s
        if abs(along) < SAME_LINE and cos(p.heading - middle.yaw) > 0.5:
            left = max(left, across + p.width / 2.0)
            right = min(right, across - p.width / 2.0)
    centre = middle.moved(left=(left + right) / 2.0)
    group, id = int(signals.group[rows[0]]), int(signals.id[rows[0]])
    along_line = Pose(centre.x, centre.y, centre.z, yaw=centre.yaw - pi / 2.0)
    return Light(id, rows, group if group >= 0 else -1 - id, along_line, (left - right) / 2.0)


def _groups(lights: list[Light]) -> dict[int, Group]:
    groups: dict[int, Group] = {}
    for light in lights:
        group = groups.setdefault(light.group, Group(light.group))
        light.pole = sum(1 for _ in group.lights())
        axis = round((light.pose.yaw % pi) / AXIS) % 4
        for phase in group.phases:
            if round((phase[0].pose.yaw % pi) / AXIS) % 4 == axis:
                phase.append(light)
                break
        else:
            group.phases.append([light])
    for group in groups.values():
        group.reset()
    return groups
