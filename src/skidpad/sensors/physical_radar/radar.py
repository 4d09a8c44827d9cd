"""A radar with an equation, noise and clutter: what stands out of its cells in one tick."""

from __future__ import annotations

from math import exp, log, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.frames import RadarObjects, RadarPoints, RadarTracks
from skidpad.core.kernels.jit import Held, hold, inner_kernel, kernel
from skidpad.core.maths.randomness import stream_key
from skidpad.core.setup import DT
from skidpad.core.specs import RadarSpec
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import RadarOutput
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
from skidpad.sensors.physical_radar.ghosts import add_ghosts
from skidpad.sensors.physical_radar.interference import add_interference
from skidpad.sensors.physical_radar.lists import POWER, add_sections, join_rows
from skidpad.sensors.physical_radar.mirrors import mirrors_of
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
from skidpad.sensors.physical_radar.tracks import (
    MOST_TRACKS,
    Tracks,
    make_tracks,
    update_tracks,
    write_tracks,
)

MOST_FOUND = 512


class Reading(NamedTuple):
    """One tick of a radar: rows that every stack reads, and what an object list adds."""

    points: RadarPoints
    objects: RadarObjects | None = None  # detections and tracks alone have it
    tracks: RadarTracks | None = None


class PhysicalRadar:
    """One radar; `measure` once per tick."""

    def __init__(
        self,
        spec: RadarSpec,
        roadside: Roadside,
        table: ActorTable,
        seed: int,
        weather: Weather | None = None,
        *,
        multipath: bool = False,
        output: RadarOutput = RadarOutput.POINTS,
        interference: float = 0.0,
        dt: float = DT,
    ) -> None:
        """Builds the radar's targets, mirrors and cells.

        Args:
            spec: mounting and reach.
            roadside: what stands beside the roads.
            table: sizes and kinds of the actors.
            seed: of the run.
            weather: acts on the waves; None: it does not.
            multipath: walls, rails and the road mirror the waves.
            output: cells, objects or tracks.
            interference: share of vehicles that have a radar which disturbs this one.
            dt: s between two ticks.
        """
        self.spec, self._key = spec, np.uint64(stream_key(seed, "physical radar", spec.id))
        self._multipath, self._output, self._dt = multipath, output, dt
        self._interference = interference
        walls = walls_of(roadside)
        self._world = hold(
            RadarWorld(
                table.length, table.width, table.height, targets_of(table), sites_of(roadside),
                walls, group_walls(walls), mirrors_of(roadside if multipath else Roadside()),
            )
        )  # fmt: skip
        self._cells = hold(make_cells())
        self._tracks = hold(make_tracks())
        self._out = np.empty((MOST_FOUND, 6), np.float32)
        self._more = np.empty((MOST_TRACKS, 6))
        self.change(weather)

    def change(self, weather: Weather | None) -> None:
        """Weather is another from the next tick on."""
        self.setup = setup_of(self.spec, self._key, weather, self._multipath, self._interference)
        self._held = hold(self.setup)

    def measure(self, tick: int, states: ActorStates) -> RadarPoints:
        """Detections of this state, valid until the next call; actor 0 carries the radar."""
        return self.read(tick, states).points

    def read(self, tick: int, states: ActorStates) -> Reading:
        """Detections of this state as the output asks for, valid until the next call."""
        count = find_detections(self._held, self._world, self._cells, states, tick, self._out)
        if self._output is RadarOutput.POINTS:
            return Reading(RadarPoints(*self._out[:count, :4].T))
        follows = self._output is RadarOutput.TRACKS
        count = list_objects(
            self._held, self._cells, self._tracks, follows, self._dt, self._out, self._more, count
        )
        rows = self._out[:count]
        points = RadarPoints(*rows[:, :4].T)
        levels = (10.0 * np.log10(np.maximum(rows[:, POWER:].T, 1e-9))).astype(np.float32)
        objects = RadarObjects(levels[0], levels[1])
        if self._output is RadarOutput.DETECTIONS:
            return Reading(points, objects)
        return Reading(points, objects, self._tracks_of(count))

    def _tracks_of(self, count: int) -> RadarTracks:
        """Returns what the last call wrote about the first `count` tracks."""
        more = self._more[:count]
        x, y, vx, vy = more[:, 1:5].T.astype(np.float32)
        return RadarTracks(more[:, 0].astype(np.int64), x, y, vx, vy, more[:, 5].astype(np.int64))


@inner_kernel
def _sensor_of(radar: RadarSetup, states: ActorStates) -> Sensor:
    """Where the antenna is, and how it moves."""
    seat = placed(radar.mount, states)
    vx = states.vx[0] - states.yaw_rate[0] * (seat.origin[1] - states.y[0])
    vy = states.vy[0] + states.yaw_rate[0] * (seat.origin[0] - states.x[0])
    speed = np.hypot(vx, vy)
    wet = radar.air.radome[min(int(speed + 0.5), FASTEST - 1)]
    return Sensor(seat.origin, seat.rotation, vx, vy, wet)


@kernel
def find_detections(
    held: Held[RadarSetup],
    surroundings: Held[RadarWorld],
    state: Held[Cells],
    states: ActorStates,
    tick: int,
    out: NDArray[np.float32],
) -> int:
    """Write range, azimuth, altitude, range rate and power of the cells found; returns how many."""
    radar, world, cells = held.value, surroundings.value, state.value
    sensor = _sensor_of(radar, states)
    clear(cells)
    _note_motion(cells.own, sensor, states.yaw_rate[0])
    screens = find_screens(radar, world, states, sensor.origin)
    if radar.rivals > 0.0:
        sensor = add_interference(radar, world, states, sensor, screens)
    add_actors(radar, world, cells, states, sensor, screens, tick)
    add_sites(radar, world, cells, states, sensor, screens, tick)
    if radar.multipath:
        add_ghosts(radar, world, cells, states, sensor, screens, tick)
    aims = _aim_beams(radar, sensor)
    _add_noise(radar, cells, aims, tick)
    n = _select(radar, cells, aims, tick, out)
    return _add_false_alarm(radar, tick, n, out)


@kernel
def list_objects(
    held: Held[RadarSetup],
    state: Held[Cells],
    followed: Held[Tracks],
    follows: bool,
    dt: float,
    out: NDArray[np.float32],
    more: NDArray[np.float64],
    count: int,
) -> int:
    """Replace the rows of this tick's cells by the objects that they form; returns how many.

    follows: carry the tracks on to the objects, and write the confirmed ones in their place.
    """
    count = join_rows(out, count)
    add_sections(held.value, out, count)
    if not follows:
        return count
    motion = state.value.own
    own = (motion[0], motion[1], motion[2])
    update_tracks(followed.value, out, count, own, dt)
    return write_tracks(followed.value, own, out, more)


@inner_kernel
def _note_motion(own: NDArray[np.float64], sensor: Sensor, yaw_rate: float) -> None:
    """Write the velocity of the antenna in its axes in m/s and its yaw rate in rad/s."""
    r = sensor.rotation
    own[0] = r[0, 0] * sensor.vx + r[1, 0] * sensor.vy
    own[1] = r[0, 1] * sensor.vx + r[1, 1] * sensor.vy
    own[2] = yaw_rate


@inner_kernel
def _aim_beams(radar: RadarSetup, sensor: Sensor) -> NDArray[np.float64]:
    """For each beam: the antenna's speed along it in two parts, and what its lobe leaves of clutter."""
    aims = np.empty((radar.grid.beams, 3))
    r = sensor.rotation
    for beam in range(radar.grid.beams):
        azimuth = (beam - 0.5 * (radar.grid.beams - 1)) * radar.grid.beam_step
        c, s = np.cos(azimuth), np.sin(azimuth)
        aims[beam, 0] = sensor.vx * (r[0, 0] * c + r[0, 1] * s)
        aims[beam, 1] = sensor.vy * (r[1, 0] * c + r[1, 1] * s)
        aims[beam, 2] = exp(-8.0 * log(2.0) * (azimuth / radar.wide) ** 2 - sensor.wet)
    return aims


@inner_kernel
def _clutter(
    radar: RadarSetup, aims: NDArray[np.float64], distance: int, speed: int, beam: int
) -> float:
    """Clutter over noise in a cell: ground where what stands has this Doppler, rain around it."""
    off = abs(speed * radar.grid.speed_step + aims[beam, 0] + aims[beam, 1])
    power = 0.0
    if off <= radar.grid.speed_step:
        power += radar.air.ground[distance]
    if off <= RAIN_SPREAD:
        power += radar.air.rain[distance]
    return float(power * aims[beam, 2])


@inner_kernel
def _bins(number: int) -> tuple[int, int, int]:
    """Range, Doppler and beam of a cell."""
    rest = number // RANGES
    return number % RANGES, rest % SPEEDS - SPEEDS // 2, rest // SPEEDS


@inner_kernel
def _add_noise(radar: RadarSetup, cells: Cells, aims: NDArray[np.float64], tick: int) -> None:
    """Noise and clutter of the cells that an echo reached."""
    key = radar.key + np.uint64(1)
    for k in range(cells.reached[0]):
        slot = cells.taken[k]
        distance, speed, beam = _bins(cells.number[slot])
        z, w = normal_pair(key, tick, cells.number[slot])
        rms = sqrt(0.5 * (1.0 + _clutter(radar, aims, distance, speed, beam)))
        re, im = cells.re[slot] + rms * z, cells.im[slot] + rms * w
        cells.power[slot] = re * re + im * im


@inner_kernel
def _select(
    radar: RadarSetup,
    cells: Cells,
    aims: NDArray[np.float64],
    tick: int,
    out: NDArray[np.float32],
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
        clutter = _clutter(radar, aims, distance, speed, beam)
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
        out[n, 4] = power
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
    out[n, 4] = radar.grid.threshold
    return n + 1
