"""The six routes on which channels are driven (C-210), as data."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from importlib import resources
from pathlib import Path

from msgspec import Struct, structs, yaml

from skidpad.core.errors import require_choice
from skidpad.core.run import ChannelCrew, Route, RunSpec
from skidpad.core.vocabulary import SensorLevel
from skidpad.core.weather import Weather


class _Row(Struct, frozen=True, forbid_unknown_fields=True):
    title: str
    map: str
    weather: Weather
    vehicles: int
    parked: int
    pedestrians: int
    cyclists: int

    def run(self, name: str) -> RunSpec:
        """A segment of the route."""
        plain = structs.asdict(self)
        weather = replace(plain.pop("weather"), name=name)
        return RunSpec(
            driver=ChannelCrew(),
            course=Route(name=name, **plain),
            weather=weather,
            sensors=SensorLevel.OBJECTS,
        )


@lru_cache(maxsize=1)
def driven_routes() -> dict[str, RunSpec]:
    """The shipped routes by name: where, in which weather and among whom."""
    text = resources.files("skidpad.campaign").joinpath("channel_routes.yaml").read_bytes()
    rows = yaml.decode(text, type=dict[str, _Row])
    return {name: row.run(name) for name, row in rows.items()}


def chosen_routes(name: str, map: str | Path | None = None) -> list[RunSpec]:
    """The route with this name, or `all`; on another map if one is given."""
    routes = driven_routes()
    require_choice("route", name, ["all", *routes])
    chosen = list(routes.values()) if name == "all" else [routes[name]]
    if map is None:
        return chosen
    return [structs.replace(r, course=structs.replace(r.course, map=str(map))) for r in chosen]
