"""RGB from key and depth: no second raster pass, no shadows; unevenness by `sensors.pictures.roughness`.

The normal of a surface is read off its inverse depth: on a plane, inverse depth is linear in the
pixel, and its two slopes are the normal. Light is linear inside and leaves by a square root.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats32
from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.states import ActorTable
from skidpad.core.vocabulary import Quality
from skidpad.physics.camera import share_left
from skidpad.sensors.pictures.blocks import (
    BLOCK,
    COLUMNS,
    GLOW,
    GX,
    GY,
    LANES,
    ONE,
    ZERO,
    B,
    G,
    H,
    L,
    M,
    P,
    R,
    S,
    T,
    U,
    W,
    develop,
    gather,
    slopes,
)
from skidpad.sensors.pictures.colours import grain_in, in_season, look_up, settling_in
from skidpad.sensors.pictures.headlamps import LAMP_X, behind_lamps, throw_light
from skidpad.sensors.pictures.height_fog import thin_fog
from skidpad.sensors.pictures.lighting import Lighting
from skidpad.sensors.pictures.roughness import MORE_LANES, NO_TILES, make_tiles, roughen, vary_sky
from skidpad.sensors.pictures.settled_snow import NOTHING_SETTLES, settle_snow
from skidpad.sensors.pictures.sky import disc, sky
from skidpad.sensors.pictures.street_lamps import lay_street_light
from skidpad.sensors.raster.view import View
from skidpad.sensors.scene.grain import NO_GRAIN
from skidpad.sensors.scene.materials import MATERIALS, Material
from skidpad.sensors.scene.static import StaticScene
from skidpad.sensors.scene.street_light import NO_STREET_LIGHT, StreetLight

WET_DARKENING = 0.52  # of asphalt's albedo; Lekner and Dorf (1988) give 0.4 to 0.7
NO_LEAVES = np.zeros(0, dtype=np.intp)
BRAKE_LIGHT = np.array([1.5, 0.03, 0.03], dtype=np.float32)  # of lit lamps, linear
INDICATOR_LIGHT = np.array([1.5, 0.55, 0.03], dtype=np.float32)


class Shading:
    """Colours of all actors and materials in one weather; `paint` makes a picture."""

    def __init__(
        self,
        palette: Floats32,
        table: ActorTable,
        light: Lighting,
        for_people: bool = False,
        grain: Floats32 = NO_GRAIN,
        street_light: StreetLight = NO_STREET_LIGHT,
        leafy: NDArray[np.intp] = NO_LEAVES,
        green: NDArray[np.intp] = NO_LEAVES,
    ) -> None:
        """for_people: what a stack reads has snow beside the road only, and no ice.

        grain, street_light, leafy, green: of the scene (`StaticScene`).
        """
        if not for_people:
            light = light._replace(ice=0.0)
        self._street_light = street_light
        self._grain = grain_in(light, grain, for_people)
        self._settling = settling_in(light, leafy, green) if for_people else NOTHING_SETTLES
        self._tiles = make_tiles() if grain.size else NO_TILES
        self.light = light
        self._table = look_up(in_season(palette, leafy, light), table, light, for_people)
        self._plain_tail = self._table.reshape(-1, MATERIALS, COLUMNS)[0, Material.TAIL_LAMP].copy()
        self._braking = np.zeros(len(table), dtype=np.bool_)
        self._indicating = np.zeros((len(table), 2), dtype=np.bool_)

    def set_braking(self, braking: NDArray[np.bool_]) -> None:
        """Lights the brake lamps of these actors (n,), and puts out those of all others."""
        if np.array_equal(braking, self._braking):
            return
        self._braking[:] = braking
        tails = self._table.reshape(-1, MATERIALS, COLUMNS)[1:, Material.TAIL_LAMP]
        tails[:] = self._plain_tail
        tails[braking, :3] = BRAKE_LIGHT
        tails[braking, GLOW] = 1.0
        self._light_up(Material.BRAKE_LAMP, braking, BRAKE_LIGHT)

    def set_indicating(self, indicating: NDArray[np.bool_]) -> None:
        """Lights the left and right indicators of these actors (n, 2)."""
        if np.array_equal(indicating, self._indicating):
            return
        self._indicating[:] = indicating
        for column, lamp in enumerate((Material.INDICATOR_LEFT, Material.INDICATOR_RIGHT)):
            self._light_up(lamp, indicating[:, column], INDICATOR_LIGHT)

    def _light_up(self, lamp: Material, lit: NDArray[np.bool_], light: Floats32) -> None:
        """Gives a lamp of these actors (n,) its light, and that of all others its plain colour."""
        table = self._table.reshape(-1, MATERIALS, COLUMNS)
        lamps = table[1:, lamp]
        lamps[:] = table[0, lamp]
        lamps[lit, :3] = light
        lamps[lit, GLOW] = 1.0

    def surfaces(self, key: NDArray[np.int32]) -> Floats32:
        """Returns (H, W, COLUMNS): colour in linear light, and behaviour, of what each pixel shows."""
        found: Floats32 = self._table[(key >> 16) * MATERIALS + (key & 255)]
        return found

    def paint(
        self,
        view: View,
        ego: Pose,
        inverse: Floats32,
        key: NDArray[np.int32],
        out: NDArray[np.uint32],
    ) -> None:
        """Writes the rows of a view of a picture, (H, W) of packed bytes red, green, blue, 255, into `out`.

        ego: the pose that carries the headlights. inverse, key: (H, W) inverse depth and key.
        """
        light = self.light
        r = view.rotation
        body = ego.rotation()
        shade(
            view,
            light,
            (r @ light.sun_direction).astype(np.float32),
            np.ascontiguousarray(r[:, 2], dtype=np.float32),
            np.ascontiguousarray(body.T @ r.T, dtype=np.float32),
            (body.T @ (view.centre - (ego.x, ego.y, ego.z))).astype(np.float32),
            self._table,
            self._grain,
            self._tiles,
            self._street_light,
            self._settling,
            np.zeros((LANES + MORE_LANES) * BLOCK, dtype=np.float32),
            inverse,
            key,
            out,
        )


def shade_scene(
    scene: StaticScene,
    table: ActorTable,
    light: Lighting,
    quality: Quality = Quality.FULL,
    for_people: bool = False,
) -> Shading:
    """Returns the colours of a scene and its actors; a draft has no grain. for_people: as in `Shading`."""
    grain = NO_GRAIN if quality is Quality.DRAFT else scene.grain
    plants = (scene.leafy, scene.green)
    return Shading(scene.palette, table, light, for_people, grain, scene.street_light, *plants)


_HALF = np.float32(0.5)
_TINY = np.float32(1e-12)
_GLOSS_SHARE = np.float32(0.35)
_F0 = np.float32(0.03)  # reflectance of water and glass at normal incidence, about
_BEAM_BLUE = np.float32(0.82)
_STREET_GREEN, _STREET_BLUE = np.float32(0.84), np.float32(0.58)
_ON_WALLS = np.float32(0.4)  # share of a street lamp's light that falls on what stands upright
_DARK = np.float32(1.0 - WET_DARKENING)
_FILM_SHARE = np.float32(0.8)
_RETRO = np.float32(0.35)  # rough asphalt sends back much of a grazing beam
_FARTHEST = np.float32(1e-6)


@inner_kernel
def _surfaces(
    v: np.float32, count: int, light: Lighting, sun: Floats32, up: Floats32, work: Floats32
) -> None:
    """Applies sun, diffuse light, lamps, wet mirror and haze to a block's surfaces in `work`."""
    fog, begins = np.float32(light.air.fog), np.float32(light.air.fog_start)
    rain, curved = np.float32(light.air.rain), np.float32(light.curved)
    wet = np.float32(light.wet)
    sun_r, sun_g, sun_b = light.sun[0], light.sun[1], light.sun[2]
    low_r, low_g, low_b = light.bounce[0], light.bounce[1], light.bounce[2]
    span_r, span_g, span_b = light.sky[0] - low_r, light.sky[1] - low_g, light.sky[2] - low_b
    hor_r, hor_g, hor_b = light.horizon[0], light.horizon[1], light.horizon[2]
    up0, up1, up2 = up[0], up[1], up[2]
    sun0, sun1, sun2 = sun[0], sun[1], sun[2]
    for x in range(count):
        u, w = work[U + x], work[W + x]
        gx, gy = work[GX + x], work[GY + x]
        glow, gloss = work[L + x], work[S + x]
        gz = w - u * gx - v * gy
        size = ONE / np.sqrt(gx * gx + gy * gy + gz * gz + _TINY)
        ray = np.sqrt(u * u + v * v + ONE)
        n_up = -(gx * up0 + gy * up1 + gz * up2) * size
        n_sun = -(gx * sun0 + gy * sun1 + gz * sun2) * size
        n_sun = n_sun if n_sun > ZERO else ZERO
        facing = w * size / ray
        tilt = _HALF + _HALF * n_up
        lit = work[H + x] * (_RETRO + (ONE - _RETRO) * facing)
        street = work[P + x] * (_ON_WALLS + (ONE - _ON_WALLS) * (n_up if n_up > ZERO else ZERO))

        grazing = ONE - (facing if facing < ONE else ONE)
        square = grazing * grazing
        fresnel = _F0 + (ONE - _F0) * square * square * grazing
        film = wet * work[T + x] * (n_up if n_up > ZERO else ZERO)
        mirror = fresnel * (film * _FILM_SHARE + gloss * _GLOSS_SHARE)
        shown = ONE - glow
        dull = shown * (ONE - film * _DARK) * (ONE - mirror)
        way = ray / (w if w > _FARTHEST else _FARTHEST)
        foggy = way - begins
        through = share_left(
            (foggy if foggy > ZERO else ZERO) * (fog * work[M + x]) + way * rain, curved
        )
        veil = mirror * shown * through + (ONE - through)

        r = glow + dull * (low_r + tilt * span_r + sun_r * n_sun + lit + street)
        g = glow + dull * (low_g + tilt * span_g + sun_g * n_sun + lit + street * _STREET_GREEN)
        b = glow + dull * (
            low_b + tilt * span_b + sun_b * n_sun + lit * _BEAM_BLUE + street * _STREET_BLUE
        )
        work[R + x] = work[R + x] * r * through + veil * hor_r
        work[G + x] = work[G + x] * g * through + veil * hor_g
        work[B + x] = work[B + x] * b * through + veil * hor_b


@kernel
def shade(
    view: View,
    light: Lighting,
    sun: Floats32,
    up: Floats32,
    to_body: Floats32,
    offset: Floats32,
    table: Floats32,
    grain: Floats32,
    tiles: NDArray[np.int8],
    lamps: StreetLight,
    settling: Floats32,
    work: Floats32,
    inverse: Floats32,
    key: NDArray[np.int32],
    out: NDArray[np.uint32],
) -> None:
    """Writes the colours of the view's rows into `out`, from key and inverse depth (deferred shading).

    sun, up: (3,) camera axes; to_body, offset: camera to ego frame.
    """
    width = inverse.shape[1]
    work[H : H + BLOCK] = ZERO
    work[M : M + BLOCK] = ONE
    clear, exposure = np.float32(light.disc), np.float32(light.exposure)
    uneven = ONE if grain.shape[0] > 0 else ZERO
    mirrored = sun - np.float32(2.0) * (sun[0] * up[0] + sun[1] * up[1] + sun[2] * up[2]) * up
    for y in range(view.top, view.height):
        v = np.float32((y + 0.5 - view.cy) / view.focal)
        for first in range(0, width, BLOCK):
            count = min(BLOCK, width - first)
            solid, empty = slopes(inverse, y, first, count, view, work)
            if solid:
                gather(key, y, first, count, table, work)
                if grain.shape[0] > 0:
                    roughen(
                        view,
                        v,
                        count,
                        key[y, first : first + count],
                        table,
                        grain,
                        tiles,
                        clear,
                        np.float32(light.wet),
                        up,
                        mirrored,
                        work,
                    )
                if settling.size > 0:
                    settle_snow(v, count, key[y, first : first + count], settling, up, uneven, work)
                if light.headlights > 0.0:
                    if behind_lamps(view, v, first, count, to_body, offset[0] - LAMP_X):
                        work[H : H + BLOCK] = ZERO
                    else:
                        throw_light(v, count, light, to_body, offset, work)
                if lamps.light.size > 0 and light.lamps > 0.0:
                    lay_street_light(view, v, count, np.float32(light.lamps), lamps, work)
                if light.air.thinning > 0.0:
                    thin_fog(v, count, light.air, up, view.centre[2], work)
                _surfaces(v, count, light, sun, up, work)
            if empty:
                sky(v, count, light, up, work)
                if grain.shape[0] > 0:
                    vary_sky(view, v, count, light, sun, tiles, work)
                if light.disc * light.glow > 0.0:
                    disc(v, count, light, sun, work)
            develop(count, exposure, work, out[y, first : first + count])
