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
    GLOSS,
    GLOW,
    GX,
    GY,
    LANES,
    ONE,
    WETTABLE,
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
from skidpad.sensors.pictures.height_fog import thin_fog
from skidpad.sensors.pictures.lighting import Lighting
from skidpad.sensors.pictures.roughness import MORE_LANES, NO_TILES, make_tiles, roughen, vary_sky
from skidpad.sensors.pictures.settled_snow import NOTHING_SETTLES, SHARE, STEEP, settle_snow
from skidpad.sensors.pictures.sky import disc, sky
from skidpad.sensors.pictures.street_lamps import lay_street_light
from skidpad.sensors.raster.view import View
from skidpad.sensors.scene.grain import NO_GRAIN, TINTS
from skidpad.sensors.scene.materials import (
    ACTOR_PAINTED,
    ASPHALTS,
    EMISSIVE,
    FIELDS,
    MATERIALS,
    POLISHED,
    Material,
)
from skidpad.sensors.scene.static import StaticScene
from skidpad.sensors.scene.street_light import NO_STREET_LIGHT, StreetLight

ROADLIKE = (*ASPHALTS, Material.SHOULDER, Material.MARKING, Material.SIDEWALK)
SNOWY = (
    Material.GRASS,
    Material.EMBANKMENT,
    Material.SHOULDER,
    Material.SIDEWALK,
    Material.MEDIAN,
    Material.ROOF,
    *FIELDS,
)
SNOWED = (*ASPHALTS, Material.MARKING)
SNOW_LEFT = 0.72  # share of a driven road that packed snow covers; by eye
SNOW_IN_TRACKS = 0.56  # and of it where wheels roll
ICE_LEFT = 0.62  # share of a driven road that ice hides; by eye
ICE_IN_TRACKS = 0.44  # and of it where wheels roll
FROSTED = 0.5  # share of snow's white that hoar frost has, wherever there is ice; by eye
SETTLED = 0.92  # share of what looks up, off the road, that snow covers
STEEPER, TWIGS_STEEPER = (
    0.25,
    0.08,
)  # of 1, how much less evergreens and bare crowns must look up for it
STAINED = 0.06  # share of the tints of surfaces that is left on snow
GLOSSY = (Material.PAINT, Material.GLASS, Material.LAMP_GLASS)
WET_DARKENING = 0.52  # of asphalt's albedo; Lekner and Dorf (1988) give 0.4 to 0.7
SNOW = np.array([0.80, 0.83, 0.88], dtype=np.float32)
ICE = np.array([0.52, 0.63, 0.76], dtype=np.float32)
TWIGS = np.array([98, 86, 76], dtype=np.float32)  # grey levels of bare crowns
BARE = 0.85  # share of a crown's colour that twigs make where snow lies
NO_LEAVES = np.zeros(0, dtype=np.intp)
BRAKE_LIGHT = np.array([1.5, 0.03, 0.03], dtype=np.float32)  # of lit lamps, linear
INDICATOR_LIGHT = np.array([1.5, 0.55, 0.03], dtype=np.float32)
BEHIND_BY = 1e-3  # of a ray's length, so that rounding cannot bring a point before the lamps
HEADLAMP_X, HEADLAMP_Z = 1.75, 0.65  # m, in the ego's frame


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
        self._grain = _grain_in(light, grain, for_people)
        self._settling = _settling(light, leafy, green) if for_people else NOTHING_SETTLES
        self._tiles = make_tiles() if grain.size else NO_TILES
        self.light = light
        self._table = _look_up(_in_season(palette, leafy, light), table, light, for_people)
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


def _in_season(palette: Floats32, leafy: NDArray[np.intp], light: Lighting) -> Floats32:
    """Returns the palette with bare crowns in snow and ice; leafy: materials of broad-leaved crowns."""
    winter = max(light.snow, light.ice)
    if winter <= 0.0 or not leafy.size:
        return palette
    result: Floats32 = palette.copy()
    result[leafy] += np.float32(BARE * winter) * (TWIGS - result[leafy])
    return result


def _look_up(palette: Floats32, table: ActorTable, light: Lighting, for_people: bool) -> Floats32:
    """Returns ((n + 1) * 256, COLUMNS): colour and behaviour of each material, on the map and each actor."""
    n = len(table)
    out = np.zeros((n + 1, MATERIALS, COLUMNS), dtype=np.float32)
    out[:, :, :3] = np.square(palette / np.float32(255.0))
    for material in ACTOR_PAINTED:
        out[1:, material, :3] = np.square(table.rgb.astype(np.float32) / 255.0)[:, None].squeeze(1)
    for material in EMISSIVE:
        out[:, material, GLOW] = 1.0
    out[:, list(ROADLIKE), WETTABLE] = 1.0
    out[:, list(GLOSSY), GLOSS] = 1.0
    for material in SNOWY:
        out[:, material, :3] += _whiteness(light) * (SNOW - out[:, material, :3])
    if for_people:
        for material in SNOWED:
            is_rolled = material in POLISHED
            ice, snow = (ICE_IN_TRACKS, SNOW_IN_TRACKS) if is_rolled else (ICE_LEFT, SNOW_LEFT)
            out[:, material, :3] += ice * light.ice * (ICE - out[:, material, :3])
            out[:, material, :3] += snow * light.snow * (SNOW - out[:, material, :3])
    out[:, Material.HEADLAMP, GLOW] = 0.9 * light.lamps
    shining = out[:, Material.HEADLAMP, :3] - out[:, Material.LAMP_GLASS, :3]
    out[:, Material.LAMP_GLASS, :3] += min(light.lamps, 1.0) * shining
    out[:, Material.LAMP_GLASS, GLOW] = 0.9 * light.lamps
    out[:, Material.TAIL_LAMP, GLOW] = 0.8 * light.lamps
    pane = out[:, Material.GLASS, :3]  # by day nothing tells which windows will be lit
    out[:, Material.LIT_WINDOW, :3] = pane + min(light.lamps, 1.0) * (
        out[:, Material.LIT_WINDOW, :3] - pane
    )
    out[:, Material.LIT_WINDOW, GLOW] = 1.6 * light.lamps  # of a dull pane, so about a third
    return out.reshape(-1, COLUMNS)


def _whiteness(light: Lighting) -> float:
    """Returns how white the ground beside a driven road is, 0 .. 1: of snow, or of frost where ice is."""
    return max(light.snow, FROSTED * light.ice)


def _grain_in(light: Lighting, grain: Floats32, for_people: bool) -> Floats32:
    """Returns the unevenness of surfaces in a weather: snow evens it out, ice and it hide their tints."""
    left = grain * np.float32(1.0 - 0.6 * light.snow)
    if grain.size:
        white = [*SNOWY, *(SNOWED if for_people else ())]
        left[white, TINTS] *= np.float32(1.0 - (1.0 - STAINED) * max(light.snow, light.ice))
    result: Floats32 = left
    return result


def _settling(light: Lighting, leafy: NDArray[np.intp], green: NDArray[np.intp]) -> Floats32:
    """Returns (256, 2) how snow or frost lies on each material of the map; empty without both.

    leafy, green: materials of bare crowns, and of what keeps its leaves or needles.
    """
    if _whiteness(light) <= 0.0:
        return NOTHING_SETTLES
    shares = np.zeros((MATERIALS, 2), dtype=np.float32)
    shares[:, SHARE] = SETTLED * _whiteness(light)
    shares[leafy, STEEP], shares[green, STEEP] = TWIGS_STEEPER, STEEPER
    shares[[*SNOWY, *SNOWED, *EMISSIVE, Material.LAMP_HOUSING, Material.LAMP_DARK], SHARE] = 0.0
    return shares


_HALF, _TWO, _THREE = np.float32(0.5), np.float32(2.0), np.float32(3.0)
_TINY = np.float32(1e-12)
_GLOSS_SHARE = np.float32(0.35)
_F0 = np.float32(0.03)  # reflectance of water and glass at normal incidence, about
_BEAM_WIDTH = np.float32(2.6)  # 1 / tangent squared: half the light at 22 deg to the side
_BEAM_RANGE = np.float32(1.0 / 380.0)  # 1/m^2: a low beam lights some 40 m of road
_CUT_SLOPE = np.float32(42.0)  # the cut-off: half the light 1.4 deg above the lamp
_HIGH_RANGE = np.float32(1.0 / 3000.0)  # 1/m^2: a high beam lights some 110 m of road
_HIGH_SLOPE = np.float32(6.0)  # and falls to half 10 deg above the lamp: no cut-off, by eye
_LAMP_X, _LAMP_Z = np.float32(HEADLAMP_X), np.float32(HEADLAMP_Z)
_BEAM_BLUE = np.float32(0.82)
_STREET_GREEN, _STREET_BLUE = np.float32(0.84), np.float32(0.58)
_ON_WALLS = np.float32(0.4)  # share of a street lamp's light that falls on what stands upright
_BEAM_POWER = np.float32(2.6)
_DARK = np.float32(1.0 - WET_DARKENING)
_FILM_SHARE = np.float32(0.8)
_RETRO = np.float32(0.35)  # rough asphalt sends back much of a grazing beam
_FARTHEST = np.float32(1e-6)
_NEAR_LAMP, _LAMP_APART = np.float32(0.3), np.float32(1.2)  # m


@inner_kernel
def beam_at(
    px: np.float32,
    py: np.float32,
    pz: np.float32,
    beam: np.float32,
    slope: np.float32,
    reach: np.float32,
) -> np.float32:
    """Returns the light of the beam at a point (m, lamps' frame): a soft cone that falls above its cut-off.

    beam, slope, reach: as by `beam_of`. 0 behind the lamps.
    """
    lead = px if px > _NEAR_LAMP else _NEAR_LAMP
    side = py / (lead + _LAMP_APART)
    rise = pz / lead * slope
    rise = rise if rise > ZERO else ZERO
    spread = ONE + _BEAM_WIDTH * side * side
    fall = ONE + (px * px + py * py) * reach
    lit: np.float32 = beam / (spread * spread * fall * fall * (ONE + rise * rise))
    return lit if px > ZERO else ZERO


@inner_kernel
def rise_of_beam(px: np.float32, onset: np.float32) -> np.float32:
    """Returns the share of the beam that has risen `px` m before the lamps; all of it for an onset of 0."""
    t = px / (onset if onset > ZERO else ONE)
    t = t if t < ONE else ONE
    t = t if onset > ZERO else ONE
    risen: np.float32 = t * t * (_THREE - _TWO * t)
    return risen


@inner_kernel
def beam_of(light: Lighting) -> tuple[np.float32, np.float32, np.float32]:
    """Returns power, slope of the cut-off and reach (1/m^2) of the ego's beam; power 0 where it is off."""
    beam = np.float32(light.headlights) * _BEAM_POWER
    slope = _HIGH_SLOPE if light.high else _CUT_SLOPE
    reach = _HIGH_RANGE if light.high else _BEAM_RANGE
    return beam, slope, reach


@kernel
def behind_lamps(
    view: View, v: np.float32, first: int, count: int, to_body: Floats32, before: np.float32
) -> bool:
    """Returns whether no point that a block can show lies before the lamps.

    before: m by which the camera stands before them. v: m down per m ahead of the block's row.
    """
    ahead = -np.inf
    for column in (first, first + count):
        u = (column - view.cx) / view.focal
        ahead = max(ahead, to_body[0, 0] * u + to_body[0, 1] * v + to_body[0, 2])
    return bool(ahead < -BEHIND_BY and before < 0.0)


@inner_kernel
def _headlights(
    v: np.float32,
    count: int,
    light: Lighting,
    to_body: Floats32,
    offset: Floats32,
    work: Floats32,
) -> None:
    """Writes the light of the ego's beam on a block's pixels into lane H of `work`."""
    beam, slope, reach = beam_of(light)
    onset = np.float32(light.onset)
    b00, b01, b02 = to_body[0, 0], to_body[0, 1], to_body[0, 2]
    b10, b11, b12 = to_body[1, 0], to_body[1, 1], to_body[1, 2]
    b20, b21, b22 = to_body[2, 0], to_body[2, 1], to_body[2, 2]
    o0, o1, o2 = offset[0] - _LAMP_X, offset[1], offset[2] - _LAMP_Z
    for x in range(count):
        u, w = work[U + x], work[W + x]
        z = ONE / (w if w > _FARTHEST else _FARTHEST)
        px = z * (b00 * u + b01 * v + b02) + o0
        py = z * (b10 * u + b11 * v + b12) + o1
        pz = z * (b20 * u + b21 * v + b22) + o2
        work[H + x] = beam_at(px, py, pz, beam, slope, reach) * rise_of_beam(px, onset)


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
                    if behind_lamps(view, v, first, count, to_body, offset[0] - _LAMP_X):
                        work[H : H + BLOCK] = ZERO
                    else:
                        _headlights(v, count, light, to_body, offset, work)
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
