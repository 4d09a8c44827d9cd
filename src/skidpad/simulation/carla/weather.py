"""Our weather as CARLA's parameters, and ice through the blueprint `skidpad.weather.grip`."""

from __future__ import annotations

from typing import Any

from skidpad.core.weather import Weather

SAME_NAME = (
    "cloudiness",
    "precipitation",
    "precipitation_deposits",
    "wind_intensity",
    "fog_density",
    "fog_distance",
    "fog_falloff",
    "wetness",
    "scattering_intensity",
    "mie_scattering_scale",
    "rayleigh_scattering_scale",
)


def weather_parameters(weather: Weather) -> dict[str, float]:
    """Returns keyword arguments of carla.WeatherParameters; ice, snow and temperatures have none."""
    values = {name: float(getattr(weather, name)) for name in SAME_NAME}
    return values | {
        "sun_azimuth_angle": weather.sun_azimuth_deg,
        "sun_altitude_angle": weather.sun_altitude_deg,
    }


def set_weather(carla: Any, world: Any, weather: Weather) -> None:
    """Sends the weather's parameters to the server."""
    parameters = carla.WeatherParameters()
    for name, value in weather_parameters(weather).items():
        setattr(parameters, name, value)
    world.set_weather(parameters)
