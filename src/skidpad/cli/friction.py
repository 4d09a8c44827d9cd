"""`skidpad friction`: what a weather does to grip, under both models side by side (decision G-5)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from skidpad.core.weather import Weather
    from skidpad.physics.stopping import GripRow

MEASURED = (
    "Friction measured by braking tests: dry 0.90 to 1.03, wet 0.63 to 0.72, packed snow 0.34, "
    "sheet ice 0.12."
)


def _percent(text: str) -> float:
    """A typer option between 0 and 100."""
    option: float = typer.Option(min=0.0, max=100.0, help=f"{text}, percent.")
    return option


def friction(
    wetness: Annotated[float, _percent("Wetness")] = 0.0,
    deposits: Annotated[float, _percent("Puddles on the road")] = 0.0,
    precipitation: Annotated[float, _percent("Falling rain")] = 0.0,
    ice: Annotated[float, _percent("Ice, of 20 mm")] = 0.0,
    temperature: Annotated[
        float | None, typer.Option(help="Road temperature in C; without it 15, or -5 with ice.")
    ] = None,
    preset: Annotated[
        str | None, typer.Option(help="A preset's name, or a weather file (.yaml).")
    ] = None,
    table: Annotated[bool, typer.Option("--table", help="All presets.")] = False,
    plot: Annotated[
        Path | None, typer.Option(help="Draw the curves of both models to this file.")
    ] = None,
    mu_ref: Annotated[
        float, typer.Option(min=0.05, max=2.0, help="Friction of the dry road.")
    ] = 0.9,
) -> None:
    """Ratio, friction and stopping distances of a weather, statistical and physical model."""
    from skidpad.core.vocabulary import GripModel
    from skidpad.core.weather import Weather
    from skidpad.physics.grip import statistical_ratio
    from skidpad.physics.presets import all_presets, find_weather
    from skidpad.physics.stopping import grip_rows

    if plot is not None:
        from skidpad.cli.friction_figure import draw

        draw(plot, mu_ref)
        typer.echo(f"wrote {plot}")
        return
    if table:
        weathers = list(all_presets().values())
    elif preset is not None:
        weathers = [find_weather(preset)]
    else:
        cold = -5.0 if ice > 0.0 else 15.0
        weather = Weather(
            name="as given",
            wetness=wetness,
            precipitation=precipitation,
            precipitation_deposits=deposits,
            ice_thickness=ice,
            road_temperature_c=cold if temperature is None else temperature,
        )
        if weather.rain_with_ice:
            statistical_ratio(weather)  # says what is wrong
        weathers = [weather]
    _print(weathers, grip_rows(weathers, [GripModel.STATISTICAL, GripModel.PHYSICAL], mu_ref))


def _cells(row: GripRow | None) -> list[str]:
    """Ratio, friction and distances of one model; dashes where it is not defined."""
    if row is None:
        return ["-"] * 5
    distances = [f"{stop.distance:.1f}" for stop in row.stops]
    return [f"{row.ratio:.3f}", f"{row.mu_80:.2f}", *distances]


def _print(weathers: list[Weather], rows: list[GripRow]) -> None:
    from rich.console import Console
    from rich.table import Table

    from skidpad.core.vocabulary import GripModel
    from skidpad.physics.stopping import SPEEDS_KMH

    models = (GripModel.STATISTICAL, GripModel.PHYSICAL)
    table = Table(caption=MEASURED, caption_justify="left", padding=(0, 0))
    table.add_column("weather", no_wrap=True)
    for model in models:
        name = model.value[:4]
        for heading in ("ratio", "mu at 80", *(f"m from {kmh:g}" for kmh in SPEEDS_KMH)):
            table.add_column(f"{name}. {heading}", justify="right")
    for weather in weathers:
        found = {row.model: row for row in rows if row.weather == weather.name}
        cells = [cell for model in models for cell in _cells(found.get(model))]
        table.add_row(weather.name, *cells)
    Console().print(table)
    for weather in weathers:
        if all(row.weather != weather.name or row.model is not models[0] for row in rows):
            typer.echo(f"{weather.name}: the statistical model is not defined for this weather.")
