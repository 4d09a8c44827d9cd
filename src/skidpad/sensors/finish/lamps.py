"""Lamps that shine: of vehicles and of traffic lights, where they are and how bright now.

Strengths are chosen by eye; 1 is a white surface at noon. Where lamps sit follows `bodies`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind, LightState
from skidpad.roads.roadside import SignalHead
from skidpad.sensors.lighting import Lighting

Floats = NDArray[np.float64]

HEAD, TAIL, BRAKE = (1.0, 0.93, 0.78), (0.55, 0.02, 0.02), (1.0, 0.05, 0.03)
SIGNAL = {
    LightState.RED: (1.0, 0.06, 0.04),
    LightState.YELLOW: (1.0, 0.62, 0.05),
    LightState.GREEN: (0.06, 0.95, 0.42),
}
HEAD_POWER, TAIL_POWER, BRAKE_POWER, SIGNAL_POWER = 5.0, 1.6, 3.2, 1.2
BY_DAY = 0.25  # share of the bloom that is left in daylight
HEIGHT = {ActorKind.CAR: 0.40, ActorKind.VAN: 0.31, ActorKind.TRUCK: 0.23, ActorKind.BUS: 0.22}
HEIGHT_OF_OTHERS = 0.45  # share of the height at which lamps sit
TWO = (ActorKind.CAR, ActorKind.VAN, ActorKind.TRUCK, ActorKind.BUS)  # lamps on either side
LAMPLESS = (ActorKind.PEDESTRIAN, ActorKind.BICYCLE, ActorKind.PROP)
WET_DAY = 0.5  # of 1: by day lamps are on where the road is wetter


class Sources(NamedTuple):
    """n lamps that shine, arrays of shape (n,) but for the colour."""

    x: Floats
    y: Floats
    z: Floats
    ground: Floats  # height of the road below
    face_x: Floats  # where it shines to, unit
    face_y: Floats
    size: Floats  # m, radius
    colour: Floats  # (n, 3) times its power


def _stack(parts: Sequence[Sources]) -> Sources:
    return Sources(*(np.concatenate(field) for field in zip(*parts, strict=True)))


class Lamps:
    """All lamps of a run; what shines depends on the moment."""

    def __init__(self, table: ActorTable, heads: Sequence[SignalHead]) -> None:
        kinds = [ActorKind(int(k)) for k in table.kind]
        share = np.array([HEIGHT.get(k, HEIGHT_OF_OTHERS) for k in kinds], dtype=np.float64)
        self._up = share * table.height
        self._side = np.where([k in TWO for k in kinds], 0.32 * table.width, 0.0)
        self._front = 0.5 * table.length
        self._has = np.array([k not in LAMPLESS for k in kinds], dtype=np.bool_)
        self._heads = tuple(heads)

    def shining(
        self,
        states: ActorStates,
        lights: Mapping[int, LightState],
        braking: NDArray[np.bool_],
        light: Lighting,
    ) -> Sources:
        """The lamps that shine now."""
        dark = max(float(light.lamps), BY_DAY)
        on = self._has & states.present
        head = HEAD_POWER * dark if light.lamps > 0.0 or light.wet > WET_DAY else 0.0
        parts = [self._of_signals(lights, SIGNAL_POWER * dark)]
        for side in (-1.0, 1.0):
            if head > 0.0:
                lit = np.multiply(HEAD, head)
                parts.append(self._of_vehicles(states, on, 1.0, side, lit))
                dim = np.multiply(TAIL, TAIL_POWER * dark)
                parts.append(self._of_vehicles(states, on & ~braking, -1.0, side, dim))
            lit = np.multiply(BRAKE, BRAKE_POWER * dark)
            parts.append(self._of_vehicles(states, on & braking, -1.0, side, lit))
        return _stack(parts)

    def _of_vehicles(
        self, states: ActorStates, on: NDArray[np.bool_], end: float, side: float, lit: Floats
    ) -> Sources:
        rows = np.flatnonzero(on & ((side > 0.0) | (self._side > 0.0)))
        c, s = np.cos(states.yaw[rows]), np.sin(states.yaw[rows])
        along, left = end * self._front[rows], side * self._side[rows]
        slope = np.sin(states.pitch[rows])
        return Sources(
            states.x[rows] + c * along - s * left,
            states.y[rows] + s * along + c * left,
            states.z[rows] + self._up[rows] - slope * along,
            states.z[rows] - slope * along,
            end * c,
            end * s,
            np.full(len(rows), 0.11),
            np.tile(lit, (len(rows), 1)),
        )

    def _of_signals(self, lights: Mapping[int, LightState], power: float) -> Sources:
        lit = [h for h in self._heads if lights.get(h.signal) in SIGNAL]
        place = [int(lights[h.signal]) for h in lit]
        d = np.array([h.lamp_diameter for h in lit], dtype=np.float64)
        z = np.array([h.z for h in lit], dtype=np.float64)
        heading = np.array([h.heading for h in lit], dtype=np.float64)
        return Sources(
            np.array([h.x for h in lit], dtype=np.float64),
            np.array([h.y for h in lit], dtype=np.float64),
            z + (1 - np.array(place, dtype=np.float64)) * 1.25 * d,
            z - 5.0,  # of a gantry or a mast
            -np.cos(heading),
            -np.sin(heading),
            0.5 * d,
            power * np.array([SIGNAL[lights[h.signal]] for h in lit]).reshape(-1, 3),
        )
