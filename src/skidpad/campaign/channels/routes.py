"""The six routes on which channels are driven (C-210), as data."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from enum import Enum
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

from msgspec import structs

from skidpad.core.courses import Route
from skidpad.core.errors import require_choice
from skidpad.core.files.reading import convert_plain, decode_yaml
from skidpad.core.run import ChannelCrew, RunSpec
from skidpad.core.vocabulary import SensorLevel, Stratum
from skidpad.core.weather import Weather
from skidpad.physics.presets import preset

FILE = "routes.yaml"
PACK = 20  # vehicles at least that stay around the ego in the stratum of risky drivers


class Condition(str, Enum):
    """The weather and light in which a route is driven."""

    OWN = "own"  # of the route, as published (C-210)
    DAY = "day"
    NIGHT = "night"
    RAIN = "rain"
    ICE = "ice"


# CARLA's units. Day and rain have the sun of a forenoon; rain is that of the published mid rain,
# ice that of icy_30 of the friction study.
CONDITIONS = {
    Condition.DAY: Weather(name="day", cloudiness=20.0, sun_altitude_deg=45.0),
    Condition.NIGHT: Weather(name="night", cloudiness=20.0, sun_altitude_deg=-30.0),
    Condition.RAIN: Weather(
        name="rain",
        cloudiness=80.0,
        precipitation=60.0,
        precipitation_deposits=60.0,
        wetness=80.0,
        wind_intensity=40.0,
        sun_altitude_deg=45.0,
    ),
    Condition.ICE: replace(preset("icy_30"), name="ice", title="", sun_altitude_deg=45.0),
}


def _run_on(name: str, row: dict[str, Any]) -> RunSpec:
    """Returns a run of a shipped route, as its file describes it; ConfigError for what does not fit."""
    course, where = {**row, "name": name}, f"{FILE}: {name}"
    weather = convert_plain(course.pop("weather", None), Weather, where)
    return RunSpec(
        driver=ChannelCrew(),
        course=convert_plain(course, Route, where),
        weather=replace(weather, name=name),
        sensors=SensorLevel.OBJECTS,
    )


@lru_cache(maxsize=1)
def driven_routes() -> dict[str, RunSpec]:
    """Returns a run of each shipped route by name."""
    text = resources.files("skidpad.campaign.channels").joinpath(FILE).read_bytes()
    rows = decode_yaml(text, FILE, dict[str, dict[str, Any]])
    return {name: _run_on(name, row) for name, row in rows.items()}


def chosen_routes(
    name: str,
    map: str | Path | None = None,
    conditions: Iterable[Condition] = (Condition.OWN,),
    strata: Iterable[Stratum] = (Stratum.NATURAL,),
    drivers_mind_weather: bool = True,
) -> list[RunSpec]:
    """Returns the route of this name, or `all`, in each condition and stratum; on `map` if given.

    Raises ConfigError for an unknown name.
    """
    routes = driven_routes()
    require_choice("route", name, ["all", *routes])
    chosen = list(routes.values()) if name == "all" else [routes[name]]
    return [
        _variant(run, condition, stratum, map, drivers_mind_weather)
        for stratum in dict.fromkeys(strata)
        for condition in dict.fromkeys(conditions)
        for run in chosen
    ]


def _variant(
    run: RunSpec, condition: Condition, stratum: Stratum, map: str | Path | None, minds: bool
) -> RunSpec:
    """Returns the run in a condition and stratum, whose name tells them unless they are its own."""
    course = run.course
    assert isinstance(course, Route)
    words = [condition.value] * (condition is not Condition.OWN)
    words += [stratum.value] * (stratum is not Stratum.NATURAL)
    return structs.replace(
        run,
        weather=CONDITIONS.get(condition, run.weather),
        course=structs.replace(
            course,
            name="_".join([course.name, *words]),
            base=course.name if words else "",
            map=course.map if map is None else str(map),
            vehicles=max(course.vehicles, PACK * (stratum is Stratum.RISKY)),
            stratum=stratum,
            drivers_mind_weather=minds,
        ),
    )
