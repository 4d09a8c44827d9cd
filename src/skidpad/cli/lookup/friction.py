"""`skidpad friction`: what a weather does to grip, under both models side by side (decision G-5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from skidpad.core.weather import Weather
    from skidpad.physics.stopping import GripRow

ANSWER_KMH = 80.0
FLOODED_MM = 1.0  # of water; Bosch calls 1 mm heavy rain, and puddles 2 mm
NAME_WIDTH, CELL = 16, 6  # characters
MEASURED = """\
Braking tests found friction of 0.90 to 1.03 on dry roads; 0.63 to 0.72 on wet
ones, with 0.5 mm of water or less; 0.34 on packed snow; 0.12 on sheet ice. On
deeper water a tyre floats at speed, and the physical model says less."""
SHEET = "Ice of 2 mm is a sheet already: the physical model makes no difference beyond."


def _percent(text: str) -> float:
    """Returns a typer option between 0 and 100 with this help text."""
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
        str,
        typer.Option(
            help="Friction of the dry road: winter (tyres, 0.9), summer (1.05), a number."
        ),
    ] = "winter",
    tyres: Annotated[
        str, typer.Option(help="Tyres, such as summer, all_season, studded, winter_4mm.")
    ] = "winter",
) -> None:
    """Say how far to a stop in a weather, and what grip is left in both models.

    Example: skidpad friction --preset rain_60
    """
    from skidpad.core.environment.tyres import find_tyres
    from skidpad.core.settings.parts import parse_assignments
    from skidpad.core.vocabulary import GripModel
    from skidpad.core.weather import Weather
    from skidpad.physics.presets import all_presets, find_weather

    mu: float = parse_assignments([f"mu_ref={mu_ref}"])["mu_ref"]
    find_tyres(tyres)
    if plot is not None:
        from skidpad.cli.lookup.friction_figure import draw

        draw(plot, mu)
        typer.echo(f"wrote {plot}")
        return
    weathers = list(all_presets().values()) if table else []
    if preset is not None and not table:
        weathers = [find_weather(preset)]
    from skidpad.physics.grip import statistical_ratio
    from skidpad.physics.stopping import grip_rows

    if not weathers:
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
    dry = replace(find_weather("clear-noon"), name="dry")
    models = [GripModel.STATISTICAL, GripModel.PHYSICAL]
    rows = grip_rows([*weathers, dry], models, mu, tyres)
    for line in (*_answer(weathers, rows, mu), *_table(weathers, rows)):
        typer.echo(line)


def _answer(weathers: Sequence[Weather], rows: Sequence[GripRow], mu: float) -> list[str]:
    """Returns lines on how far it is to a stop in the one weather; of several, a heading alone."""
    from skidpad.core.vocabulary import GripModel
    from skidpad.physics.grip import road_surface
    from skidpad.physics.stopping import SPEEDS_KMH

    if len(weathers) > 1:
        return [f"Stops from {', '.join(f'{kmh:g}' for kmh in SPEEDS_KMH)} km/h, m; dry mu {mu:g}."]
    k = SPEEDS_KMH.index(ANSWER_KMH)
    by = {(row.weather, row.model): row.stops[k].distance for row in rows}
    (weather,) = weathers
    here, dry = (by[name, GripModel.PHYSICAL] for name in (weather.name, "dry"))
    lines = [f"{ANSWER_KMH:g} km/h: stop in {here:.0f} m, {dry:.0f} m dry."]
    published = by.get((weather.name, GripModel.STATISTICAL))
    if published is not None:
        lines[0] += f" The published model says {published:.0f} m."
    film = road_surface(weather).film_mm
    if film:
        flooded = ": flooded, deeper than wet braking tests have it" if film > FLOODED_MM else ""
        lines.append(f"On the road: {film:.1f} mm of water{flooded}.")
    return [*lines, ""]


def _table(weathers: Sequence[Weather], rows: Sequence[GripRow]) -> list[str]:
    """Returns lines of both models side by side, one per weather, in 80 columns, and notes."""
    from skidpad.core.vocabulary import GripModel
    from skidpad.physics.stopping import SPEEDS_KMH

    models = (GripModel.STATISTICAL, GripModel.PHYSICAL)
    heads = ["ratio", "mu80", *(f"m {kmh:g}" for kmh in SPEEDS_KMH)] * len(models)
    wide = CELL * len(heads) // len(models)
    lines = [
        " " * NAME_WIDTH
        + "".join(f"{model.value:^{wide}}".rstrip().ljust(wide) for model in models),
        "weather".ljust(NAME_WIDTH) + "".join(f"{head:>{CELL}}" for head in heads),
    ]
    found = {(row.weather, row.model): row for row in rows}
    for weather in weathers:
        cells = [c for model in models for c in _cells(found.get((weather.name, model)))]
        name = weather.name
        short = name if len(name) < NAME_WIDTH else f"{name[: NAME_WIDTH - 2]}…"
        lines.append(f"{short:<{NAME_WIDTH}}" + "".join(f"{cell:>{CELL}}" for cell in cells))
    lines += ["", MEASURED]
    if any(weather.ice_thickness > 0.0 for weather in weathers):
        lines.append(SHEET)
    lines += [
        f"{weather.name}: the statistical model is not defined for this weather."
        for weather in weathers
        if (weather.name, models[0]) not in found
    ]
    return [*lines, "Next: skidpad grip --out DIR drives with this grip and without it, in pairs."]


def _cells(row: GripRow | None) -> list[str]:
    """Returns ratio, friction and distances in m of one model as text; dashes for None."""
    if row is None:
        return ["-"] * 5
    distances = [f"{stop.distance:.1f}" for stop in row.stops]
    return [f"{row.ratio:.3f}", f"{row.mu_80:.2f}", *distances]
