"""Weather to light and radio waves: extinction, sight, daylight, rain on radar.

With `grip`, the only module that turns `Weather` into physical quantities (decision L-1). Sensors
use these under `RangeModel.PHYSICAL`.
"""

from __future__ import annotations

from math import exp, inf, log, log10, radians, sin, sqrt
from typing import NamedTuple

from skidpad.core.inputs import Beam
from skidpad.core.kernels.jit import kernel
from skidpad.core.weather import Weather
from skidpad.physics.droplets import (
    FOG_BACKSCATTER,
    Drops,
    drop_extinction,
    rain_drops,
    snow_flakes,
)
from skidpad.physics.grip import rain_rate

CONTRAST_SEEN = 0.05  # least contrast of the meteorological optical range, WMO-No. 8, 9.1
CONTRAST_CAR = 0.5  # of a car against the road at no distance; our assumption
V_CLEAR = 20_000.0  # m, sight at fog density 0; "clear" in the international visibility code
V_FOG = 50.0  # m, at fog density 100; density 50 then gives 1 km, where fog begins (WMO-No. 8)
FALLOFF = 0.1 * log(
    2.0
)  # 1/m at a fog_falloff of 1: halved each 10 m, Unreal's exponential height fog
LEVEL = 0.01  # m of climb, below which a way counts as level
RAIN_SIGHT_KM, RAIN_SIGHT_EXPONENT = (
    11.6,
    -0.63,
)  # sight in rain of R mm/h; said to be Atlas (1953), not read: an assumption
RAIN_SIGHT_CONTRAST = 0.02  # the contrast of that formula (Koschmieder, 1924)

RADAR_GHZ = 77.0

HEADLIGHT_CANDELA = 10_000.0  # low beam towards a car ahead, UN R112 order of magnitude
HIGH_BEAM_CANDELA = 40_500.0  # least maximum of a class B driving beam, UN R149 table 5
VISIBILITY_MOST = 1000.0  # m, what an estimate begins with
E_SEEN_LUX = 1.0  # illuminance at which a dark object is noticed; Schmidt-Clausen (1982), 1 to 3
NIGHT_LUX = 0.05  # moonless sky with skyglow beside a road
SUN_LUX, DIMMED = (
    133_100.0,
    0.21,
)  # lux beyond the air, and its extinction by one air mass (IES RP-21-84)
CLEAR_SKY, OVERCAST_SKY = (800.0, 15_500.0), (300.0, 21_000.0)  # lux of it, by height of the sun


def fog_extinction(weather: Weather) -> float:
    """Returns the extinction of fog and clear air in 1/m; sight falls geometrically with fog density.

    Koschmieder: sight = ln(1 / contrast) / beta.
    """
    share = weather.fog_density / 100.0
    sight = V_CLEAR * (V_FOG / V_CLEAR) ** share
    return float(-log(CONTRAST_SEEN) / sight)


CLEAR = fog_extinction(Weather())  # 1/m, of air without fog


def rain_extinction(rain_mm_h: float) -> float:
    """Returns the extinction of rain in 1/m; 0 without rain. See RAIN_SIGHT_KM."""
    if rain_mm_h <= 0.0:
        return 0.0
    sight = 1000.0 * RAIN_SIGHT_KM * rain_mm_h**RAIN_SIGHT_EXPONENT
    return float(-log(RAIN_SIGHT_CONTRAST) / sight)


def extinction(weather: Weather) -> float:
    """Returns the extinction of visible light in 1/m by fog, clear air and rain together."""
    return fog_extinction(weather) + rain_extinction(rain_rate(weather))


def sight(weather: Weather) -> float:
    """Returns the meteorological optical range in m (5 % contrast of a black target by day)."""
    return -log(CONTRAST_SEEN) / extinction(weather)


def visibility(weather: Weather) -> float:
    """Returns the estimate of visibility in m that automatic headlights use, at most 1000 m (A-220)."""
    return min(sight(weather), VISIBILITY_MOST)


class Air(NamedTuple):
    """What visible light meets on its way."""

    fog: float  # 1/m, extinction of fog and clear air, where the fog lies
    fog_start: float  # m, where they begin
    rain: float  # 1/m, extinction from the lens on
    thinning: float = (
        0.0  # 1/m of height by which the fog falls by a factor of e; 0: alike everywhere
    )
    ground: float = 0.0  # m, height up to which the fog is as dense as it is


def air_of(weather: Weather, ground: float | None = None) -> Air:
    """Returns what this weather puts in the way of visible light.

    ground: m, height above which the fog thins as fog_falloff says; None: it is alike at all heights, as
    is a fog that takes less light than clear air does.
    """
    rain, fog = rain_extinction(rain_rate(weather)), fog_extinction(weather)
    air = Air(fog, float(weather.fog_distance), rain)
    if ground is None or weather.fog_falloff <= 0.0 or fog < 2.0 * CLEAR:
        return air
    return air._replace(thinning=weather.fog_falloff * FALLOFF, ground=ground)


@kernel
def fog_share(air: Air, height: float, climb: float) -> float:
    """Returns the mean density of the fog on a level or sloping way, as a share of that at the ground.

    The density falls with exp(-thinning (z - ground)) above the ground. height: m, where the way begins;
    climb: m from there to its end.
    """
    if air.thinning <= 0.0:
        return 1.0
    begin = height - air.ground
    if abs(climb) < LEVEL:
        return exp(-air.thinning * max(begin, 0.0))
    return (_fog_below(air, begin + climb) - _fog_below(air, begin)) / climb


@kernel
def _fog_below(air: Air, z: float) -> float:
    """Returns the fog between the ground and a height z m above it, in m of the fog at the ground."""
    return (1.0 - exp(-air.thinning * z)) / air.thinning if z > 0.0 else z


@kernel
def air_depth(air: Air, distance: float, height: float = 0.0, climb: float = 0.0) -> float:
    """Returns the optical depth of `distance` m of air, in nepers.

    height: m, of the eye; climb: m, from there to what it sees.
    """
    foggy = max(distance - air.fog_start, 0.0)
    if air.thinning > 0.0 and foggy > 0.0:
        before = climb * air.fog_start / distance
        foggy *= fog_share(air, height + before, climb - before)
    return air.fog * foggy + air.rain * distance


def transmission(weather: Weather, distance: float) -> float:
    """Returns the share of light left after `distance` m; fog begins at the weather's fog_distance."""
    return exp(-air_depth(air_of(weather), float(distance)))


class LidarAir(NamedTuple):
    """What a lidar's beam meets on its way."""

    fog: float = 0.0  # 1/m, extinction of fog and clear air
    fog_start: float = 0.0  # m, where they begin
    falling: float = 0.0  # 1/m, extinction of rain or snow
    backscatter: float = 0.0  # 1/m/sr, of fog
    drops: Drops = Drops()


def snow_rate(weather: Weather) -> float:
    """Returns snowfall in mm/h of water: precipitation in air of 0 C at most, an assumption; else 0."""
    return rain_rate(weather) if weather.air_temperature_c <= 0.0 else 0.0


def lidar_air(weather: Weather) -> LidarAir:
    """Returns what this weather puts into a lidar's way.

    Rain takes what it takes from visible light (`rain_extinction`): drops are far larger than both
    waves. Fog likewise: its extinction at 905 nm is taken as that of visible light.
    """
    fog, snow = fog_extinction(weather), snow_rate(weather)
    drops = snow_flakes(snow) if snow > 0.0 else rain_drops(rain_rate(weather))
    falling = drop_extinction(drops) if snow > 0.0 else rain_extinction(rain_rate(weather))
    sight = -log(CONTRAST_SEEN) / fog
    return LidarAir(fog, weather.fog_distance, falling, FOG_BACKSCATTER / sight, drops)


def daylight(weather: Weather) -> float:
    """Returns the horizontal illuminance in lux of sun and sky; NIGHT_LUX from 12 degrees below on.

    Source: IES RP-21-84, clear (0.8 + 15.5 sqrt(sin h), c 0.21) and overcast sky (0.3 + 21 sin h),
    mixed by cloudiness. Between sun altitudes 0 and -12 degrees it fades by decades to night.
    """
    h = weather.sun_altitude_deg
    rise = sin(radians(max(h, 0.0)))
    beam = SUN_LUX * exp(-DIMMED / rise) * rise if rise > 1e-6 else 0.0
    clear = beam + CLEAR_SKY[0] + CLEAR_SKY[1] * sqrt(rise)
    overcast = OVERCAST_SKY[0] + OVERCAST_SKY[1] * rise
    cloud = weather.cloudiness / 100.0
    lux = (1.0 - cloud) * clear + cloud * overcast
    if h >= 0.0:
        return lux
    dusk = min(-h / 12.0, 1.0)
    return float(lux ** (1.0 - dusk) * NIGHT_LUX**dusk)


def sunlight(weather: Weather) -> tuple[float, float]:
    """Returns the illuminance in lux of the sun on a surface that faces it, and of the sky on a level one.

    Source: as `daylight`, but with the air mass of Kasten and Young (1989), which is finite at the horizon.
    (0, 0) with the sun below it.
    """
    h = weather.sun_altitude_deg
    if h <= 0.0:
        return 0.0, 0.0
    rise, cloud = sin(radians(h)), weather.cloudiness / 100.0
    mass = 1.0 / (rise + 0.50572 * (h + 6.07995) ** -1.6364)
    sun = SUN_LUX * exp(-DIMMED * mass)
    clear = CLEAR_SKY[0] + CLEAR_SKY[1] * sqrt(rise)
    overcast = OVERCAST_SKY[0] + OVERCAST_SKY[1] * rise
    return (1.0 - cloud) * sun, (1.0 - cloud) * clear + cloud * overcast


def _reach(beta: float, start: float, budget: float) -> float:
    """Returns the distance in m at which beta * (r - start) has used up `budget` nepers; inf for beta 0."""
    return start + budget / beta if beta > 0.0 else inf


def _contrast_range(weather: Weather, budget: float) -> float:
    """Returns the distance in m at which fog and rain have used up `budget` nepers of contrast.

    Fog begins at fog_distance, rain at the lens.
    """
    rain, fog = rain_extinction(rain_rate(weather)), fog_extinction(weather)
    near = _reach(rain, 0.0, budget)
    if near <= weather.fog_distance:
        return near
    spent = rain * weather.fog_distance
    return _reach(rain + fog, weather.fog_distance, budget - spent)


def seen_range(weather: Weather) -> float:
    """Returns the distance in m to which people see traffic: `sight`, with fog only from fog_distance on.

    Lamps may be seen farther; how much farther is not modelled.
    """
    return _contrast_range(weather, -log(CONTRAST_SEEN))


def depth_range(weather: Weather) -> float:
    """Returns the distance in m to which a camera still measures depth and tells classes by day.

    A car's contrast falls to the least seen one (Koschmieder); fog begins at fog_distance, rain at
    the lens.
    """
    return _contrast_range(weather, log(CONTRAST_CAR / CONTRAST_SEEN))


def label_range(weather: Weather, beam: Beam = Beam.LOW) -> float:
    """Returns the distance in m to which an unlit object is recognised: by contrast, at night by light.

    At night a beam must throw E_SEEN_LUX through the air onto it: I exp(-beta r) / r^2; 0 without one.
    Night begins below 10 lux.
    """
    by_contrast = depth_range(weather)
    if daylight(weather) >= 10.0 * E_SEEN_LUX:
        return by_contrast
    if beam is Beam.OFF:
        return 0.0
    candela = HIGH_BEAM_CANDELA if beam is Beam.HIGH else HEADLIGHT_CANDELA
    low, high = 0.1, 1000.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        lux = candela / middle**2 * transmission(weather, middle)
        low, high = (middle, high) if lux > E_SEEN_LUX else (low, middle)
    return min(by_contrast, low)


# ITU-R P.838-3, tables 1 and 3 (horizontal polarisation): a, b, c of each term, then m and c.
_K_TERMS = (
    (-5.33980, -0.10008, 1.13098),
    (-0.35351, 1.26970, 0.45400),
    (-0.23789, 0.86036, 0.15354),
    (-0.94158, 0.64552, 0.16817),
)
_K_LINE = (-0.18961, 0.71147)
_ALPHA_TERMS = (
    (-0.14318, 1.82442, -0.55187),
    (0.29591, 0.77564, 0.19822),
    (0.32177, 0.63773, 0.13164),
    (-5.37610, -0.96230, 1.47828),
    (16.1721, -3.29980, 3.43990),
)
_ALPHA_LINE = (0.67849, -1.95537)


def _itu_curve(
    terms: tuple[tuple[float, float, float], ...], line: tuple[float, float], x: float
) -> float:
    """Returns the sum of Gaussian terms (height, centre, width) and a line (slope, offset) at x."""
    return sum(a * exp(-(((x - b) / c) ** 2)) for a, b, c in terms) + line[0] * x + line[1]


def rain_attenuation_db_km(rain_mm_h: float, frequency_ghz: float = RADAR_GHZ) -> float:
    """Returns the attenuation of a radio wave by rain in dB/km, one way, 1 to 1000 GHz (ITU-R P.838-3)."""
    if rain_mm_h <= 0.0:
        return 0.0
    x = log10(frequency_ghz)
    k = 10.0 ** _itu_curve(_K_TERMS, _K_LINE, x)
    return float(k * rain_mm_h ** _itu_curve(_ALPHA_TERMS, _ALPHA_LINE, x))


def radar_loss_db(weather: Weather, distance: float) -> float:
    """Returns the two-way loss in dB of a 77 GHz radar on a target at `distance` m (M-9)."""
    return 2.0 * rain_attenuation_db_km(rain_rate(weather)) * distance / 1000.0


def radar_range(weather: Weather, nominal: float) -> float:
    """Returns the range in m at which a target returns what it returns at `nominal` m in dry air.

    Received power falls with the fourth power of distance and by the rain: solved by bisection.
    """
    low, high = 0.0, nominal
    for _ in range(60):
        middle = 0.5 * (low + high)
        loss = 40.0 * log10(max(middle, 1e-9) / nominal) + radar_loss_db(weather, middle)
        low, high = (middle, high) if loss < 0.0 else (low, middle)
    return high
