"""How a wet road dries after rain: evaporation everywhere, and traffic that throws water out of its paths.

Both rates are those of RoadSurf, the road weather model of the Finnish Meteorological Institute
(fmidev/RoadSurf: `BoundaryLayer.f90`, `Cond.f90`, `Storage.f90`, defaults of `InputParameters.h`). Traffic
takes 10 max(0.145 W, 0.06) mm per hour of W mm, half of it below 0.9 mm and nothing below 0.1 mm.
Evaporation is rho c (e_road - e_air) / (gamma r L), with saturated air on the road and r the aerodynamic
resistance of neutral air, 30 s/m at most. Assumptions: the film above the texture is the water that it
counts; a relative humidity of 70 %, as weather has none; the road keeps its temperature. Nothing was
compared with a road that dried: off unless a surface asks for it. Valid: above 0 C, films to 2 mm; it knows
no runoff.
"""

from __future__ import annotations

from math import exp, log

from skidpad.core.weather import Weather
from skidpad.physics.wind import wind_of_intensity

HUMIDITY = 0.7
CALM = 1.5  # m/s, least wind by day
RESISTANCE_MOST = 30.0  # s/m
LATENT = 2.452e6  # J/kg
WATER = 999.87  # kg/m^3
PROFILE = log((10.0 + 0.4) / 0.4) * log((10.0 + 0.001) / 0.001) / 0.4**2
WORN, WORN_LEAST = 0.145, 0.06  # 1/h and mm/h, times WEAR
WEAR, DAMP_WEAR = 10.0, 0.5  # of traffic, and its share below WET mm
WET, DAMP = 0.9, 0.1  # mm
STEP = 0.5  # min


def saturated_kpa(celsius: float) -> float:
    """Returns the pressure of saturated water vapour over water in kPa."""
    return 0.61078 * exp(17.269 * celsius / (celsius + 237.3))


def evaporation_mm_h(weather: Weather) -> float:
    """Returns the water that evaporates from a wet road in mm/h; 0 where dew would fall, or in frost."""
    air, road = weather.air_temperature_c, weather.road_temperature_c
    if road <= 0.0 or air <= 0.0:
        return 0.0
    kelvin = air + 273.15
    density, heat = 100_000.0 / (287.05 * kelvin), 1005.0 + (kelvin - 250.0) ** 2 / 3364.0
    psychrometric = 0.1 * (0.00063 * kelvin + 0.47496)  # kPa/K
    wind = max(wind_of_intensity(weather.wind_intensity), CALM)
    resistance = min(PROFILE / wind, RESISTANCE_MOST)
    deficit = saturated_kpa(road) - HUMIDITY * saturated_kpa(air)
    flux = density * heat * deficit / (psychrometric * resistance)  # W/m^2
    return max(flux / (LATENT * WATER) * 1000.0 * 3600.0, 0.0)


def wear_mm_h(film_mm: float) -> float:
    """Returns the water in mm/h that traffic throws out of its wheel paths."""
    if film_mm < DAMP:
        return 0.0
    share = 1.0 if film_mm > WET else DAMP_WEAR
    return share * WEAR * max(WORN * film_mm, WORN_LEAST)


def dried_film(film_mm: float, minutes: float, weather: Weather, *, traffic: bool) -> float:
    """Returns the film in mm that is left after so many minutes without rain; in rain nothing dries.

    traffic: it lies in the wheel paths.
    """
    if minutes <= 0.0 or weather.precipitation > 0.0:
        return film_mm
    evaporation = evaporation_mm_h(weather)
    for k in range(int(minutes / STEP) + 1):
        hours = min(STEP, minutes - k * STEP) / 60.0
        film_mm -= hours * (evaporation + (wear_mm_h(film_mm) if traffic else 0.0))
        if film_mm <= 0.0:
            return 0.0
    return film_mm
