"""A radar with an equation, noise and clutter: what stands out of its resolution cells in one tick.

Radar equation (ITU-R and textbooks alike): the echo's power over the noise is
    SNR = SNR_0 (sigma / 10 m^2) (R_0 / R)^4 G(az, el)^2 exp(-loss)
with SNR_0 such that a Swerling 1 target of 10 m^2 is found in 9 of 10 ticks at the radar's `range` R_0.
Range, 10 m^2 and the sizes of cells are those of a public 77 GHz design (TI TIDUEN5A, March 2020, key
system specifications, MIMO): 150 m, 0.6 m, 0.53 km/h, 1.4 deg, elevation 18 deg. The antenna is a
Gaussian lobe with the fields of view as its widths at half power. Each echo has a phase of its own.
"""

from __future__ import annotations

from math import ceil, exp, log, pi, radians, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.frames import RadarPoints
from skidpad.core.jit import Held, hold, inner_kernel, kernel
from skidpad.core.randomness import stream_key
from skidpad.core.specs import RadarSpec
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.weather import Weather
from skidpad.physics.grip import rain_rate
from skidpad.physics.optics import RADAR_GHZ, rain_attenuation_db_km
from skidpad.physics.radio import rain_scatter, wet_radome_db
from skidpad.roads.roadside import Roadside
from skidpad.sensors.boxes import Mount, Walls, mount_of, placed, walls_in_view, walls_of
from skidpad.sensors.noise import uniform
from skidpad.sensors.radar_cells import (
    RANGES,
    SLACK,
    SPEEDS,
    Cells,
    Grid,
    add_echo,
    centre,
    cfar_threshold,
    clear,
    is_peak,
    make_cells,
    noise_mean,
    normal_pair,
    snr_for,
)
from skidpad.sensors.radar_targets import LOBES, Sites, Targets, sites_of, targets_of

Floats = NDArray[np.float64]

RANGE_STEP, SPEED_STEP, BEAM_STEP = 0.6, 0.53 / 3.6, radians(1.4)  # TIDUEN5A
MAX_SPEED = 133.0 / 3.6  # m/s, TIDUEN5A; faster targets keep their Doppler here
RISE_WIDTH, SLOPE = radians(18.0), 1.6  # TIDUEN5A; an assumption: of the angle's error
REFERENCE, DETECTED, FALSE_ALARMS = 10.0, 0.9, 1e-8  # m^2 (TIDUEN5A); the others are assumptions
GAMMA = 10.0**-2.5  # of the road, sigma_0 = gamma sin(grazing angle): an assumption
RAIN_SPREAD = 1.0  # m/s, of the drops' Doppler to each side: an assumption
DB = log(10.0) / 10.0  # nepers of power in a decibel
KMH = 71  # entries of the table of radome losses by speed in m/s
MOST_FOUND = 512
NEAR = 1.0  # m, nearest echo


class RadarAir(NamedTuple):
    """What weather puts in a radar's way, in the units of its cells."""

    loss: float  # nepers of power per m, both ways
    radome: Floats  # (KMH,) nepers by speed in m/s, both ways
    ground: Floats  # (ranges,) clutter over noise in the Doppler cell of what stands
    rain: Floats  # (ranges,) in each Doppler cell of the drops


class RadarSetup(NamedTuple):
    """One radar in a run."""

    mount: Mount
    key: np.uint64
    grid: Grid
    reach: float  # m
    factor: float  # SNR of 1 m^2 at 1 m on the axis
    wide: float  # rad, widths of the antenna's lobe at half power
    high: float
    false: float  # mean number of false alarms per tick
    air: RadarAir


class RadarWorld(NamedTuple):
    """What does not change about the world of a radar."""

    length: Floats  # (n,) m, of the actors
    width: Floats
    height: Floats
    targets: Targets
    sites: Sites
    walls: Walls


class Screens(NamedTuple):
    """Boxes that may hide others, seen from the antenna; arrays (n,)."""

    row: NDArray[np.int64]
    cos: Floats
    sin: Floats
    x: Floats  # m, antenna from the box's middle, in the box's axes
    y: Floats


class Sensor(NamedTuple):
    """Where the antenna is in this tick, and how it moves."""

    origin: Floats
    rotation: Floats
    vx: float
    vy: float
    wet: float  # nepers of the wet radome


class Echo(NamedTuple):
    """A point that returns."""

    distance: float
    azimuth: float
    elevation: float
    rate: float
    snr: float  # before the target's own fluctuation


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
        self._world = hold(
            RadarWorld(
                table.length, table.width, table.height, targets_of(table), sites_of(roadside),
                walls_of(roadside),
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


def setup_of(spec: RadarSpec, key: np.uint64, weather: Weather | None) -> RadarSetup:
    """Returns the constants of a radar in a weather."""
    wide, high = radians(spec.horizontal_fov_deg), radians(spec.vertical_fov_deg)
    beams = max(1, ceil(wide / BEAM_STEP))
    ranges = min(ceil(spec.range / RANGE_STEP), RANGES - 1)
    grid = Grid(RANGE_STEP, SPEED_STEP, BEAM_STEP, ranges, beams, cfar_threshold(FALSE_ALARMS))
    factor = snr_for(DETECTED, FALSE_ALARMS) * spec.range**4 / REFERENCE
    cells = ranges * beams * 2.0 * MAX_SPEED / SPEED_STEP
    air = _air(spec, factor, ranges, high, 0.0 if weather is None else rain_rate(weather))
    return RadarSetup(
        mount_of(spec.mount), key, grid, spec.range, factor, wide, high, cells * FALSE_ALARMS, air
    )


def _air(spec: RadarSpec, factor: float, ranges: int, high: float, rain: float) -> RadarAir:
    """Losses and clutter; rain: mm/h."""
    distance = np.maximum(np.arange(ranges) * RANGE_STEP, RANGE_STEP)
    loss = 2.0 * DB * rain_attenuation_db_km(rain) / 1000.0
    radome = np.array([DB * wet_radome_db(rain, float(v), RADAR_GHZ) for v in range(KMH)])
    snr = factor / distance**4 * np.exp(-loss * distance)  # of 1 m^2
    grazing = np.minimum(spec.mount.z / distance, 1.0)
    lobe = np.exp(-8.0 * log(2.0) * (grazing / high) ** 2)  # the road lies below the axis
    ground = snr * lobe * GAMMA * grazing * RANGE_STEP * distance * BEAM_STEP
    # of the lobe, both ways, the half above the road: sqrt(pi / (32 ln 2)) of its width
    rise = high * sqrt(pi / (32.0 * log(2.0)))
    volume = RANGE_STEP * distance**2 * BEAM_STEP * rise
    eta = rain_scatter(rain, RADAR_GHZ)[1] if rain > 0.0 else 0.0
    return RadarAir(loss, radome, ground, snr * eta * volume * SPEED_STEP / (2.0 * RAIN_SPREAD))


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
    wet = radar.air.radome[min(int(speed + 0.5), KMH - 1)]
    sensor = Sensor(seat.origin, seat.rotation, vx, vy, wet)
    clear(cells)
    screens = _screens(radar, world, states, seat.origin)
    _add_actors(radar, world, cells, states, sensor, screens, tick)
    _add_sites(radar, world, cells, states, sensor, screens, tick)
    _add_noise(radar, cells, sensor, tick)
    n = _select(radar, cells, sensor, tick, out)
    return _add_false_alarm(radar, tick, n, out)


@inner_kernel
def _screens(radar: RadarSetup, world: RadarWorld, states: ActorStates, origin: Floats) -> Screens:
    """The boxes in reach."""
    n = 0
    row = np.empty(states.x.size, np.int64)
    for i in range(1, states.x.size):
        if states.present[i]:
            d = np.hypot(states.x[i] - origin[0], states.y[i] - origin[1])
            if d - world.length[i] < radar.reach:
                row[n] = i
                n += 1
    table = np.empty((4, n))
    for k in range(n):
        i = row[k]
        c, s = np.cos(states.yaw[i]), np.sin(states.yaw[i])
        dx, dy = origin[0] - states.x[i], origin[1] - states.y[i]
        table[0, k], table[1, k] = c, s
        table[2, k], table[3, k] = c * dx + s * dy, -s * dx + c * dy
    return Screens(row[:n], table[0], table[1], table[2], table[3])


@inner_kernel
def _is_hidden(
    world: RadarWorld,
    states: ActorStates,
    origin: Floats,
    screens: Screens,
    own: int,
    way: tuple[float, float, float],
) -> bool:
    """Whether a box lies between antenna and a point that is `way` m off; own: a row not counted."""
    for k in range(screens.row.size):
        i = screens.row[k]
        if i == own:
            continue
        c, s = screens.cos[k], screens.sin[k]
        o = (screens.x[k], screens.y[k], origin[2] - states.z[i] - world.height[i] / 2.0)
        d = (c * way[0] + s * way[1], -s * way[0] + c * way[1], way[2])
        half = (world.length[i] / 2.0, world.width[i] / 2.0, world.height[i] / 2.0)
        enter, leave = 0.0, 1.0
        for axis in range(3):
            if d[axis] == 0.0:
                if abs(o[axis]) > half[axis]:
                    leave = -1.0
                continue
            t0, t1 = (-half[axis] - o[axis]) / d[axis], (half[axis] - o[axis]) / d[axis]
            enter, leave = max(enter, min(t0, t1)), min(leave, max(t0, t1))
        if enter < leave:
            return True
    return False


@inner_kernel
def _is_behind_wall(
    walls: Walls, chosen: NDArray[np.int64], origin: Floats, way: tuple[float, float, float]
) -> bool:
    """Whether a wall crosses the way from the antenna to a point that is `way` m off."""
    for w in chosen:
        ex, ey = walls.x1[w] - walls.x0[w], walls.y1[w] - walls.y0[w]
        det = ex * way[1] - ey * way[0]
        if det == 0.0:
            continue
        px, py = walls.x0[w] - origin[0], walls.y0[w] - origin[1]
        t, f = (ex * py - ey * px) / det, (way[0] * py - way[1] * px) / det
        if 0.0 < t < 1.0 and 0.0 <= f <= 1.0:
            foot = walls.z0[w] + f * (walls.z1[w] - walls.z0[w])
            if 0.0 <= origin[2] + t * way[2] - foot <= walls.height[w]:
                return True
    return False


@inner_kernel
def _echo(
    radar: RadarSetup, sensor: Sensor, way: tuple[float, float, float], vx: float, vy: float
) -> Echo:
    """What a point of 1 m^2 that moves so returns; SNR 0: it is not met."""
    distance = sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
    r = sensor.rotation
    fx = r[0, 0] * way[0] + r[1, 0] * way[1] + r[2, 0] * way[2]
    fy = r[0, 1] * way[0] + r[1, 1] * way[1] + r[2, 1] * way[2]
    fz = r[0, 2] * way[0] + r[1, 2] * way[1] + r[2, 2] * way[2]
    if distance < NEAR or distance > radar.reach or fx <= 0.0:
        return Echo(distance, 0.0, 0.0, 0.0, 0.0)
    azimuth, elevation = np.arctan2(fy, fx), np.arctan2(fz, np.hypot(fx, fy))
    if abs(azimuth) > 0.5 * radar.wide + BEAM_STEP:
        return Echo(distance, azimuth, elevation, 0.0, 0.0)
    off = (azimuth / radar.wide) ** 2 + (elevation / radar.high) ** 2
    lost = 8.0 * log(2.0) * off + radar.air.loss * distance + sensor.wet
    rate = ((vx - sensor.vx) * way[0] + (vy - sensor.vy) * way[1]) / distance
    return Echo(distance, azimuth, elevation, rate, radar.factor / distance**4 * exp(-lost))


@inner_kernel
def _deposit(
    radar: RadarSetup, cells: Cells, echo: Echo, section: float, tick: int, index: int
) -> None:
    """Add the echo of a point of this section to its cells."""
    grid = radar.grid
    at = (
        echo.distance / grid.range_step,
        echo.rate / grid.speed_step,
        echo.azimuth / grid.beam_step + 0.5 * (grid.beams - 1),
    )
    phase = 2.0 * pi * uniform(radar.key, tick, 4 * index + 3)
    add_echo(cells, grid, at, echo.snr * section, phase, echo.elevation)


@inner_kernel
def lobe_section(side: int, azimuth: float, zenith: float) -> float:
    """Radar cross section in m^2 of a side of a vehicle; both angles in deg, azimuth from its front."""
    turn = abs((azimuth - LOBES[side, 0] + 180.0) % 360.0 - 180.0)
    most = LOBES[side, 5]
    across = min(12.0 * (turn / LOBES[side, 1]) ** 2, most)
    rise = min(12.0 * ((zenith - LOBES[side, 2]) / LOBES[side, 3]) ** 2, most)
    return float(10.0 ** (0.1 * (LOBES[side, 4] - min(across + rise, most))))


@inner_kernel
def _spread(radar: RadarSetup, tick: int, index: int, db: float) -> float:
    """A factor with mean 1 whose logarithm has this standard deviation in dB."""
    z, _ = normal_pair(radar.key, tick, 2 * index)
    return exp(DB * (db * z - 0.5 * DB * db * db))


@inner_kernel
def _add_actors(
    radar: RadarSetup,
    world: RadarWorld,
    cells: Cells,
    states: ActorStates,
    sensor: Sensor,
    screens: Screens,
    tick: int,
) -> None:
    """Echoes of the sides of actors that face the antenna and are not hidden."""
    origin, targets = sensor.origin, world.targets
    edge = np.tan(0.5 * radar.wide)
    yaw = np.arctan2(sensor.rotation[1, 0], sensor.rotation[0, 0])
    rails = walls_in_view(origin, yaw, edge, world.walls, radar.reach)
    for k in range(screens.row.size):
        i = screens.row[k]
        c, s = screens.cos[k], screens.sin[k]
        for side in range(4):
            nx, ny = (1.0, 0.0, -1.0, 0.0)[side], (0.0, 1.0, 0.0, -1.0)[side]
            half = world.length[i] / 2.0 if side % 2 == 0 else world.width[i] / 2.0
            ax, ay = screens.x[k] - half * nx, screens.y[k] - half * ny  # antenna from the side
            if ax * nx + ay * ny <= 0.0:
                continue
            px, py = half * (c * nx - s * ny), half * (s * nx + c * ny)
            x, y = states.x[i] + px - origin[0], states.y[i] + py - origin[1]
            way = (x, y, states.z[i] + targets.rise[i] - origin[2])
            rate = states.yaw_rate[i]
            echo = _echo(radar, sensor, way, states.vx[i] - rate * py, states.vy[i] + rate * px)
            if echo.snr == 0.0:
                continue
            if _is_hidden(world, states, origin, screens, i, way):
                continue
            if _is_behind_wall(world.walls, rails, origin, way):
                continue
            section = targets.area[i, side]
            if targets.lobed[i]:
                zenith = 90.0 + np.degrees(np.arctan2(way[2], np.hypot(x, y)))
                section *= lobe_section(side, np.degrees(np.arctan2(ay, ax)), zenith)
            index = 4 * i + side
            section *= _spread(radar, tick, index, targets.spread[i])
            _deposit(radar, cells, echo, section, tick, index)


@inner_kernel
def _add_sites(
    radar: RadarSetup,
    world: RadarWorld,
    cells: Cells,
    states: ActorStates,
    sensor: Sensor,
    screens: Screens,
    tick: int,
) -> None:
    """Echoes of what stands beside the road."""
    sites, origin = world.sites, sensor.origin
    for j in range(sites.x.size):
        x, y = sites.x[j] - origin[0], sites.y[j] - origin[1]
        if abs(x) + abs(y) > 1.5 * radar.reach or x * sites.nx[j] + y * sites.ny[j] > 0.0:
            continue
        way = (x, y, sites.z[j] - origin[2])
        echo = _echo(radar, sensor, way, 0.0, 0.0)
        if echo.snr * sites.section[j] < 1.0:
            continue
        if not _is_hidden(world, states, origin, screens, 0, way):
            _deposit(radar, cells, echo, sites.section[j], tick, 4 * states.x.size + j)


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
    for k in range(cells.count[0]):
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
    key = radar.key + np.uint64(2)
    for k in range(cells.count[0]):
        slot = cells.taken[k]
        power, number = cells.power[slot], cells.number[slot]
        if n == MOST_FOUND or power < SLACK * grid.threshold or not is_peak(cells, grid, slot):
            continue
        distance, speed, beam = _bins(number)
        clutter = _clutter(radar, sensor, distance, speed, beam)
        if power < grid.threshold * noise_mean(cells, grid, number, clutter, key, tick):
            continue
        z, _ = normal_pair(key + np.uint64(1), tick, number)
        rise = cells.rise[slot] / cells.weight[slot]
        rise += RISE_WIDTH / (SLOPE * sqrt(2.0 * power / (1.0 + clutter))) * z
        away = beam + centre(cells, number, SPEEDS * RANGES) - 0.5 * (grid.beams - 1)
        out[n, 0] = (distance + centre(cells, number, 1)) * grid.range_step
        out[n, 1] = away * grid.beam_step
        out[n, 2] = rise
        out[n, 3] = (speed + centre(cells, number, RANGES)) * grid.speed_step
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
