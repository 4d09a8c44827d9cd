"""Traffic lights: groups whose phases take turns, each green, then yellow, then red for all.

A group is a junction. Its phases are those of the file's controllers, else of its arms, so crossing
streams never have green together. Of a controller with facing arms each arm may get its own turn:
left-turners of CARLA's Traffic Manager else block each other for good.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from math import inf, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.maths.randomness import stream
from skidpad.core.vocabulary import LightState
from skidpad.roads.lanes import SignalKind
from skidpad.roads.queries import RoadMap

GREEN_S, YELLOW_S, RED_S = 10.0, 3.0, 2.0  # CARLA's default times; red: for all, before the next
CYCLE_S = 45.0  # of a pretimed group: green, yellow and 32 s of red as measured by the publication
SECTOR = pi / 4.0  # headings this close belong to one arm
ROUNDING = 1e-6  # s by which summed steps may fall short


@dataclass(slots=True, eq=False)
class Light:
    """One traffic light of the map."""

    signal: int  # OpenDRIVE id
    rows: tuple[int, ...]  # of the signal table: one per lane that it governs
    group: int
    state: LightState = LightState.RED
    green: float = GREEN_S
    yellow: float = YELLOW_S
    red: float = RED_S
    elapsed: float = 0.0  # s in this state

    @property
    def limit(self) -> float:
        """The s for which it shows its state while it is its phase's turn; inf where that never ends."""
        times = {LightState.GREEN: self.green, LightState.YELLOW: self.yellow}
        return self.red if self.state is LightState.RED else times.get(self.state, inf)

    def show(self, state: LightState, elapsed: float = 0.0) -> None:
        """Sets the light's state and the time in s for which it has shown it."""
        self.state, self.elapsed = state, elapsed


@dataclass(slots=True)
class Group:
    """The lights of one junction and whose turn it is."""

    id: int
    phases: list[list[Light]] = field(default_factory=list)
    turn: int = 0
    frozen: bool = False

    def lights(self) -> Iterable[Light]:
        """Returns all lights of the group, phase by phase."""
        return (light for phase in self.phases for light in phase)

    def reset(self) -> None:
        """Gives the first phase green; all timers start anew."""
        self.begin(0, LightState.GREEN, 0.0)

    def begin(self, turn: int, state: LightState, elapsed: float) -> None:
        """Sets phase `turn` as in `state` since `elapsed` s, all others as red."""
        self.turn = turn
        for i, phase in enumerate(self.phases):
            for light in phase:
                light.show(state if i == turn else LightState.RED, elapsed)

    def advance(self, dt: float) -> bool:
        """Lets dt s pass and returns whether a lamp changed; frozen, only the timers go on."""
        for phase in self.phases:
            for light in phase:
                light.elapsed += dt
        if self.frozen:
            return False
        phase = self.phases[self.turn]
        first = phase[0]
        if first.elapsed + ROUNDING < first.limit:
            return False
        if first.state is LightState.GREEN:
            return _show_all(phase, LightState.YELLOW)
        if first.state is LightState.YELLOW:
            return _show_all(phase, LightState.RED)
        self.turn = (self.turn + 1) % len(self.phases)
        return _show_all(self.phases[self.turn], LightState.GREEN)


def _show_all(phase: list[Light], state: LightState) -> bool:
    """Shows the state on all lights of a phase and returns True."""
    for light in phase:
        light.show(state)
    return True


class Clocks(NamedTuple):
    """The times of all lights as arrays."""

    elapsed: NDArray[np.float64]  # (lights,) s for which each has shown its state
    first: NDArray[np.int64]  # (groups,) the light that decides when its group changes
    limit: NDArray[np.float64]  # (groups,) s at which it does; inf: never


class Lights:
    """All lights of a map; `by_row` and `by_id` are what they show."""

    def __init__(self, map: RoadMap, arms: bool = False) -> None:
        """arms: no two arms of a junction have green together, whatever the file's controllers say."""
        signals = map.signals
        self.rows = np.flatnonzero(signals.kind == SignalKind.LIGHT)
        self.by_row = np.full(len(signals.id), LightState.OFF, dtype=np.uint8)  # (K,) LightState
        self.by_id: dict[int, LightState] = {}
        self.groups = _groups(map, self.rows, arms)
        self.lights = [light for group in self.groups.values() for light in group.lights()]
        self.of_row = {row: light for light in self.lights for row in light.rows}
        self.frozen = False  # all of them
        self.reset()

    @classmethod
    def build_pretimed(cls, map: RoadMap, seed: int, dt: float) -> Lights:
        """Returns a map's lights with the published cycle, whose position the seed draws (decision M-2)."""
        lights = cls(map)
        for group in lights.groups.values():
            n = len(group.phases)
            share = max(CYCLE_S / n, GREEN_S + YELLOW_S + RED_S)  # four arms need a longer cycle
            for light in group.lights():
                light.red = max(share - GREEN_S - YELLOW_S, 0.0)
            alone = group.id < 0
            name = f"signal {group.phases[0][0].signal}" if alone else f"group {group.id}"
            at = stream(seed, "lights", name).uniform(0.0, n * share)
            ticks = round(at / dt) % round(n * share / dt)
            turn = min(int(ticks * dt / share + ROUNDING), n - 1)
            _set_clock(group, turn, ticks * dt - turn * share)
        lights._show()
        return lights

    def advance(self, dt: float) -> bool:
        """Lets dt s pass and returns whether a lamp changed; frozen, only the timers go on."""
        if self.frozen:
            for light in self.lights:
                light.elapsed += dt
            return False
        changed = False
        for group in self.groups.values():
            changed |= group.advance(dt)
        if changed:
            self._show()
        return changed

    def clocks(self) -> Clocks:
        """Returns the time for which each light has shown its state, and when the groups change."""
        place = {id(light): i for i, light in enumerate(self.lights)}
        first = [group.phases[group.turn][0] for group in self.groups.values()]
        held = [self.frozen or group.frozen for group in self.groups.values()]
        return Clocks(
            np.array([light.elapsed for light in self.lights]),
            np.array([place[id(light)] for light in first], dtype=np.int64),
            np.array([inf if h else light.limit for h, light in zip(held, first, strict=True)]),
        )

    def set_clocks(self, elapsed: NDArray[np.float64]) -> None:
        """Sets the s for which each light has shown its state."""
        for light, time in zip(self.lights, elapsed.tolist(), strict=True):
            light.elapsed = time

    def set_state(self, light: Light, state: LightState) -> None:
        """Sets one lamp; its group's clock goes on from there. Other lamps stay."""
        self.restore([(light, state, 0.0, self.groups[light.group].frozen)])

    def hold(self, held: Iterable[tuple[int, LightState]]) -> None:
        """Sets lights, by signal id, to states that they keep; unknown ids are ignored.

        The cycle of their junctions ends: the other lights there are red until they are held, too.
        """
        by_signal = {light.signal: light for light in self.lights}
        for signal, state in held:
            light = by_signal.get(signal)
            if light is None:
                continue
            group = self.groups[light.group]
            if not group.frozen:
                group.frozen = True
                _show_all(list(group.lights()), LightState.RED)
            if light.state is not state:
                light.show(state)
        self._show()

    def restore(self, shown: Iterable[tuple[Light, LightState, float, bool]]) -> None:
        """Sets lights as a recording shows them: state, s in it, whether the group stands still.

        The cycle of a group goes on from the light that is not red.
        """
        for light, state, elapsed, frozen in shown:
            light.show(state, elapsed)
            group = self.groups[light.group]
            group.frozen = frozen
            for i, phase in enumerate(group.phases):
                if light in phase and state is not LightState.RED:
                    group.turn = i
        self._show()

    def phase_of(self, light: Light) -> list[Light]:
        """Returns the lights that change together with this one, itself included; they share their times."""
        return next(phase for phase in self.groups[light.group].phases if light in phase)

    def is_frozen(self, light: Light) -> bool:
        """Returns whether the cycle of the light's group stands still."""
        return self.frozen or self.groups[light.group].frozen

    def reset(self, group: Group | None = None) -> None:
        """Starts a group from the beginning; None: all."""
        for each in self.groups.values() if group is None else (group,):
            each.reset()
        self._show()

    def _show(self) -> None:
        """Copies the states of all lights into the tables by row and by id."""
        for light in self.lights:
            self.by_row[list(light.rows)] = light.state
        self.by_id = {light.signal: light.state for light in self.lights}


def _set_clock(group: Group, turn: int, elapsed: float) -> None:
    """Sets a group's lights as `elapsed` s after phase `turn` got green."""
    elapsed += ROUNDING
    if elapsed < GREEN_S:
        group.begin(turn, LightState.GREEN, elapsed - ROUNDING)
    elif elapsed < GREEN_S + YELLOW_S:
        group.begin(turn, LightState.YELLOW, elapsed - GREEN_S - ROUNDING)
    else:
        group.begin(turn, LightState.RED, elapsed - GREEN_S - YELLOW_S - ROUNDING)


def _groups(map: RoadMap, rows: NDArray[np.intp], arms: bool) -> dict[int, Group]:
    """Returns lights by junction, in phases; a light without a junction is with those of its controller.

    A light without either is a group of its own, of id -1 - signal.
    """
    signals = map.signals
    by_id: dict[int, list[int]] = {}
    for row in rows.tolist():
        by_id.setdefault(int(signals.id[row]), []).append(row)
    phases: dict[int, dict[tuple[int, int, int], list[Light]]] = {}
    for id, governed in by_id.items():
        row = governed[0]
        junction, controller = _junction(map, row), int(signals.group[row])
        group = junction if junction >= 0 else controller
        light = Light(id, tuple(governed), group if group >= 0 else -1 - id)
        phase = _phase(junction, controller, float(signals.heading[row]), arms)
        phases.setdefault(light.group, {}).setdefault(phase, []).append(light)
    return {id: Group(id, [found[key] for key in sorted(found)]) for id, found in phases.items()}


def _phase(junction: int, controller: int, heading: float, arms: bool) -> tuple[int, int, int]:
    """Returns a key that lights of one junction share whose green comes together.

    It is the controller that the file names, if asked for only on one arm; without one the arm, as
    left-turners of facing arms would block each other. Away from junctions nothing crosses: one
    phase per axis.
    """
    named = junction >= 0 and controller >= 0 and controller != junction
    turn = pi if junction < 0 else 2.0 * pi
    arm = round((heading % turn) / SECTOR) % round(turn / SECTOR)
    return (0, controller, arm if arms else 0) if named else (1, arm, 0)


def _junction(map: RoadMap, row: int) -> int:
    """Returns the junction in which a signal's lane lies, or into which it leads; -1: none."""
    lanes, lane = map.lanes, int(map.signals.lane[row])
    following = map.successors(lane)[:1]
    return next((j for j in lanes.junction[[lane, *following]].tolist() if j >= 0), -1)
