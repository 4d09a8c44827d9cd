"""Traffic lights: a fixed cycle whose phase is part of the seed (decision M-2)."""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from skidpad.core.randomness import stream
from skidpad.core.vocabulary import LightState
from skidpad.roads.lanes import LaneTable, SignalKind, SignalTable

GREEN_S = 10.0  # CARLA's defaults for green and yellow; red as measured in the published set-up
YELLOW_S = 3.0
RED_S = 32.0
NEVER = 2**62  # ticks
STAGES = np.array([LightState.GREEN, LightState.YELLOW, LightState.RED], dtype=np.uint8)
CYCLE_S = GREEN_S + YELLOW_S + RED_S


class Lights:
    """States of all lights of a map as a function of the tick.

    Lights of one group (a junction) take turns: approaches along one axis share their green, the
    axes follow each other evenly within the cycle, so crossing streams never have green together.
    """

    def __init__(
        self, signals: SignalTable, seed: int, dt: float, lanes: LaneTable | None = None
    ) -> None:
        """lanes: where controllers of one junction are to take turns as one group."""
        if lanes is not None:
            signals = signals._replace(group=_junctions(signals, lanes))
        self.rows = np.flatnonzero(signals.kind == SignalKind.LIGHT)
        self.ids = signals.id[self.rows]
        self._shift = np.round(_offsets(signals, self.rows, seed) / dt).astype(np.int64)
        durations = [round(GREEN_S / dt), round(YELLOW_S / dt), round(RED_S / dt)]
        self._ends = np.cumsum(durations)  # ticks from the start of green
        self.by_row = np.full(len(signals.id), LightState.OFF, dtype=np.uint8)  # (K,) LightState
        self.by_id: dict[int, LightState] = {}
        self._changes = 0  # tick of the next change
        self.update(0)

    def update(self, tick: int) -> None:
        """Set `by_row` and `by_id` to the states of `tick`; ticks must not run backwards."""
        if tick < self._changes:
            return
        phase = (tick + self._shift) % self._ends[-1]
        stage = np.searchsorted(self._ends, phase, side="right")
        self.by_row[self.rows] = STAGES[stage]
        self.by_id = {
            int(i): LightState(int(s))
            for i, s in zip(self.ids, self.by_row[self.rows], strict=True)
        }
        left = self._ends[stage] - phase
        self._changes = tick + int(left.min(initial=NEVER))


def _junctions(signals: SignalTable, lanes: LaneTable) -> NDArray[np.int32]:
    """(K,) the junction behind each signal's lane, else the signal's own group."""
    group: NDArray[np.int32] = signals.group.copy()
    for row, lane in enumerate(signals.lane):
        if lanes.next_start[lane] == lanes.next_start[lane + 1]:
            continue
        junction = lanes.junction[lanes.next_lane[lanes.next_start[lane]]]
        if junction >= 0:
            group[row] = junction
    return group


def _offsets(signals: SignalTable, rows: NDArray[np.intp], seed: int) -> NDArray[np.float64]:
    """Phase of each light row in s: one draw per group, axes of a group spread over the cycle."""
    offset = np.zeros(len(rows))
    axis = np.round((signals.heading[rows] % pi) / (pi / 4.0)).astype(np.int64) % 4
    for i, row in enumerate(rows):
        group = int(signals.group[row])
        alone = group < 0
        name = f"signal {int(signals.id[row])}" if alone else f"group {group}"
        offset[i] = stream(seed, "lights", name).uniform(0.0, CYCLE_S)
        if not alone:
            axes = np.unique(axis[signals.group[rows] == group])
            offset[i] += CYCLE_S * np.searchsorted(axes, axis[i]) / len(axes)
    return offset
