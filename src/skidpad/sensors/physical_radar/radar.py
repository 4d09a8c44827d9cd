"""A radar with an equation, noise and clutter: what stands out of its cells in one tick."""

from __future__ import annotations

from math import exp, log, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
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
from skidpad.sensors.object_level.boxes import (
    Mount,
    WallGroups,
    Walls,
    group_walls,
    place,
    walls_in_view,
    walls_of,
)
from skidpad.sensors.physical_radar.cells import (
    RANGES,
    SLACK,
    SPEEDS,
    Cells,
    Noise,
    Scratch,
    bins_of,
    bound_powers,
    centre,
    clear,
    clutter_at,
    is_minor,
    is_peak,
    make_cells,
    make_scratch,
    noise_mean,
    normal_pair,
    power_of,
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
    RISE_WIDTH,
    SLOPE,
    RadarSetup,
    setup_of,
)
from skidpad.sensors.physical_radar.targets import Sites, sites_of, targets_of
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

    UNSAVED = ("_held", "_held_setup")  # made of `setup`
    _held_setup: RadarSetup | None = None

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
        self._multipath, self._output, self.dt = multipath, output, dt
        self._interference = interference
        self._cells = hold(make_cells())
        self._tracks = hold(make_tracks())
        self._out = np.empty((MOST_FOUND, 6), np.float32)
        self._more = np.empty((MOST_TRACKS, 6))
        self.surround(roadside, table)
        self.change(weather)

    def surround(self, roadside: Roadside, table: ActorTable) -> None:
        """Sets what stands beside the roads and which actors there are, from the next tick on."""
        walls, sites = walls_of(roadside), sites_of(roadside)
        mirrors = mirrors_of(roadside if self._multipath else Roadside())
        self._world = hold(
            RadarWorld(
                table.length, table.width, table.height, targets_of(table), sites, walls,
                group_walls(walls), group_sites(sites), mirrors,
            )
        )  # fmt: skip
        beams = setup_of(self.spec, self._key, None).grid.beams
        room = make_scratch(len(table), len(walls.x0), len(mirrors.walls.x0), beams)
        self._scratch = hold(room)

    def change(self, weather: Weather | None) -> None:
        """Sets weather and mounting, that of `spec`, from the next tick on."""
        self.setup = setup_of(self.spec, self._key, weather, self._multipath, self._interference)

    def measure(self, tick: int, states: ActorStates) -> RadarPoints:
        """Detections of this state, valid until the next call; actor 0 carries the radar."""
        return self.read(tick, states).points

    def read(self, tick: int, states: ActorStates) -> Reading:
        """Detections of this state as the output asks for, valid until the next call."""
        if self._held_setup is not self.setup:
            self._held_setup, self._held = self.setup, hold(self.setup)
        count = find_detections(
            self._held, self._world, self._cells, self._scratch, states, tick, self._out
        )
        if self._output is RadarOutput.POINTS:
            return Reading(RadarPoints(*self._out[:count, :4].T))
        follows = self._output is RadarOutput.TRACKS
        count = list_objects(
            self._held, self._cells, self._tracks, follows, self.dt, self._out, self._more, count
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


def group_sites(sites: Sites) -> WallGroups:
    """Returns where the points of each group are, as of walls that have no length."""
    x, y, z = sites.x, sites.y, sites.z
    return group_walls(Walls(x, y, z, x, y, z, z))


@inner_kernel
def _sensor_of(radar: RadarSetup, states: ActorStates, seat: Mount) -> Sensor:
    """Where the antenna is, written into `seat`, and how it moves."""
    place(radar.mount, states, seat)
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
    room: Held[Scratch],
    states: ActorStates,
    tick: int,
    out: NDArray[np.float32],
) -> int:
    """Write range, azimuth, altitude, range rate and power of the cells found; returns how many."""
    radar, world, cells, scratch = held.value, surroundings.value, state.value, room.value
    sensor = _sensor_of(radar, states, Mount(scratch.origin, scratch.rotation))
    origin, r = sensor.origin, sensor.rotation
    clear(cells)
    _note_motion(cells.own, sensor, states.yaw_rate[0])
    screens = find_screens(radar, world, states, origin, scratch)
    yaw, edge = np.arctan2(r[1, 0], r[0, 0]), np.tan(0.5 * radar.wide)
    n = walls_in_view(origin, yaw, edge, world.walls, world.groups, radar.reach, scratch.walls)
    rails = scratch.walls[:n]
    if radar.rivals > 0.0:
        sensor = add_interference(radar, world, states, sensor, screens, rails)
    add_actors(radar, world, cells, states, sensor, screens, rails, tick)
    add_sites(radar, world, cells, states, sensor, screens, tick)
    if radar.multipath:
        add_ghosts(radar, world, cells, states, sensor, screens, rails, scratch.mirrors, tick)
    _aim_beams(radar, sensor, scratch.aims)
    noise = Noise(
        radar.key + np.uint64(1), tick, radar.grid.speed_step, scratch.aims, radar.air.ground,
        radar.air.rain,
    )  # fmt: skip
    found = _select(radar, cells, noise, out)
    return _add_false_alarm(radar, tick, found, out)


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
def _aim_beams(radar: RadarSetup, sensor: Sensor, aims: Floats) -> None:
    """Write for each beam the antenna's speed along it in two parts, and what its lobe leaves of clutter."""
    r = sensor.rotation
    for beam in range(radar.grid.beams):
        azimuth = (beam - 0.5 * (radar.grid.beams - 1)) * radar.grid.beam_step
        c, s = np.cos(azimuth), np.sin(azimuth)
        aims[beam, 0] = sensor.vx * (r[0, 0] * c + r[0, 1] * s)
        aims[beam, 1] = sensor.vy * (r[1, 0] * c + r[1, 1] * s)
        aims[beam, 2] = exp(-8.0 * log(2.0) * (azimuth / radar.wide) ** 2 - sensor.wet)


@inner_kernel
def _select(radar: RadarSetup, cells: Cells, noise: Noise, out: NDArray[np.float32]) -> int:
    """Write the peaks that pass the threshold; returns how many."""
    grid, n = radar.grid, 0
    bound_powers(cells, noise)
    key, least = radar.key + np.uint64(2), SLACK * radar.grid.threshold
    for k in range(cells.reached[0]):
        if n == MOST_FOUND or is_minor(cells, k, least):
            continue
        power, number = power_of(cells, noise, k), cells.number[k]
        if power < least or not is_peak(cells, noise, k):
            continue
        distance, speed, beam = bins_of(number)
        clutter = clutter_at(noise, number)
        if power < grid.threshold * noise_mean(cells, noise, grid.ranges, number, clutter, key):
            continue
        z, _ = normal_pair(key + np.uint64(1), noise.tick, number)
        rise = cells.rise[k] / cells.weight[k]
        rise += RISE_WIDTH / (SLOPE * sqrt(2.0 * power / (1.0 + clutter))) * z
        away = beam + centre(cells, noise, number, SPEEDS * RANGES) - 0.5 * (grid.beams - 1)
        out[n, 0] = (distance + centre(cells, noise, number, 1)) * grid.range_step
        out[n, 1] = away * grid.beam_step
        out[n, 2] = rise
        out[n, 3] = (speed + centre(cells, noise, number, RANGES)) * grid.speed_step
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
