"""`skidpad play`: play an OpenSCENARIO file, or say what in it cannot be played."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from msgspec import structs

from skidpad.cli.asked import Controller, Tuned
from skidpad.cli.spread import spread
from skidpad.core.run import BackendChoice, RunSpec, Scenario
from skidpad.core.vocabulary import SensorLevel


@spread(sensors=SensorLevel.OBJECTS, duration=120.0)
def play(
    file: Annotated[Path, typer.Argument(help="OpenSCENARIO XML 1.0 to 1.3 (.xosc).")],
    controller: Controller,
    run: RunSpec,
    scenario: Scenario,
    tuned: Tuned,
    backend: BackendChoice,
    out: Annotated[Path | None, typer.Option(help="Folder for the run.")] = None,
    weather: Annotated[str, typer.Option(help="A preset or a YAML file.")] = "clear-noon",
    grip: Annotated[str, typer.Option(help="none, statistical or physical.")] = "physical",
    seed: Annotated[int, typer.Option(help="Of sensor noise and road.")] = 1,
    param: Annotated[
        list[str] | None, typer.Option(help="A parameter of the file: NAME=VALUE.")
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="List what is not supported; run nothing.")
    ] = False,
) -> None:
    """Play a scenario; prints how it ended and where the log lies."""
    from skidpad.core.errors import ConfigError

    if check:
        _check(file)
        return
    if out is None:
        raise ConfigError("play needs --out DIR for the run, or --check")
    from skidpad.campaign.play import run_to
    from skidpad.cli.carla_backend import checked
    from skidpad.physics.presets import find_weather

    parameters = _parameters(param or [])
    driven = run_to(
        structs.replace(
            tuned.resolve(run, grip=grip),
            driver=controller.chosen(),
            course=structs.replace(scenario, file=str(file.resolve()), parameters=parameters),
            weather=find_weather(weather),
            seed=seed,
            backend=checked(backend),
        ),
        out,
    )
    log = driven.log
    seconds = float(log.t[-1]) if len(log) else 0.0
    typer.echo(f"{driven.outcome.value} after {seconds:.2f} s; log in {out}")
    if driven.error:
        typer.echo(driven.error.strip().split("\n")[-1], err=True)


def _check(file: Path) -> None:
    from skidpad.scenarios.player import load, problems

    found = problems(file)
    for problem in found:
        typer.echo(f"{file.name}, line {problem.line}: {problem.what}")
    if not found:
        load(file)  # what is wrong rather than unknown raises, with its line
        typer.echo(f"{file.name}: everything in it is supported")
        return
    raise typer.Exit(2)


def _parameters(assignments: list[str]) -> dict[str, float | str]:
    from skidpad.core.errors import ConfigError

    values: dict[str, float | str] = {}
    for text in assignments:
        name, equals, value = text.partition("=")
        if not equals:
            raise ConfigError(f"--param takes NAME=VALUE, got {text!r}")
        values[name.strip()] = value.strip()
    return values
