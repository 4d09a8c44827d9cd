"""`skidpad search`: which values of a scenario make a stack fail, and what would have been enough."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from msgspec import Meta, Struct

from skidpad.cli.asked import Controller, PlayCross, Tuned
from skidpad.cli.campaigns import CORES, Workers
from skidpad.cli.spread import spread_fields
from skidpad.core.run import RunSpec, Scenario
from skidpad.core.vocabulary import SensorLevel

if TYPE_CHECKING:
    from skidpad.campaign.worker import Runner
    from skidpad.core.space import Space, Variable
    from skidpad.recording.searches import Search, Trial

scenario_options = spread_fields(sensors=SensorLevel.OBJECTS, duration=60.0)


class Varied(Struct, frozen=True):
    """What varies, and how it is searched."""

    vary: Annotated[
        tuple[str, ...],
        Meta(
            description="NAME=LOW:HIGH, NAME=normal(MEAN,SIGMA), NAME=lognormal(MEAN,SIGMA) or "
            "NAME=one|other; NAME: a parameter of the file, weather, or weather.FIELD."
        ),
    ] = ()
    method: Annotated[
        str,
        Meta(
            description="cma: spread out, then descend from the nearest misses; tpe (extra search); "
            "halton; random."
        ),
    ] = "cma"
    objective: Annotated[
        str, Meta(description="What ranks runs without contact: combined, gap, ttc, braking.")
    ] = "combined"
    budget: Annotated[int, Meta(ge=1, le=1_000_000, description="Runs of the search.")] = 500
    search_seed: Annotated[int, Meta(ge=0, description="Of the points that are chosen.")] = 1


@scenario_options
def search(
    file: Annotated[
        Path,
        typer.Argument(
            help="A scenario (.xosc), a file of parameter distributions for one, or a name of the "
            "catalogue."
        ),
    ],
    varied: Varied,
    cross: PlayCross,
    controller: Controller,
    run: RunSpec,
    scenario: Scenario,
    tuned: Tuned,
    out: Annotated[Path, typer.Option(help="Folder for trials, failures and the page.")],
    workers: Workers = CORES,
    cluster: Annotated[
        str | None, typer.Option(help="Dask scheduler's address, or local:N.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Finish a search.")] = False,
) -> None:
    """Find the values of a scenario that make the ego crash or leave the road.

    A failure is a contact above 5 km/h (with a person or a two-wheeler any) or a departure that the
    reference driver avoids in the same place; others are listed apart. The page shows each kind with
    the smallest change that makes it harmless.
    """
    from skidpad.core.errors import require_choice
    from skidpad.recording.searches import Search
    from skidpad.search.loop import write_search
    from skidpad.search.margin import OBJECTIVES
    from skidpad.search.methods import METHODS

    require_choice("--method", varied.method, tuple(METHODS))
    require_choice("--objective", varied.objective, tuple(OBJECTIVES))
    played, space = _space(file, varied)
    template = template_of(played, cross, controller, run, scenario, tuned)
    require_parameters(template, space)
    found = Search(
        run=template.to_plain(), space=space, method=varied.method, objective=varied.objective,
        budget=varied.budget, seed=varied.search_seed,
    )  # fmt: skip
    known = write_search(out, found, resume=resume)
    with runner_of(workers, cluster) as runner:
        _drive(found, out, runner, known)
    from skidpad.report.search import write_search_report

    typer.echo(write_search_report(out))


def _drive(found: Search, out: Path, runner: Runner, known: Sequence[Trial]) -> None:
    from rich.progress import Progress

    from skidpad.cli.progress import console
    from skidpad.search.failures import look_at_failures, write_findings
    from skidpad.search.loop import search as drive_search

    with Progress(console=console, disable=not console.is_terminal) as shown:
        bar = shown.add_task("searching", total=found.budget)
        trials, failures = [], 0
        try:
            for trial in drive_search(found, out, runner, known):
                trials.append(trial)
                failures += trial.is_failure
                shown.update(bar, advance=1, description=f"searching, {failures} failures")
        except KeyboardInterrupt:
            console.print(f"interrupted; what is done is kept: --out {out} --resume finishes it")
            raise SystemExit(130) from None
        shown.update(bar, description="looking at failures")
        write_findings(out, found, look_at_failures(found, trials, runner))


def _space(file: Path, varied: Varied) -> tuple[Path, Space]:
    """Return the scenario and what varies in it; `--vary` comes over what a file says."""
    from skidpad.core.space import Space
    from skidpad.search.space import check_space, parse_variable

    scenario, of_file = read_varied(file)
    given = [parse_variable(text) for text in varied.vary]
    kept = [v for v in of_file if v.name not in {g.name for g in given}]
    return scenario, check_space(Space((*kept, *given)))


def read_varied(file: Path) -> tuple[Path, tuple[Variable, ...]]:
    """Return the scenario that a file is or names, and what the file itself says that varies."""
    from skidpad.core.errors import FileError
    from skidpad.scenarios.distributions import is_distribution
    from skidpad.scenarios.shipped import NAMES, scenario_file
    from skidpad.search.files import read_space

    if not file.exists() and str(file) in NAMES:
        file = scenario_file(str(file))
    if not file.is_file():
        raise FileError(
            f"scenario {file}: there is no such file; the catalogue has {', '.join(NAMES)}"
        )
    if not is_distribution(file):
        return file, ()
    scenario, space = read_space(file)
    return scenario, space.variables


def template_of(
    file: Path,
    cross: PlayCross,
    controller: Controller,
    run: RunSpec,
    scenario: Scenario,
    tuned: Tuned,
) -> RunSpec:
    """Return the one run that a scenario makes with these options."""
    from msgspec import structs

    from skidpad.campaign.files import runs_of
    from skidpad.cli.asked import OF_FILE
    from skidpad.cli.play import PLAIN
    from skidpad.core.errors import ConfigError
    from skidpad.physics.presets import find_weather

    frictions, grip = cross.frictions()
    if len(frictions) > 1 or "," in cross.weather:
        raise ConfigError(
            "a search has one weather and one grip; --vary weather=one|other varies it"
        )
    base = structs.replace(
        tuned.resolve(run, grip=grip),
        driver=controller.chosen(),
        course=structs.replace(scenario, parameters=cross.parameters()),
        weather=find_weather(PLAIN),
    )
    weather = None if cross.weather == OF_FILE else find_weather(cross.weather)
    (found,) = runs_of(base, [file], [weather], frictions, [cross.seed])
    return found


def require_parameters(template: RunSpec, space: Space) -> None:
    """Raise FileError where the file declares no parameter of a name that varies."""
    from skidpad.campaign.cast import load_scenario
    from skidpad.campaign.grip_cells import scenario_of
    from skidpad.search.space import apply_values

    load_scenario(scenario_of(template))
    middle = apply_values(template, space.values([0.5] * len(space.variables)))
    load_scenario(scenario_of(middle))


@contextmanager
def runner_of(workers: int, cluster: str | None) -> Iterator[Runner]:
    """Yield what drives batches of runs: processes of this machine, or a cluster."""
    from skidpad.campaign import cluster as machines
    from skidpad.campaign.pool import keep_workers

    if cluster is None:
        with keep_workers(workers) as runner:
            yield runner
    else:
        with machines.runner_of(cluster) as runner:
            yield runner
