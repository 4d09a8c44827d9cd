"""A radar with an equation, noise and clutter: what stands out of its cells in one tick."""

from __future__ import annotations

from math import exp, log, sqrt

import numpy as np
from numpy.typing import NDArray

from skidpad.core.frames import RadarPoints
from skidpad.core.jit import Held, hold, inner_kernel, kernel
from skidpad.core.randomness import stream_key
from skidpad.core.specs import RadarSpec
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.weather import Weather
from skidpad.roads.roadside import Roadside
from skidpad.sensors.noise import uniform
from skidpad.sensors.object_level.boxes import group_walls, placed, walls_of
from skidpad.sensors.physical_radar.cells import (
    RANGES,
    SLACK,
    SPEEDS,
    Cells,
    centre,
    clear,
    is_peak,
    make_cells,
    noise_mean,
    normal_pair,
)
from skidpad.sensors.physical_radar.echoes import (
    RadarWorld,
    Sensor,
    add_actors,
    add_sites,
    find_screens,
)
from skidpad.sensors.physical_radar.setup import (
    FASTEST,
    MAX_SPEED,
    RAIN_SPREAD,
    RISE_WIDTH,
    SLOPE,
    RadarSetup,
    setup_of,
)
from skidpad.sensors.physical_radar.targets import sites_of, targets_of

MOST_FOUND = 512


class PhysicalRadar:
    """One radar; `measure` once per tick."""

    def __init__(
        self,
        spec: RadarSpec,
        roadside: Roadside,
        table: ActorTable,
        seed: int,
        weather: Weather | None = None,
    ) -> None:
        """weather: acts on the waves; None: it does not."""
        self.spec, self._key = spec, np.uint64(stream_key(seed, "physical radar", spec.id))
        walls = walls_of(roadside)
        self._world = hold(
            RadarWorld(
                table.length, table.width, table.height, targets_of(table), sites_of(roadside),
                walls, group_walls(walls),
            )
        )  # fmt: skip
        self._cells = hold(make_cells())
        self._out = np.empty((MOST_FOUND, 4), np.float32)
        self.change(weather)

    def change(self, weather: Weather | None) -> None:
        """Weather is another from the next tick on."""
        self.setup = setup_of(self.spec, self._key, weather)
        self._held = hold(self.setup)

    def measure(self, tick: int, states: ActorStates) -> RadarPoints:
        """Detections of this state, valid until the next call; actor 0 carries the radar."""
        count = find_detections(self._held, self._world, self._cells, states, tick, self._out)
        return RadarPoints(*self._out[:count].T)


@kernel
def find_detections(
    held: Held[RadarSetup],
    surroundings: Held[RadarWorld],
    state: Held[Cells],
    states: ActorStates,
    tick: int,
    out: NDArray[np.float32],
) -> int:
    """Write range, azimuth, altitude and range rate of what is found; returns how many."""
    radar, world, cells = held.value, surroundings.value, state.value
    seat = placed(radar.mount, states)
    vx = states.vx[0] - states.yaw_rate[0] * (seat.origin[1] - states.y[0])
    vy = states.vy[0] + states.yaw_rate[0] * (seat.origin[0] - states.x[0])
    speed = np.hypot(vx, vy)
    wet = radar.air.radome[min(int(speed + 0.5), FASTEST - 1)]
    sensor = Sensor(seat.origin, seat.rotation, vx, vy, wet)
    clear(cells)
    screens = find_screens(radar, world, states, seat.origin)
    add_actors(radar, world, cells, states, sensor, screens, tick)
    add_sites(radar, world, cells, states, sensor, screens, tick)
    _add_noise(radar, cells, sensor, tick)
    n = _select(radar, cells, sensor, tick, out)
    return _add_false_alarm(radar, tick, n, out)


@inner_kernel
def _clutter(radar: RadarSetup, sensor: Sensor, distance: int, speed: int, beam: int) -> float:
    """Clutter over noise in a cell: ground where what stands has this Doppler, rain around it."""
    azimuth = (beam - 0.5 * (radar.grid.beams - 1)) * radar.grid.beam_step
    r = sensor.rotation
    c, s = np.cos(azimuth), np.sin(azimuth)
    dx, dy = r[0, 0] * c + r[0, 1] * s, r[1, 0] * c + r[1, 1] * s
    off = abs(speed * radar.grid.speed_step + sensor.vx * dx + sensor.vy * dy)
    power = 0.0
    if off <= radar.grid.speed_step:
        power += radar.air.ground[distance]
    if off <= RAIN_SPREAD:
        power += radar.air.rain[distance]
    return float(power * exp(-8.0 * log(2.0) * (azimuth / radar.wide) ** 2 - sensor.wet))


@inner_kernel
def _bins(number: int) -> tuple[int, int, int]:
    """Range, Doppler and beam of a cell."""
    rest = number // RANGES
    return number % RANGES, rest % SPEEDS - SPEEDS // 2, rest // SPEEDS


@inner_kernel
def _add_noise(radar: RadarSetup, cells: Cells, sensor: Sensor, tick: int) -> None:
    """Noise and clutter of the cells that an echo reached."""
    key = radar.key + np.uint64(1)
    for k in range(cells.reached[0]):
        slot = cells.taken[k]
        distance, speed, beam = _bins(cells.number[slot])
        z, w = normal_pair(key, tick, cells.number[slot])
        rms = sqrt(0.5 * (1.0 + _clutter(radar, sensor, distance, speed, beam)))
        re, im = cells.re[slot] + rms * z, cells.im[slot] + rms * w
        cells.power[slot] = re * re + im * im


@inner_kernel
def _select(
    radar: RadarSetup, cells: Cells, sensor: Sensor, tick: int, out: NDArray[np.float32]
) -> int:
    """Write the peaks that pass the threshold."""
    grid, n = radar.grid, 0
    numbers, powers = cells.number, cells.power
    key = radar.key + np.uint64(2)
    for k in range(cells.reached[0]):
        slot = cells.taken[k]
        power, number = cells.power[slot], cells.number[slot]
        if n == MOST_FOUND or power < SLACK * grid.threshold or not is_peak(numbers, powers, slot):
            continue
        distance, speed, beam = _bins(number)
        clutter = _clutter(radar, sensor, distance, speed, beam)
        if power < grid.threshold * noise_mean(
            numbers, powers, grid.ranges, number, clutter, key, tick
        ):
            continue
        z, _ = normal_pair(key + np.uint64(1), tick, number)
        rise = cells.rise[slot] / cells.weight[slot]
        rise += RISE_WIDTH / (SLOPE * sqrt(2.0 * power / (1.0 + clutter))) * z
        away = beam + centre(numbers, powers, number, SPEEDS * RANGES) - 0.5 * (grid.beams - 1)
        out[n, 0] = (distance + centre(numbers, powers, number, 1)) * grid.range_step
        out[n, 1] = away * grid.beam_step
        out[n, 2] = rise
        out[n, 3] = (speed + centre(numbers, powers, number, RANGES)) * grid.speed_step
        n += 1
    return n


@inner_kernel
def _add_false_alarm(radar: RadarSetup, tick: int, n: int, out: NDArray[np.float32]) -> int:
    """A detection of noise alone, as often as the threshold lets it pass."""
    key = radar.key + np.uint64(4)
    if n == MOST_FOUND or uniform(key, tick, 0) > 1.0 - exp(-radar.false):
        return n
    out[n, 0] = radar.reach * uniform(key, tick, 1)
    out[n, 1] = radar.wide * (uniform(key, tick, 2) - 0.5)
    out[n, 2] = radar.high * (uniform(key, tick, 3) - 0.5)
    out[n, 3] = MAX_SPEED * (2.0 * uniform(key, tick, 4) - 1.0)
    return n + 1
