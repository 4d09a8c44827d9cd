"""From the options of `skidpad adas` to the runs of a campaign."""

from __future__ import annotations

from collections.abc import Sequence

import typer
from msgspec import structs

from skidpad.campaign.cells.matrix import cross
from skidpad.campaign.driving.run_setup import journey_of, stage_of
from skidpad.campaign.recipes.matrix import missing_vehicles, roads_of
from skidpad.campaign.user_files import road_file
from skidpad.cli.options.carla_backend import map_of
from skidpad.core.errors import ConfigError
from skidpad.core.run import DriverSpec, RunSpec
from skidpad.core.vocabulary import SensorLevel
from skidpad.core.weather import Weather
from skidpad.roads.bundled import bundled_maps, load_map
from skidpad.simulation.world.actors import cast_of


def plan(
    run: RunSpec, drivers: Sequence[DriverSpec], weathers: Sequence[Weather], seeds: int = 1
) -> list[RunSpec]:
    """Returns the runs of a campaign, and says how many vehicles have no place on the map.

    Raises ConfigError or FileError for what cannot be driven.
    """
    roads = roads_of(run)
    roads = structs.replace(roads, map=map_of(roads.map, run.backend))
    journey_of(roads, load_map(road_file(roads)))
    if roads.map not in bundled_maps():  # published places need not fit somebody else's roads
        roads = structs.replace(roads, allow_fewer=True)
        _say_missing(structs.replace(run, course=roads))
    return cross(drivers, weathers, seeds, structs.replace(run, course=roads))


def on_pixels(cells: list[RunSpec], seeds: int) -> list[RunSpec]:
    """Returns the runs of the first `seeds` seeds once more, on pixels.

    Raises ConfigError where the runs are on pixels already or have fewer seeds.
    """
    if seeds and any(c.sensors is SensorLevel.PIXELS for c in cells):
        raise ConfigError("--parity-seeds compares objects with pixels: pass --sensors objects too")
    chosen = sorted({c.seed for c in cells})[:seeds]
    if len(chosen) < seeds:
        raise ConfigError(f"--parity-seeds {seeds} needs as many --seeds; there are {len(chosen)}")
    return [structs.replace(c, sensors=SensorLevel.PIXELS) for c in cells if c.seed in chosen]


def _say_missing(run: RunSpec) -> None:
    """Prints how many vehicles have no place on the map, before anything is driven; else nothing."""
    roads, stage = roads_of(run), stage_of(run)
    missing = missing_vehicles(roads, len(cast_of(stage.map, stage.setup, run.seed)))
    n = roads.vehicles - missing
    if missing:
        typer.echo(
            f"{stage.map.name} has places for {n} of {roads.vehicles} vehicles around the ego, so {n} "
            "drive; --traffic random places them anywhere",
            err=True,
        )
