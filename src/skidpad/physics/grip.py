"""Weather to tyre friction: what lies on the road, and what grip it leaves.

With `optics`, the only module that turns `Weather` into physical quantities (decision L-1).
mu = mu_ref * ratio. The statistical ratio is the published one of the friction study; the physical
one follows measurements, below, and depends on speed, on a dry road too.

The wet part is fitted to the friction table of the Bosch Automotive Handbook ("Coefficients of
static friction for pneumatic tires on various surfaces", new tyres, 0.2, 1 and 2 mm of water, 50, 90
and 130 km/h; read in a transcript, scribd 77622580). It contradicts braking tests of today's tyres,
whose tracks are said to carry about as much water: docs/physics.md shows both.
Valid: film up to 2 mm, 0 to 130 km/h, road -20 to 40 C.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import ConfigError
from skidpad.core.jit import inner_kernel, kernel
from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather

MU_REF = 0.9  # dry road at tire_friction 3.5; UN R13-H's nominal test surface (decision M-1)

# --- what lies on the road
RAIN_FULL = 50.0  # mm/h at precipitation 100: our assumption, a violent shower
FILM_WET = 0.2  # mm at wetness 100: "wet" in the table of Bosch, whose heavy rain means 1 mm
FILM_STANDING = 0.5  # mm of mean depth added at deposits 100; our assumption
ICE_FULL_MM = 20.0  # at ice_thickness 100 (B-017)
TEXTURE_MM = 0.8  # mean texture depth of dense asphalt; our assumption
DRAIN_LENGTH = 7.0  # m, two lanes
DRAIN_SLOPE = 0.02  # crossfall; our assumption

# --- what grip it leaves
V_REFERENCE = 40.0 * 0.44704  # m/s at which mu_ref holds: peak braking coefficients are measured at
# 40 mph (ASTM E1337, named in 49 CFR 571.126 S6.2.2)
DRY_FALL = 0.0054  # s/m, share of mu_ref lost per m/s; Bosch: 0.85, 0.80, 0.75 at 50, 90, 130 km/h
V_FALL = 60.0  # m/s, beyond which it falls no more; keeps the law positive
WET_LOSS = 0.20  # of dry grip on a wetted texture; fit to Bosch
WET_FILM = 0.02  # mm that takes 63 % of it: our assumption. Kulakowski and Harwood, ASTM STP 1031
# (1990), find a significant loss between 0.025 and 0.23 mm
V_HALF, V_HALF_FILM = 8.0, 17.5  # m/s, m/s mm: speed that halves grip on up to 1 mm, fit to Bosch
FILM_WEDGE = 1.0  # mm, more water than the tread takes at low speed already; fit to Bosch
V_WEDGE = 19.8  # m/s at which 1 mm beyond that has halved grip once more; fit to Bosch
FILM_MAX = 2.0  # mm, deepest water of that table; deeper counts as this
FLOATING = (
    0.04  # share of wet grip that a fully floating tyre keeps; our assumption (Bosch: 0 to 0.07)
)
ICE_MU = 0.117  # sheet ice, winter tyres: 12.5 m from 12 mph, What Car? n11592; -5 C is assumed
ICE_MU_REF_C = -5.0
ICE_MU_PER_C = -0.006  # colder ice grips better; our assumption
ICE_MU_RANGE = (0.05, 0.20)  # wet ice at 0 C, and below -19 C; our assumption
SNOW_MU = 0.34  # winter tyre on snow: 29.1 m from 50 km/h, ADAC all-season tyre test, 24 April 2018
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
    """Friction as a function of speed: mu_ref * (firm + bare * dry(v) * afloat(v)), see `ratio_at`."""

    mu_ref: float
    firm: float  # part of the ratio that speed does not change
    bare: float  # part that it does
    fall: float = 0.0  # s/m, of the bare part on a dry road
    lift: float = 0.0  # (s/m)^2, one over the square of the speed that halves grip on thin water
    wedge: float = 0.0  # (s/m)^2, the same where water is deeper than the tread takes


def rain_rate(weather: Weather) -> float:
    """Rain in mm/h, linear in precipitation. Source of the full scale: see RAIN_FULL."""
    return RAIN_FULL * weather.precipitation / 100.0


def runoff_film(rain_mm_h: float) -> float:
    """Depth in mm of rain flowing off the road, above its texture.

    After Gallaway, Schiller and Rose, TTI report 138-5 (1971), which relates these quantities; the
    numbers in d = 0.01485 T^0.11 L^0.43 I^0.59 / S^0.42 - T were not found in a public text.
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


def ice_mu(road_temperature_c: float, wet: bool) -> float:
    """Friction of sheet ice; water on it makes it as slippery as at the melting point."""
    temperature = 0.0 if wet else min(road_temperature_c, 0.0)
    low, high = ICE_MU_RANGE
    return min(max(ICE_MU + ICE_MU_PER_C * (temperature - ICE_MU_REF_C), low), high)


def physical_params(surface: RoadSurface, mu_ref: float = MU_REF) -> GripParams:
    """Grip of a surface from measurements.

    Wet: a loss that saturates with the film; water lifts the contact with the square of speed, and
    what the tread cannot take does so suddenly. Ice covers as it fills the texture; snow hides what
    is below it.
    """
    film = min(surface.film_mm, FILM_MAX)
    bare = 1.0 - WET_LOSS * (1.0 - exp(-film / WET_FILM))
    ice_cover = min(surface.ice_mm / TEXTURE_MM, 1.0)
    snow_cover = min(surface.snow_mm / SNOW_COVER_MM, 1.0)
    bare *= (1.0 - ice_cover) * (1.0 - snow_cover)
    ice = ice_mu(surface.road_temperature_c, wet=film > 0.0 or surface.rain_mm_h > 0.0) / MU_REF
    firm = ice_cover * (1.0 - snow_cover) * ice + snow_cover * SNOW_MU / MU_REF
    thin, deep = min(film, FILM_WEDGE), max(film - FILM_WEDGE, 0.0)
    lift = (thin / (V_HALF * thin + V_HALF_FILM)) ** 2
    return GripParams(mu_ref, firm, bare, DRY_FALL, lift, deep / V_WEDGE**2)


def _none(_: Weather, mu_ref: float) -> GripParams:
    return GripParams(mu_ref, 1.0, 0.0)


def _statistical(weather: Weather, mu_ref: float) -> GripParams:
    return GripParams(mu_ref, statistical_ratio(weather), 0.0)


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


@inner_kernel
def dry_ratio(params: GripParams, v: float) -> float:
    """Friction of the same road when dry at speed v in m/s, over mu_ref."""
    return 1.0 + params.fall * (V_REFERENCE - min(v, V_FALL))


@inner_kernel
def afloat(params: GripParams, v: float) -> float:
    """Share of its grip that water leaves a tyre at speed v in m/s."""
    lifted, wedged = params.lift * v * v, params.wedge * v * v
    return max(1.0 / ((1.0 + lifted) * (1.0 + wedged * wedged * wedged)), FLOATING)


@kernel
def ratio_at(params: GripParams, v: float) -> float:
    """Friction at speed v in m/s over mu_ref."""
    return params.firm + params.bare * dry_ratio(params, v) * afloat(params, v)


@kernel
def left_at(params: GripParams, v: float) -> float:
    """Share that the weather leaves of the friction of the same road when dry, at speed v in m/s."""
    return ratio_at(params, v) / dry_ratio(params, v)


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
    return float(left_at(grip_params(weather, model), v))
