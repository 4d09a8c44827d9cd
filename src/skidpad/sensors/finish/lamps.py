"""Lamps that shine: of vehicles and of traffic lights, where they are and how bright now.

Strengths are chosen by eye; 1 is a white surface at noon. Where lamps sit follows `bodies`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind, Bodywork, LightState
from skidpad.roads.roadside import Box, Shape, SignalHead
from skidpad.sensors.pictures.lighting import Lighting
from skidpad.sensors.scene.street_light import HEIGHT as HEIGHT_OF_STREET_LAMPS

HEAD, TAIL, BRAKE = (1.0, 0.93, 0.78), (0.55, 0.02, 0.02), (1.0, 0.05, 0.03)
SIGNAL = {
    LightState.RED: (1.0, 0.06, 0.04),
    LightState.YELLOW: (1.0, 0.62, 0.05),
    LightState.GREEN: (0.06, 0.95, 0.42),
}
INDICATOR, INDICATOR_POWER = (1.0, 0.42, 0.02), 2.4
HEAD_POWER, TAIL_POWER, BRAKE_POWER, SIGNAL_POWER = 5.0, 1.6, 3.2, 1.2
STREET, STREET_POWER, STREET_SIZE = (1.0, 0.86, 0.60), 1.5, 0.15
STREET_REACH = 160.0  # m from the ego, of street lamps that are drawn shining
BY_DAY = 0.25  # share of the bloom that is left in daylight
HEIGHT = {ActorKind.CAR: 0.40, ActorKind.VAN: 0.31, ActorKind.TRUCK: 0.23, ActorKind.BUS: 0.22}
SHAPED_HEIGHT = {ActorKind.CAR: 0.49, ActorKind.VAN: 0.37, ActorKind.MOTORCYCLE: 0.56}
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
    """Returns all light sources of the parts as one table."""
    return Sources(*(np.concatenate(field) for field in zip(*parts, strict=True)))


class Lamps:
    """All lamps of a run; what shines depends on the moment."""

    def __init__(
        self,
        table: ActorTable,
        heads: Sequence[SignalHead],
        bodywork: Bodywork = Bodywork.PLAIN,
        boxes: Sequence[Box] = (),
    ) -> None:
        """boxes: of what stands beside the road; street lamps among them shine at night."""
        self._street = np.array(
            [(b.x, b.y, b.z) for b in boxes if b.shape is Shape.LAMP], dtype=np.float64
        ).reshape(-1, 3)
        kinds = [ActorKind(int(k)) for k in table.kind]
        shaped = bodywork is Bodywork.SHAPED
        heights, side = (HEIGHT | SHAPED_HEIGHT, 0.37) if shaped else (HEIGHT, 0.32)
        share = np.array([heights.get(k, HEIGHT_OF_OTHERS) for k in kinds], dtype=np.float64)
        self._up = share * table.height
        self._side = np.where([k in TWO for k in kinds], side * table.width, 0.0)
        self._front = 0.5 * table.length
        self._has = np.array([k not in LAMPLESS for k in kinds], dtype=np.bool_)
        self._heads = tuple(heads)

    def shining(
        self,
        states: ActorStates,
        lights: Mapping[int, LightState],
        braking: NDArray[np.bool_],
        indicating: NDArray[np.bool_],
        light: Lighting,
    ) -> Sources:
        """Returns the lamps that shine now, as light sources. indicating: (n, 2), left and right."""
        dark = max(float(light.lamps), BY_DAY)
        on = self._has & states.present
        head = HEAD_POWER * dark if light.lamps > 0.0 or light.wet > WET_DAY else 0.0
        ends = [(-1.0, on & braking, np.multiply(BRAKE, BRAKE_POWER * dark))]
        if head > 0.0:
            ends.append((1.0, on, np.multiply(HEAD, head)))
            ends.append((-1.0, on & ~braking, np.multiply(TAIL, TAIL_POWER * dark)))
        parts = [self._of_signals(lights, SIGNAL_POWER * dark)]
        parts += [self._of_vehicles(states, *end) for end in ends]
        turn = np.multiply(INDICATOR, INDICATOR_POWER * dark)
        for column, side in enumerate((1.0, -1.0)):
            on_side = on & indicating[:, column]
            if on_side.any():
                parts += [
                    self._of_vehicles(states, end, on_side, turn, side) for end in (1.0, -1.0)
                ]
        if light.lamps > 0.0 and len(self._street):
            parts.append(self._of_the_street(states, STREET_POWER * float(light.lamps)))
        return _stack(parts)

    def _of_the_street(self, states: ActorStates, power: float) -> Sources:
        """Returns the street lamps around the ego; each shines to all sides, so it faces the ego."""
        away = self._street - (states.x[0], states.y[0], states.z[0])
        far = np.hypot(away[:, 0], away[:, 1])
        near = far < STREET_REACH
        x, y, z = self._street[near].T
        n = len(x)
        toward = -away[near, :2] / np.maximum(far[near], 1e-6)[:, None]
        colour = np.broadcast_to(np.multiply(STREET, power), (n, 3))
        return Sources(
            x, y, z, z - HEIGHT_OF_STREET_LAMPS, toward[:, 0], toward[:, 1],
            np.full(n, STREET_SIZE), colour,
        )  # fmt: skip

    def _of_vehicles(
        self,
        states: ActorStates,
        end: float,
        on: NDArray[np.bool_],
        lit: Floats,
        only: float = 0.0,
    ) -> Sources:
        """Returns the lamps at one end of those that have them on: on either side, or in the middle.

        end: 1 front, -1 rear; lit: (3,) colour times power; only: 1 for the left side alone, -1 right.
        """
        rows = np.flatnonzero(on)
        one = rows if only else np.concatenate([rows, rows[self._side[rows] > 0.0]])
        side = self._side[one]
        side[len(rows) :] *= -1.0
        if only:
            side *= 1.15 * only
        c, s = np.cos(states.yaw[one]), np.sin(states.yaw[one])
        along, slope = end * self._front[one], np.sin(states.pitch[one])
        ground = states.z[one] - slope * along
        return Sources(
            states.x[one] + c * along - s * side,
            states.y[one] + s * along + c * side,
            ground + self._up[one],
            ground,
            end * c,
            end * s,
            np.full(len(one), 0.11),
            np.broadcast_to(lit, (len(one), 3)),
        )

    def _of_signals(self, lights: Mapping[int, LightState], power: float) -> Sources:
        """Returns the lit lamps of the signal heads as light sources of the given power."""
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
