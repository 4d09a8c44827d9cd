"""Ghosts of road users in walls and guardrails: echoes that come by way of a mirror (image method).

Named as in the labels of the Radar Ghost Dataset (Kraus et al., arXiv 2404.01437, `label_convention.md`):
    second order, type 1: antenna, mirror, object, antenna; seen where the object is, but farther
    second order, type 2: antenna, object, mirror, antenna; seen in the mirror's direction
    third order, type 2:  antenna, mirror, object, mirror, antenna; the image behind the mirror
With d to the object and D to its image, second orders lie at (d + D) / 2 and move at the mean of both
rates; the third lies at D. Higher orders are left out, as in those labels. A side that is seen from two
directions returns what it does halfway between them, and angles are those of the returning wave:
assumptions. The mirror that an object's middle meets is that of all its sides.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from skidpad.core.arrays import Ints
from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.states import ActorStates
from skidpad.sensors.object_level.boxes import walls_in_view
from skidpad.sensors.physical_radar.cells import Cells
from skidpad.sensors.physical_radar.echoes import (
    Echo,
    RadarWorld,
    Screens,
    Sensor,
    crosses_actor,
    deposit_echo,
    draw_spread,
    echo_of,
    is_behind_wall,
    is_hidden,
    lobe_section,
)
from skidpad.sensors.physical_radar.mirrors import Reflection, reflect
from skidpad.sensors.physical_radar.setup import WAVE_NUMBER, RadarSetup

MOST_SECTION = 10.0**2.06  # m^2, highest lobe of a vehicle in `targets`
SHORT = 0.99  # share of a way to a mirror that may not be blocked: the mirror itself is no obstacle

Way = tuple[float, float, float]


@inner_kernel
def add_ghosts(
    radar: RadarSetup,
    world: RadarWorld,
    cells: Cells,
    states: ActorStates,
    sensor: Sensor,
    screens: Screens,
    rails: Ints,
    room: Ints,
    tick: int,
) -> None:
    """Echoes of actors by way of every mirror in view.

    rails: the walls in view; room: for as many mirrors as there are.
    """
    walls = world.mirrors.walls
    yaw, edge = np.arctan2(sensor.rotation[1, 0], sensor.rotation[0, 0]), np.tan(0.5 * radar.wide)
    seen = walls_in_view(sensor.origin, yaw, edge, walls, world.mirrors.groups, radar.reach, room)
    strongest = radar.factor * MOST_SECTION
    for m in range(seen):
        w = room[m]
        ex, ey = walls.x1[w] - walls.x0[w], walls.y1[w] - walls.y0[w]
        whole = ex * ex + ey * ey
        ax, ay = sensor.origin[0] - walls.x0[w], sensor.origin[1] - walls.y0[w]
        a, along = ex * ay - ey * ax, ex * ax + ey * ay
        for k in range(screens.row.size):
            # most pairs of mirror and actor end here: the image would lie beyond the mirror's ends
            i = screens.row[k]
            px, py = states.x[i] - walls.x0[w], states.y[i] - walls.y0[w]
            b = ex * py - ey * px
            if a * b <= 0.0:
                continue
            at = along * b + (ex * px + ey * py) * a
            if not 0.0 <= at / (a + b) <= whole:
                continue
            middle = (states.x[i], states.y[i], states.z[i] + world.targets.rise[i])
            found = reflect(world.mirrors, w, sensor.origin, middle, radar.concrete, WAVE_NUMBER)
            way = found.way
            square = way[0] * way[0] + way[1] * way[1]
            area = world.targets.area
            most = strongest * max(1.0, area[i, 0], area[i, 1], area[i, 2], area[i, 3])
            if most * found.power < square * square:
                continue
            if _is_blocked(world, states, sensor, screens, rails, i, found, middle):
                continue
            index = 4 * (states.x.size + world.sites.x.size) + 8 * (w * states.x.size + i)
            _add_images(radar, world, cells, states, sensor, screens, rails, tick, i, found, index)


@inner_kernel
def _mirror_vector(found: Reflection, x: float, y: float) -> tuple[float, float]:
    """A horizontal vector as the mirror shows it."""
    along = x * found.nx + y * found.ny
    return x - 2.0 * along * found.nx, y - 2.0 * along * found.ny


@inner_kernel
def _is_blocked(
    world: RadarWorld,
    states: ActorStates,
    sensor: Sensor,
    screens: Screens,
    rails: Ints,
    own: int,
    found: Reflection,
    point: Way,
) -> bool:
    """Whether an actor or a wall stands in one of the two legs of a way by a mirror."""
    origin, f = sensor.origin, found.foot
    first = (SHORT * f[0], SHORT * f[1], SHORT * f[2])
    if is_hidden(world, states, origin, screens, own, first):
        return True
    if is_behind_wall(world.walls, rails, origin, first):
        return True
    second = (
        SHORT * (origin[0] + f[0] - point[0]),
        SHORT * (origin[1] + f[1] - point[1]),
        SHORT * (origin[2] + f[2] - point[2]),
    )
    if is_behind_wall(world.walls, rails, point, second):
        return True
    for k in range(screens.row.size):
        i = screens.row[k]
        if i == own:
            continue
        c, s = screens.cos[k], screens.sin[k]
        dx, dy = point[0] - states.x[i], point[1] - states.y[i]
        place = (c * dx + s * dy, -s * dx + c * dy, point[2] - states.z[i])
        if crosses_actor(world, i, c, s, place, second):
            return True
    return False


@inner_kernel
def _add_images(
    radar: RadarSetup,
    world: RadarWorld,
    cells: Cells,
    states: ActorStates,
    sensor: Sensor,
    screens: Screens,
    rails: Ints,
    tick: int,
    i: int,
    found: Reflection,
    index: int,
) -> None:
    """Echoes of the sides of one actor by way of one mirror."""
    origin, targets = sensor.origin, world.targets
    c, s = np.cos(states.yaw[i]), np.sin(states.yaw[i])
    for side in range(4):
        ahead, left = (1.0, 0.0, -1.0, 0.0)[side], (0.0, 1.0, 0.0, -1.0)[side]
        half = world.length[i] / 2.0 if side % 2 == 0 else world.width[i] / 2.0
        px, py = half * (c * ahead - s * left), half * (s * ahead + c * left)
        mx, my = _mirror_vector(found, px, py)
        image = (found.way[0] + mx, found.way[1] + my, found.way[2])
        vx, vy = states.vx[i] - states.yaw_rate[i] * py, states.vy[i] + states.yaw_rate[i] * px
        by_mirror = echo_of(radar, sensor, image, *_mirror_vector(found, vx, vy))
        if by_mirror.snr == 0.0:
            continue
        # from the point back to the antenna's image, as the actor has it
        bx, by = _mirror_vector(found, -image[0], -image[1])
        spread = draw_spread(radar, tick, index + 2 * side, targets.spread[i])
        section = spread * _section(world, i, side, c, s, bx, by, -image[2])
        if section > 0.0:
            snr = by_mirror.snr * found.power * found.power
            echo = Echo(
                by_mirror.distance, by_mirror.azimuth, by_mirror.elevation, by_mirror.rate, snr
            )
            deposit_echo(radar, cells, echo, section, tick, index + 2 * side)
        x, y = states.x[i] + px - origin[0], states.y[i] + py - origin[1]
        way = (x, y, states.z[i] + targets.rise[i] - origin[2])
        direct = echo_of(radar, sensor, way, vx, vy)
        if direct.snr == 0.0:
            continue
        near, far = direct.distance, by_mirror.distance
        section = spread * _section(
            world, i, side, c, s, bx / far - x / near, by / far - y / near,
            -image[2] / far - way[2] / near,
        )  # fmt: skip
        snr = sqrt(direct.snr * by_mirror.snr) * found.power
        if section * snr < 1.0 or is_hidden(world, states, origin, screens, i, way):
            continue
        if is_behind_wall(world.walls, rails, origin, way):
            continue
        rate, distance = 0.5 * (direct.rate + by_mirror.rate), 0.5 * (near + far)
        one = Echo(distance, direct.azimuth, direct.elevation, rate, snr)
        deposit_echo(radar, cells, one, section, tick, index + 2 * side + 1)
        two = Echo(distance, by_mirror.azimuth, by_mirror.elevation, rate, snr)
        deposit_echo(radar, cells, two, section, tick, index + 2 * side + 1)


@inner_kernel
def _section(
    world: RadarWorld, i: int, side: int, c: float, s: float, x: float, y: float, z: float
) -> float:
    """Section of a side towards (x, y, z), or 0 where the side faces away; c, s: of the actor's yaw."""
    ahead, left = c * x + s * y, -s * x + c * y
    if (ahead, left, -ahead, -left)[side] <= 0.0:
        return 0.0
    section = world.targets.area[i, side]
    if world.targets.lobed[i]:
        zenith = 90.0 - np.degrees(np.arctan2(z, np.hypot(x, y)))
        section *= lobe_section(side, np.degrees(np.arctan2(left, ahead)), zenith)
    return float(section)
