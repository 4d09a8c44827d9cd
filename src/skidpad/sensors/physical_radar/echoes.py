"""What returns a radar's wave: sides of actors and points beside the road, each with its section."""

from __future__ import annotations

from math import exp, log, pi, sqrt
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Ints
from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.states import ActorStates
from skidpad.physics.mirrors import two_ray_gain
from skidpad.sensors.noise import uniform
from skidpad.sensors.object_level.boxes import GROUP, WallGroups, Walls, is_group_far
from skidpad.sensors.physical_radar.cells import FAINT, Cells, Scratch, add_echo, normal_pair
from skidpad.sensors.physical_radar.mirrors import Mirrors
from skidpad.sensors.physical_radar.setup import BEAM_STEP, DB, WAVE_NUMBER, RadarSetup
from skidpad.sensors.physical_radar.targets import LOBES, Sites, Targets

NEAR = 1.0  # m, nearest echo
WIDER, LESS = 1.0 + 1e-9, 1.0 - 1e-9  # of a bound, so that rounding leaves nothing out


class RadarWorld(NamedTuple):
    """What does not change about the world of a radar."""

    length: Floats  # (n,) m, of the actors
    width: Floats
    height: Floats
    targets: Targets
    sites: Sites
    walls: Walls
    groups: WallGroups
    regions: WallGroups  # of the sites
    mirrors: Mirrors


Way = tuple[float, float, float]  # m, along the axes of the world


class Screens(NamedTuple):
    """Boxes that may hide others, seen from the antenna; arrays (n,)."""

    row: Ints
    cos: Floats
    sin: Floats
    x: Floats  # m, antenna from the box's middle, in the box's axes
    y: Floats
    ahead: Floats  # m, the box's middle from the antenna, along the axes of the world
    aside: Floats
    around: Floats  # m^2, a little more than the squared radius of a circle about its ground plan


class Sensor(NamedTuple):
    """Where the antenna is in this tick, and how it moves."""

    origin: Floats
    rotation: Floats
    vx: float
    vy: float
    wet: float  # nepers of the wet radome


class Echo(NamedTuple):
    """One point that returns a wave to the antenna."""

    distance: float
    azimuth: float
    elevation: float
    rate: float
    snr: float  # before the target's own fluctuation


@inner_kernel
def find_screens(
    radar: RadarSetup, world: RadarWorld, states: ActorStates, origin: Floats, scratch: Scratch
) -> Screens:
    """The boxes of actors within reach of the antenna; arrays of `scratch`."""
    n = 0
    row, table = scratch.actor, scratch.screen
    for i in range(1, states.x.size):
        if states.present[i]:
            d = np.hypot(states.x[i] - origin[0], states.y[i] - origin[1])
            if d - world.length[i] < radar.reach:
                row[n] = i
                n += 1
    for k in range(n):
        i = row[k]
        c, s = np.cos(states.yaw[i]), np.sin(states.yaw[i])
        dx, dy = origin[0] - states.x[i], origin[1] - states.y[i]
        table[0, k], table[1, k] = c, s
        table[2, k], table[3, k] = c * dx + s * dy, -s * dx + c * dy
        table[4, k], table[5, k] = -dx, -dy
        long, wide = world.length[i], world.width[i]
        table[6, k] = WIDER * 0.25 * (long * long + wide * wide)
    return Screens(
        row[:n], table[0, :n], table[1, :n], table[2, :n], table[3, :n], table[4, :n],
        table[5, :n], table[6, :n],
    )  # fmt: skip


@inner_kernel
def crosses_box(
    o: tuple[float, float, float], d: tuple[float, float, float], half: tuple[float, float, float]
) -> bool:
    """Whether the way d from a point o meets a box about the origin with these half sizes."""
    enter, leave = 0.0, 1.0
    for axis in range(3):
        if d[axis] == 0.0:
            if abs(o[axis]) > half[axis]:
                leave = -1.0
            continue
        t0, t1 = (-half[axis] - o[axis]) / d[axis], (half[axis] - o[axis]) / d[axis]
        enter, leave = max(enter, min(t0, t1)), min(leave, max(t0, t1))
    return enter < leave


@inner_kernel
def crosses_actor(
    world: RadarWorld,
    i: int,
    c: float,
    s: float,
    place: tuple[float, float, float],
    way: tuple[float, float, float],
) -> bool:
    """Whether the way from a point meets the box of actor i.

    c, s: of the actor's yaw; place: of the point in m in the actor's axes; way: m in the world's axes.
    """
    o = (place[0], place[1], place[2] - world.height[i] / 2.0)
    d = (c * way[0] + s * way[1], -s * way[0] + c * way[1], way[2])
    half = (world.length[i] / 2.0, world.width[i] / 2.0, world.height[i] / 2.0)
    return bool(crosses_box(o, d, half))


@inner_kernel
def is_hidden(
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
        if i == own or _passes_by(screens, k, way[0], way[1]):
            continue
        place = (screens.x[k], screens.y[k], origin[2] - states.z[i])
        if crosses_actor(world, i, screens.cos[k], screens.sin[k], place, way):
            return True
    return False


@inner_kernel
def _passes_by(screens: Screens, k: int, x: float, y: float) -> bool:
    """Whether the way (x, y) from the antenna surely misses a box, as it misses a circle about it."""
    dx, dy = screens.ahead[k], screens.aside[k]
    square, cross = x * x + y * y, dx * y - dy * x
    if cross * cross > screens.around[k] * square:
        return True
    # behind the antenna, which stands outside the circle
    return bool(dx * x + dy * y < 0.0 and dx * dx + dy * dy > screens.around[k])


@inner_kernel
def is_behind_wall(
    walls: Walls, chosen: Ints, origin: Floats | Way, way: tuple[float, float, float]
) -> bool:
    """Whether a wall crosses the way from the antenna to a point that is `way` m off."""
    for w in chosen:
        ex, ey = walls.x1[w] - walls.x0[w], walls.y1[w] - walls.y0[w]
        det = ex * way[1] - ey * way[0]
        if det == 0.0:
            continue
        px, py = walls.x0[w] - origin[0], walls.y0[w] - origin[1]
        met, along = ex * py - ey * px, way[0] * py - way[1] * px
        if abs(met) > abs(det) or abs(along) > abs(det) or met * det < 0.0 or along * det < 0.0:
            continue  # as most do, without a division
        t, f = met / det, along / det
        if 0.0 < t < 1.0 and 0.0 <= f <= 1.0:
            foot = walls.z0[w] + f * (walls.z1[w] - walls.z0[w])
            if 0.0 <= origin[2] + t * way[2] - foot <= walls.height[w]:
                return True
    return False


@inner_kernel
def echo_of(
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
def deposit_echo(
    radar: RadarSetup, cells: Cells, echo: Echo, section: float, tick: int, index: int
) -> None:
    """Adds the echo of a point with a radar cross section of `section` m² to `cells`.

    tick, index: they choose the random phase; `index` counts the points that return an echo.
    """
    if echo.snr * section < FAINT:
        return
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
    """Returns the radar cross section in m^2 of a side (FRONT, ...); deg, azimuth 0 at the front."""
    turn = abs((azimuth - LOBES[side, 0] + 180.0) % 360.0 - 180.0)
    most = LOBES[side, 5]
    across = min(12.0 * (turn / LOBES[side, 1]) ** 2, most)
    rise = min(12.0 * ((zenith - LOBES[side, 2]) / LOBES[side, 3]) ** 2, most)
    return float(10.0 ** (0.1 * (LOBES[side, 4] - min(across + rise, most))))


@inner_kernel
def draw_spread(radar: RadarSetup, tick: int, index: int, db: float) -> float:
    """A factor with mean 1 whose logarithm has this standard deviation in dB."""
    z, _ = normal_pair(radar.key, tick, 2 * index)
    return exp(DB * (db * z - 0.5 * DB * db * db))


@inner_kernel
def add_actors(
    radar: RadarSetup,
    world: RadarWorld,
    cells: Cells,
    states: ActorStates,
    sensor: Sensor,
    screens: Screens,
    rails: Ints,
    tick: int,
) -> None:
    """Echoes of the sides of actors that face the antenna and are not hidden.

    rails: the walls in view.
    """
    origin, targets = sensor.origin, world.targets
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
            echo = echo_of(radar, sensor, way, states.vx[i] - rate * py, states.vy[i] + rate * px)
            if echo.snr == 0.0:
                continue
            if is_hidden(world, states, origin, screens, i, way):
                continue
            if is_behind_wall(world.walls, rails, origin, way):
                continue
            section = targets.area[i, side]
            if targets.lobed[i]:
                zenith = 90.0 + np.degrees(np.arctan2(way[2], np.hypot(x, y)))
                section *= lobe_section(side, np.degrees(np.arctan2(ay, ax)), zenith)
            index = 4 * i + side
            section *= draw_spread(radar, tick, index, targets.spread[i])
            if radar.multipath:
                section *= _road_gain(radar, np.hypot(x, y), targets.rise[i])
            deposit_echo(radar, cells, echo, section, tick, index)


@inner_kernel
def _road_gain(radar: RadarSetup, ground: float, high: float) -> float:
    """What the road's reflection makes of an echo from `ground` m off and `high` m over the road."""
    antenna = radar.mount.origin[2]
    near, far = np.hypot(ground, antenna - high), np.hypot(ground, antenna + high)
    return two_ray_gain(near, far, (antenna + high) / far, WAVE_NUMBER)


@inner_kernel
def add_sites(
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
    for g in range(world.regions.x_min.size):
        if is_group_far(world.regions, g, origin, radar.reach):
            continue
        for j in range(GROUP * g, min(GROUP * (g + 1), sites.x.size)):
            x, y = sites.x[j] - origin[0], sites.y[j] - origin[1]
            if abs(x) + abs(y) > 1.5 * radar.reach or x * sites.nx[j] + y * sites.ny[j] > 0.0:
                continue
            square = x * x + y * y
            if radar.factor * sites.section[j] < LESS * square * square:
                continue  # without any loss it would be below the noise
            way = (x, y, sites.z[j] - origin[2])
            if _is_beside(radar, sensor, way):
                continue
            echo = echo_of(radar, sensor, way, 0.0, 0.0)
            if echo.snr * sites.section[j] < 1.0:
                continue
            if not is_hidden(world, states, origin, screens, 0, way):
                deposit_echo(radar, cells, echo, sites.section[j], tick, 4 * states.x.size + j)


@inner_kernel
def _is_beside(radar: RadarSetup, sensor: Sensor, way: Way) -> bool:
    """Whether a point surely lies beside the antenna's view; `echo_of` says so exactly."""
    r = sensor.rotation
    ahead = r[0, 0] * way[0] + r[1, 0] * way[1] + r[2, 0] * way[2]
    left = r[0, 1] * way[0] + r[1, 1] * way[1] + r[2, 1] * way[2]
    return bool(ahead <= 0.0 or abs(left) > radar.edge * ahead)
