"""The six routes on which channels are driven (C-210), as data."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from importlib import resources
from pathlib import Path

import msgspec

from skidpad.core.errors import require_choice, require_range
from skidpad.core.weather import Weather


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivenRoute:
    """Where, in which weather and among whom."""

    title: str
    map: str  # bundled, or a file
    weather: Weather
    vehicles: int
    parked: int
    pedestrians: int
    cyclists: int
    name: str = ""

    def __post_init__(self) -> None:
        for field in ("vehicles", "parked", "pedestrians", "cyclists"):
            require_range(f"route.{field}", getattr(self, field), 0, 80)


@lru_cache(maxsize=1)
def driven_routes() -> dict[str, DrivenRoute]:
    """The shipped routes by name."""
    text = resources.files("skidpad.campaign").joinpath("channel_routes.yaml").read_bytes()
    rows = msgspec.yaml.decode(text, type=dict[str, DrivenRoute])
    return {
        name: replace(row, name=name, weather=replace(row.weather, name=name))
        for name, row in rows.items()
    }


def chosen_routes(name: str, map: str | Path | None = None) -> list[DrivenRoute]:
    """The route with this name, or `all`; on another map if one is given."""
    routes = driven_routes()
    require_choice("route", name, ["all", *routes])
    chosen = list(routes.values()) if name == "all" else [routes[name]]
    return chosen if map is None else [replace(r, map=str(map)) for r in chosen]
