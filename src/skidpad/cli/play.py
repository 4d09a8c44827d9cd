"""`skidpad play`: play an OpenSCENARIO file, or say what in it cannot be played."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from skidpad.cli.server_options import Backend, Host, Port, ServerWish


def play(
    file: Annotated[Path, typer.Argument(help="OpenSCENARIO XML 1.0 to 1.3 (.xosc).")],
    out: Annotated[Path | None, typer.Option(help="Folder for the run.")] = None,
    ego: Annotated[str | None, typer.Option(help="Which entity is the ego.")] = None,
    controller: Annotated[
        str, typer.Option(help="stack, ideal (as the file says), module:Class, agent:PATH:CLASS.")
    ] = "stack",
    actors: Annotated[
        str, typer.Option(help="physical: tyres decide; ideal: as the file says.")
    ] = "physical",
    weather: Annotated[str, typer.Option(help="A preset or a YAML file.")] = "clear-noon",
    grip: Annotated[str, typer.Option(help="none, statistical or physical.")] = "physical",
    sensors: Annotated[str, typer.Option(help="objects, or pixels: real images.")] = "objects",
    config: Annotated[int, typer.Option(min=0, max=4, help="Configuration of our stack.")] = 2,
    seed: Annotated[int, typer.Option(help="Of sensor noise and road.")] = 1,
    param: Annotated[
        list[str] | None, typer.Option(help="A parameter of the file: NAME=VALUE.")
    ] = None,
    backend: Backend = "embedded",
    host: Host = "127.0.0.1",
    port: Port = 2000,
    duration: Annotated[float, typer.Option(help="Longest time, s.")] = 120.0,
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
    from skidpad.campaign.play import Play, check_controller, play_to
    from skidpad.cli.carla_backend import backend_choice
    from skidpad.core.errors import require_choice
    from skidpad.core.vocabulary import GripModel, SensorLevel
    from skidpad.physics.presets import find_weather
    from skidpad.scenarios.scene import Mode

    check_controller(controller)
    climate = find_weather(weather)
    wish = Play(
        file=file,
        label=controller,
        weather=climate,
        seed=seed,
        parameters=_parameters(param or []),
        ego=ego,
        controller=controller,
        config=config,
        grip=GripModel(require_choice("--grip", grip, [g.value for g in GripModel])),
        level=SensorLevel(require_choice("--sensors", sensors, ("objects", "pixels"))),
        actors=Mode(require_choice("--actors", actors, ("physical", "ideal"))),
        duration=duration,
    )
    choice = backend_choice(ServerWish(backend=backend, host=host, port=port))
    played = play_to(wish, out, choice)
    log = played.run.log
    seconds = float(log.t[-1]) if len(log) else 0.0
    typer.echo(f"{played.outcome.value} after {seconds:.2f} s; log in {out}")
    if played.run.error:
        typer.echo(played.run.error.strip().split("\n")[-1], err=True)


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
