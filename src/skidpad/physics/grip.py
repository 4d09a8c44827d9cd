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

from dataclasses import dataclass
from math import exp
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.environment.tyres import REFERENCE, Tyres, find_tyres
from skidpad.core.errors import ConfigError
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.setup import Setup
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
V_HALF_WORN, V_HALF_FILM_WORN = 11.7, 1.17  # the same with 1.6 mm of tread, least squares over the
# six worn values of Bosch's table at 0.2 and 1 mm; between, linear in the tread: our assumption
WORN_DRY = 1.18  # dry friction of a worn tyre over that of a new one: Bosch, 1.0 over 0.85
FILM_WEDGE = 1.0  # mm, more water than the tread takes at low speed already; fit to Bosch
V_WEDGE = 19.8  # m/s at which 1 mm beyond that has halved grip once more; fit to Bosch
FILM_MAX = 2.0  # mm, deepest water of that table; for friction, deeper counts as this
DEEPEST = 10.0  # mm, deepest water that a wheel pushes aside
FLOATING = (
    0.04  # share of wet grip that a fully floating tyre keeps; our assumption (Bosch: 0 to 0.07)
)
ICE_MU = 0.117  # sheet ice, winter tyres: 12.5 m from 12 mph, What Car? n11592; -5 C is assumed
ICE_MU_REF_C = -5.0
ICE_MU_PER_C = -0.006  # colder ice grips better; our assumption
ICE_MU_RANGE = (0.05, 0.20)  # wet ice at 0 C, and below -19 C; our assumption
ICE_TREAD_MM = 4.0  # of tread and less: a tyre is worn on ice; our assumption
SNOW_COVER_MM = 5.0  # depth that hides the road; our assumption
# Slip stiffness over that of a dry road. Packed snow: a fit to SAE 2006-01-1627 (CRREL, abstract): side
# force reaches 90 % of its maximum at slip angles of 7 to 10 degrees; 0.22 to 0.32 give that range.
# Ice: Burckhardt's curves have an initial slope c1 c2 - c3 of 30.2 (dry) and 15.3 (ice, not read): an
# assumption. His 18.3 on snow (not read) would mean 0.60, and 90 % at 4 degrees.
SNOW_STIFFNESS, ICE_STIFFNESS = 0.26, 0.51

# Displacement drag 0.5 C_D rho w d v^2, as AMC 25.1591 of EASA has it for aeroplane tyres; the page
# was found, its section on drag and its 0.75 were not read, so both are an assumption.
WATER_DRAG, WATER_DENSITY = 0.75, 1000.0  # -, kg/m^3
# Share of the film that a wheel leaves to the one behind it: our assumption. Metz (SAE 2011-01-0986 and
# tests at Volk Field, abstracts) finds that the clearing is significant.
CLEARED = 0.2


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
    firm_stiffness: float = 1.0  # slip stiffness over the dry one: the part that speed leaves
    bare_stiffness: float = 0.0  # the part that falls as water lifts the tyre
    film: float = 0.0  # m of water that a wheel pushes aside; 0: its drag is left out


def rain_rate(weather: Weather) -> float:
    """Returns the rain in mm/h, linear in precipitation; source of the full scale: see RAIN_FULL."""
    return RAIN_FULL * weather.precipitation / 100.0


def runoff_film(
    rain_mm_h: float, length: float = DRAIN_LENGTH, slope: float = DRAIN_SLOPE
) -> float:
    """Returns the depth in mm of rain flowing off the road, above its texture; 0 where the texture holds it.

    length: m that the water has flowed, down a slope. After Gallaway, Schiller and Rose, TTI report 138-5
    (1971), which relates these quantities; the numbers in d = 0.01485 T^0.11 L^0.43 I^0.59 / S^0.42 - T
    were not found in a public text.
    """
    depth = 0.01485 * TEXTURE_MM**0.11 * length**0.43 * rain_mm_h**0.59 / slope**0.42
    return float(max(depth - TEXTURE_MM, 0.0))


def road_surface(weather: Weather) -> RoadSurface:
    """Returns the water, ice and snow on the road (decision M-10).

    Film: a wetted texture by wetness, standing water by deposits, runoff by the rain that falls; 0 where
    ice on a road below 0 C gets no rain. Ice: linear, 20 mm at 100 (B-017). Sources at the constants above.
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
    """Returns the share of dry grip by wetness and deposits: equation 3.1 of the friction study (B-030)."""
    w = weather.wetness / 100.0
    p = weather.precipitation_deposits / 100.0
    return 0.6 * exp(-0.916 * w) * (1.0 - w) ** 3 + 0.4 - 0.1 * p


def ice_ratio(weather: Weather) -> float:
    """Returns the share of dry grip by ice thickness: equation 3.2 of the friction study (B-031)."""
    i = weather.ice_thickness / 100.0
    return 0.85 * exp(-1.89711 * i) * (1.0 - i) ** 3 + 0.15


def statistical_ratio(weather: Weather) -> float:
    """Returns the published share of dry grip: by ice alone when there is ice, else by rain (B-040).

    ConfigError for rain together with ice, for which the study defines no ratio (B-002), and for snow.
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
    """Returns the friction of sheet ice; water on it makes it as slippery as at the melting point."""
    temperature = 0.0 if wet else min(road_temperature_c, 0.0)
    low, high = ICE_MU_RANGE
    return min(max(ICE_MU + ICE_MU_PER_C * (temperature - ICE_MU_REF_C), low), high)


def dry_friction(tyres: Tyres) -> float:
    """Returns the friction of these tyres on the dry road on which new winter tyres have MU_REF."""
    return tyres.dry * (1.0 + (WORN_DRY - 1.0) * tyres.wear)


def physical_params(
    surface: RoadSurface,
    mu_ref: float = MU_REF,
    tyres: Tyres | None = None,
    *,
    stiffness: bool = False,
    drag: bool = False,
) -> GripParams:
    """Returns the grip of a surface by the physical model, from measurements.

    Wet: a loss that saturates with the film; water lifts the contact with the square of speed, and
    what the tread cannot take does so suddenly. Ice covers as it fills the texture; snow hides what
    is below it. tyres: None is the winter tyre, new. stiffness: slip stiffness falls too. drag:
    wheels push the water aside.
    """
    tyres = find_tyres(REFERENCE) if tyres is None else tyres
    film = min(surface.film_mm, FILM_MAX)
    bare = 1.0 - WET_LOSS * (1.0 - exp(-film / WET_FILM))
    ice_cover = min(surface.ice_mm / TEXTURE_MM, 1.0)
    snow_cover = min(surface.snow_mm / SNOW_COVER_MM, 1.0)
    open_road = (1.0 - ice_cover) * (1.0 - snow_cover)
    dry = dry_friction(tyres)
    ice, snow = _on_ice(surface, tyres, wet=film > 0.0), _on_snow(tyres)
    firm = ice_cover * (1.0 - snow_cover) * ice / dry + snow_cover * snow / dry
    thin, deep = min(film, FILM_WEDGE), max(film - FILM_WEDGE, 0.0)
    half = V_HALF + (V_HALF_WORN - V_HALF) * tyres.wear
    half_film = V_HALF_FILM + (V_HALF_FILM_WORN - V_HALF_FILM) * tyres.wear
    lift = (thin / (half * thin + half_film)) ** 2
    firm_stiffness = 1.0
    if stiffness:
        firm_stiffness = ice_cover * (1.0 - snow_cover) * ICE_STIFFNESS
        firm_stiffness += snow_cover * SNOW_STIFFNESS
    return GripParams(
        mu_ref * (dry / MU_REF), firm, bare * open_road, DRY_FALL, lift, deep / V_WEDGE**2,
        firm_stiffness, open_road if stiffness else 0.0,
        min(surface.film_mm, DEEPEST) / 1000.0 if drag else 0.0,
    )  # fmt: skip


def _on_ice(surface: RoadSurface, tyres: Tyres, *, wet: bool) -> float:
    """Returns the friction on sheet ice: that of the winter tyre, scaled by what these tyres have at -5 C."""
    own = tyres.ice if tyres.tread_mm > ICE_TREAD_MM else tyres.worn_ice
    ice = ice_mu(surface.road_temperature_c, wet=wet or surface.rain_mm_h > 0.0)
    return ice * (own / ICE_MU)


def _on_snow(tyres: Tyres) -> float:
    """Returns the friction on packed snow.

    With wear it falls to that of a summer tyre, linear: an assumption.
    """
    worn = min(tyres.snow, find_tyres("summer").snow)
    return tyres.snow + (worn - tyres.snow) * tyres.wear


@dataclass(frozen=True, slots=True)
class Road:
    """What decides the grip of a run outside of patches, for every kind of tyre.

    This is the replaceable component of B-003: weather, model and mu_ref in, grip over speed out.
    """

    weather: Weather
    model: GripModel
    mu_ref: float = MU_REF  # of a dry road with new winter tyres of tire_friction 3.5
    tyres: str = REFERENCE  # of vehicles that have none of their own
    stiffness: bool = False  # slip stiffness falls on water, snow and ice
    drag: bool = False  # wheels push water aside

    def params(self, tyres: str | None = None, surface: RoadSurface | None = None) -> GripParams:
        """Returns the grip of vehicles with these tyres, by default the run's.

        surface: what lies there, then by the physical model whatever the run's. ConfigError for unknown tyres
        and for weather that the statistical model does not know.
        """
        kind = find_tyres(self.tyres if tyres is None else tyres)
        if surface is None and self.model is not GripModel.PHYSICAL:
            ratio = 1.0 if self.model is GripModel.NONE else statistical_ratio(self.weather)
            return GripParams(self.mu_ref * (dry_friction(kind) / MU_REF), ratio, 0.0)
        return physical_params(
            road_surface(self.weather) if surface is None else surface,
            self.mu_ref, kind, stiffness=self.stiffness, drag=self.drag,
        )  # fmt: skip


def road_of(setup: Setup) -> Road:
    """Returns the road of a set-up, for the grip outside of patches."""
    return Road(
        setup.weather, setup.grip, setup.mu_ref, setup.tyres, setup.tyre_stiffness,
        setup.water_drag,
    )  # fmt: skip


def grip_params(weather: Weather, model: GripModel, mu_ref: float = MU_REF) -> GripParams:
    """Returns the grip of this weather under this model on new winter tyres, for `mu_at`."""
    return Road(weather, model, mu_ref).params()


@inner_kernel
def dry_ratio(params: GripParams, v: float) -> float:
    """Returns the friction of the same road when dry at speed v in m/s, over mu_ref."""
    return 1.0 + params.fall * (V_REFERENCE - min(v, V_FALL))


@inner_kernel
def afloat(params: GripParams, v: float) -> float:
    """Returns the share of its grip that water leaves a tyre at speed v in m/s, FLOATING at least."""
    lifted, wedged = params.lift * v * v, params.wedge * v * v
    return max(1.0 / ((1.0 + lifted) * (1.0 + wedged * wedged * wedged)), FLOATING)


@kernel
def ratio_at(params: GripParams, v: float) -> float:
    """Returns the friction at speed v in m/s over mu_ref."""
    return params.firm + params.bare * dry_ratio(params, v) * afloat(params, v)


@kernel
def left_at(params: GripParams, v: float) -> float:
    """Returns the share that the weather leaves of the same road's friction when dry, at v in m/s."""
    return ratio_at(params, v) / dry_ratio(params, v)


@kernel
def mu_at(params: GripParams, v: float) -> float:
    """Returns the friction coefficient at speed v in m/s of a tyre with tire_friction 3.5."""
    return params.mu_ref * ratio_at(params, v)


@kernel
def stiffness_at(params: GripParams, v: float) -> float:
    """Returns the slip stiffness at speed v in m/s over that on a dry road, along and across.

    Water keeps a share of the contact's length off the road; the rest carries load and shears. A
    brush's stiffness is 2 c a^2 with half the length a, so it falls with the square of the share
    that `afloat` leaves of the friction.
    """
    if params.bare_stiffness == 0.0:
        return params.firm_stiffness
    left = afloat(params, v)
    return params.firm_stiffness + params.bare_stiffness * left * left


@inner_kernel
def grip_of_row(grips: NDArray[np.float64], i: int) -> GripParams:
    """Returns row i of an array whose columns are the fields of GripParams."""
    g = grips[i]
    return GripParams(g[0], g[1], g[2], g[3], g[4], g[5], g[6], g[7], g[8])


@inner_kernel
def water_drag(film: float, width: float, behind: bool) -> float:
    """Returns the drag of a wheel that pushes water aside, in N over the square of the speed in m/s.

    film: m deep; width: m of the tyre; behind: in the track that another wheel has cleared.
    """
    depth = film * CLEARED if behind else film
    return 0.5 * WATER_DRAG * WATER_DENSITY * width * depth


def friction_ratio(weather: Weather, model: GripModel, v: float = 0.0) -> float:
    """Returns the share of dry grip that this weather leaves at v in m/s; 1 under GripModel.NONE.

    ConfigError for weather that the statistical model does not know.
    """
    return float(left_at(grip_params(weather, model), v))
