"""Weather, time of day and road of a run as an <EnvironmentAction>."""

from __future__ import annotations

from math import radians
from typing import Any

from scenariogeneration import xosc

from skidpad.scenarios.reading.environment import CELSIUS, HEAVY, Environment, Fall, Wetness

NOON, MIDNIGHT = 12, 0  # h; where the sun stands is said beside it
LIGHT = 100_000.0  # lx of a sun in the zenith
CLEAR = 100_000.0  # m, where a file says nothing of the sight


def environment_action(environment: Environment, *, old: bool) -> Any:
    """Returns the <EnvironmentAction> of an environment.

    old: by the vocabulary of 1.0, where clouds are words and rain is a share.
    """
    elevation = environment.sun_elevation_deg or 0.0
    sun = xosc.Sun(
        1.0 if old else LIGHT if elevation > 0.0 else 0.0,
        round(radians(environment.sun_azimuth_deg or 0.0), 4),
        round(radians(elevation), 4),
    )
    rain = environment.fall_mm_h / HEAVY if old else environment.fall_mm_h
    kind = xosc.PrecipitationType.rain if environment.fall is Fall.RAIN else _DRY
    weather = xosc.Weather(
        _clouds(environment.clouds or 0.0, old=old),
        sun=sun,
        fog=xosc.Fog(round(environment.visual_range or CLEAR, 1)),
        precipitation=xosc.Precipitation(kind, round(rain, 4)),
        **_temperature(environment, old=old),
    )
    wetness = {} if old else {"wetness": getattr(xosc.Wetness, _wetness(environment).value)}
    scale = 1.0 if environment.friction_scale is None else environment.friction_scale
    hour = NOON if elevation > 0.0 else MIDNIGHT
    return xosc.EnvironmentAction(
        xosc.Environment(
            environment.name or "weather",
            xosc.TimeOfDay(False, 2000, 3, 20, hour, 0, 0),
            weather,
            xosc.RoadCondition(scale, **wetness),
        )
    )


_DRY = xosc.PrecipitationType.dry
_OKTAS = ("zero", "one", "two", "three", "four", "five", "six", "seven", "eight")


def _clouds(share: float, *, old: bool) -> Any:
    """Returns the enumeration value for a cloud cover of 0..1: oktas, or a cloud state for old versions."""
    if not old:
        return getattr(xosc.FractionalCloudCover, f"{_OKTAS[round(8.0 * share)]}Oktas")
    words = xosc.CloudState
    return words.free if share < 0.3 else words.cloudy if share < 0.8 else words.overcast


def _temperature(environment: Environment, *, old: bool) -> dict[str, float]:
    """Returns {"temperature": kelvin}; empty for old versions or where the temperature is unknown."""
    if old or environment.temperature_c is None:
        return {}
    return {"temperature": round(environment.temperature_c + CELSIUS, 2)}


def _wetness(environment: Environment) -> Wetness:
    """Returns the wetness of the road; dry where the environment gives none."""
    return environment.wetness or Wetness.DRY
