"""Weather to tyre friction: what lies on the road, and what grip it leaves.

With `optics`, the only module that turns `Weather` into physical quantities (decision L-1).
mu = mu_ref * ratio. The statistical ratio is the published one of the friction study; the physical
one follows measurements, below, and depends on speed. Its parameter set belongs to winter tyres
with 6 mm of tread at mu_ref 0.9 (dry stop 0.90, What Car? n11594).
Valid: film up to 3 mm, 0 to 130 km/h, road -20 to 40 C.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import ConfigError
from skidpad.core.jit import kernel
from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather

MU_REF = 0.9  # dry road at tire_friction 3.5; UN R13-H's nominal test surface (decision M-1)

# --- what lies on the road
RAIN_FULL = 50.0  # mm/h at precipitation 100: "violent shower", UK Met Office fact sheet 3
FILM_WET = 0.5  # mm at wetness 100: the least depth of a wet test track, UN R117 annex 5
FILM_STANDING = 0.5  # mm of mean depth added at deposits 100; our assumption, same source's spread
ICE_FULL_MM = 20.0  # at ice_thickness 100 (B-017)
TEXTURE_MM = (
    0.8  # mean texture depth of dense asphalt, Anderson et al., NCHRP web document 16 (1998)
)
DRAIN_LENGTH = 7.0  # m, two lanes
DRAIN_SLOPE = 0.02  # crossfall

# --- what grip it leaves
WET_LOSS = 0.2  # of dry grip on a wetted texture; Kulakowski and Harwood, ASTM STP 1031 (1990)
WET_FILM = 0.02  # mm that takes 63 % of it; same: 0.025 mm takes 20 to 30 % on smooth surfaces
FILM_TREAD = 2.5  # mm, film of which 37 % still drains through 6 mm of tread; fit to wet stops
FLOATING = 0.05  # share of wet grip that a fully floating tyre keeps; our assumption
TYRE_PRESSURE_PSI = 32.0
TREAD_32NDS = 8.0  # tread depth in 1/32 inch, 6.4 mm
SPIN_DOWN_PCT = 10.0  # of the wheel's speed lost at onset of hydroplaning
ICE_MU = 0.117  # sheet ice at -5 C, winter tyres, What Car? n11592
ICE_MU_REF_C = -5.0
ICE_MU_PER_C = -0.006  # colder ice grips better; Higgins, Miles and Hay, Wear 265 (2008)
ICE_MU_RANGE = (0.05, 0.20)  # wet ice at 0 C, and below -19 C
SNOW_MU = 0.34  # packed snow, ADAC 2018 winter tyre test
SNOW_COVER_MM = 5.0  # depth that hides the road; our assumption


@dataclass(frozen=True, slots=True)
class RoadSurface:
    """What lies on the road."""

    film_mm: float  # water above the texture's asperities
    ice_mm: float
    snow_mm: float
    rain_mm_h: float
    road_temperature_c: float


class GripParams(NamedTuple):
    """Friction as a function of speed: mu_ref * (firm + wet * max(1 - k v^2, FLOATING))."""

    mu_ref: float
    firm: float  # part of the ratio that speed does not change
    wet: float  # part that the water lifts
    k: float  # (s/m)^2


def rain_rate(weather: Weather) -> float:
    """Rain in mm/h, linear in precipitation. Source of the full scale: see RAIN_FULL."""
    return RAIN_FULL * weather.precipitation / 100.0


def runoff_film(rain_mm_h: float) -> float:
    """Depth in mm of rain flowing off the road, above its texture.

    Source: Gallaway, Schiller and Rose, TTI report 138-5 (1971), as used by PAVDRN (NCHRP web
    document 16): d = 0.01485 T^0.11 L^0.43 I^0.59 / S^0.42 - T.
    """
    depth = 0.01485 * TEXTURE_MM**0.11 * DRAIN_LENGTH**0.43 * rain_mm_h**0.59 / DRAIN_SLOPE**0.42
    return float(max(depth - TEXTURE_MM, 0.0))


def road_surface(weather: Weather) -> RoadSurface:
    """Water, ice and snow on the road (decision M-10).

    Film: a wetted texture by wetness, standing water by deposits, runoff by the rain that falls.
    Ice: linear, 20 mm at 100 (B-017). Sources at the constants above.
    """
    rain = rain_rate(weather)
    film = FILM_WET * weather.wetness / 100.0
    film += FILM_STANDING * weather.precipitation_deposits / 100.0
    frozen = weather.ice_thickness > 0.0 and weather.road_temperature_c < 0.0
    return RoadSurface(
        film_mm=0.0 if frozen and not weather.rain_with_ice else film + runoff_film(rain),
        ice_mm=ICE_FULL_MM * weather.ice_thickness / 100.0,
        snow_mm=weather.snow_depth_mm,
        rain_mm_h=rain,
        road_temperature_c=weather.road_temperature_c,
    )


def rain_ratio(weather: Weather) -> float:
    """Equation 3.1 of the friction study (B-030): wetness w and deposits p."""
    w = weather.wetness / 100.0
    p = weather.precipitation_deposits / 100.0
    return 0.6 * exp(-0.916 * w) * (1.0 - w) ** 3 + 0.4 - 0.1 * p


def ice_ratio(weather: Weather) -> float:
    """Equation 3.2 of the friction study (B-031): ice thickness i."""
    i = weather.ice_thickness / 100.0
    return 0.85 * exp(-1.89711 * i) * (1.0 - i) ** 3 + 0.15


def statistical_ratio(weather: Weather) -> float:
    """The published ratio: ice alone decides when there is ice, else the rain formula (B-040).

    Rain together with ice is refused: the study defines no ratio for it (B-002).
    """
    if weather.rain_with_ice:
        raise ConfigError(
            f"weather {weather.name or 'given'}: ice_thickness {weather.ice_thickness:g} together with "
            f"precipitation {weather.precipitation:g} or deposits {weather.precipitation_deposits:g}; "
            "the statistical grip model needs one of them to be 0"
        )
    if weather.snow_depth_mm > 0.0:
        raise ConfigError(
            f"weather {weather.name or 'given'}: snow_depth_mm {weather.snow_depth_mm:g} needs "
            "the physical grip model; the statistical one knows rain and ice only"
        )
    return ice_ratio(weather) if weather.ice_thickness > 0.0 else rain_ratio(weather)


def hydroplaning_speed(film_mm: float) -> float:
    """Speed in m/s at which a rolling tyre floats on this film; inf without one.

    Source: Gallaway et al., FHWA-RD-79-31 (1979), fitted to 2.5 to 25 mm; used below that for the
    trend only, weighted by the share that the tread cannot drain.
    """
    if film_mm <= 0.0:
        return float("inf")
    depth_in = film_mm / 25.4
    texture_in = TEXTURE_MM / 25.4
    a = max(
        10.409 / depth_in**0.06 + 3.507,
        (28.952 / depth_in**0.06 - 7.817) * texture_in**0.14,
    )
    mph = SPIN_DOWN_PCT**0.04 * TYRE_PRESSURE_PSI**0.3 * (TREAD_32NDS + 1.0) ** 0.06 * a
    return float(mph * 0.44704)


def ice_mu(road_temperature_c: float, wet: bool) -> float:
    """Friction of sheet ice; water on it makes it as slippery as at the melting point."""
    temperature = 0.0 if wet else min(road_temperature_c, 0.0)
    low, high = ICE_MU_RANGE
    return min(max(ICE_MU + ICE_MU_PER_C * (temperature - ICE_MU_REF_C), low), high)


def physical_params(surface: RoadSurface, mu_ref: float = MU_REF) -> GripParams:
    """Grip of a surface from measurements.

    Wet: a loss that saturates with the film; then the water wedge lifts a share of the contact that
    grows with the square of speed, up to floating at the hydroplaning speed (Horne and Dreher,
    NASA TN D-2056, 1963). Ice covers as it fills the texture; snow hides what is below it.
    """
    film = surface.film_mm
    wet = 1.0 - WET_LOSS * (1.0 - exp(-film / WET_FILM))
    undrained = 1.0 - exp(-film / FILM_TREAD)
    k = undrained / hydroplaning_speed(film) ** 2 if film > 0.0 else 0.0
    ice_cover = min(surface.ice_mm / TEXTURE_MM, 1.0)
    snow_cover = min(surface.snow_mm / SNOW_COVER_MM, 1.0)
    bare = (1.0 - ice_cover) * (1.0 - snow_cover)
    ice = ice_mu(surface.road_temperature_c, wet=film > 0.0 or surface.rain_mm_h > 0.0) / MU_REF
    firm = ice_cover * (1.0 - snow_cover) * ice + snow_cover * SNOW_MU / MU_REF
    return GripParams(mu_ref, firm, bare * wet, k)


def _none(_: Weather, mu_ref: float) -> GripParams:
    return GripParams(mu_ref, 1.0, 0.0, 0.0)


def _statistical(weather: Weather, mu_ref: float) -> GripParams:
    return GripParams(mu_ref, statistical_ratio(weather), 0.0, 0.0)


def _physical(weather: Weather, mu_ref: float) -> GripParams:
    return physical_params(road_surface(weather), mu_ref)


# The replaceable component of B-003: weather and mu_ref in, grip over speed out.
MODELS: dict[GripModel, Callable[[Weather, float], GripParams]] = {
    GripModel.NONE: _none,
    GripModel.STATISTICAL: _statistical,
    GripModel.PHYSICAL: _physical,
}


def grip_params(weather: Weather, model: GripModel, mu_ref: float = MU_REF) -> GripParams:
    """Grip of this weather under this model, for `mu_at`."""
    return MODELS[model](weather, mu_ref)


@kernel
def ratio_at(params: GripParams, v: float) -> float:
    """Share of dry grip left at speed v in m/s."""
    return params.firm + params.wet * max(1.0 - params.k * v * v, FLOATING)


@kernel
def mu_at(params: GripParams, v: float) -> float:
    """Friction coefficient at speed v in m/s of a tyre with tire_friction 3.5."""
    return params.mu_ref * ratio_at(params, v)


@kernel
def fill_mu(
    params: GripParams, vx: NDArray[np.float64], vy: NDArray[np.float64], out: NDArray[np.float64]
) -> None:
    """mu of all four tyres of n vehicles by their speeds. vx, vy (n,); out (n, 4)."""
    for i in range(vx.shape[0]):
        out[i, :] = mu_at(params, sqrt(vx[i] * vx[i] + vy[i] * vy[i]))


def friction_ratio(weather: Weather, model: GripModel, v: float = 0.0) -> float:
    """Share of dry grip that this weather leaves at speed v in m/s; 1 under GripModel.NONE."""
    return float(ratio_at(grip_params(weather, model), v))
