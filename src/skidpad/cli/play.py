"""`skidpad play`: play OpenSCENARIO files, or say what in them cannot be played."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from msgspec import structs

from skidpad.cli.asked import OF_FILE, Controller, PlayCross, Tuned
from skidpad.cli.campaigns import Drive, Driving, How, Seeds
from skidpad.cli.expected import Expected
from skidpad.cli.spread import spread
from skidpad.core.run import BackendChoice, RunSpec, Scenario
from skidpad.core.vocabulary import SensorLevel

if TYPE_CHECKING:
    from skidpad.campaign.campaign import Campaign
    from skidpad.recording.grip import GripKey, GripMetrics

PLAIN = "clear-noon"  # what a file leaves open of the weather
scenario_options = spread(sensors=SensorLevel.OBJECTS, duration=120.0)


@scenario_options
def play_folder(
    how: How,
    folder: Annotated[Path, typer.Argument(help="Folder with .xosc files, at any depth.")],
    cross: PlayCross,
    controller: Controller,
    run: RunSpec,
    scenario: Scenario,
    tuned: Tuned,
    backend: BackendChoice,
    seeds: Seeds = 1,
) -> None:
    """Play every scenario of a folder in every weather, with and without its grip."""
    template = _template(cross, controller, run, scenario, tuned, backend)
    how(_campaign(template, cross, folder, seeds, []), table)


@scenario_options
def play(
    file: Annotated[
        Path, typer.Argument(help="OpenSCENARIO XML 1.0 to 1.3 (.xosc), or a folder of them.")
    ],
    cross: PlayCross,
    controller: Controller,
    run: RunSpec,
    scenario: Scenario,
    tuned: Tuned,
    backend: BackendChoice,
    driving: Driving,
    expected: Expected,
    seeds: Seeds = 1,
    out: Annotated[Path | None, typer.Option(help="Folder for the run, or for the runs.")] = None,
    check: Annotated[
        bool, typer.Option("--check", help="List all that is wrong or unknown; run nothing.")
    ] = False,
) -> None:
    """Play a scenario, or as a campaign all of a folder; prints how it ended and where logs lie."""
    from skidpad.core.errors import ConfigError, FileError

    if not file.exists():
        raise FileError(f"scenario {file}: there is no such file or folder")
    template = _template(cross, controller, run, scenario, tuned, backend)
    expected.rules()  # what cannot be read is said before anything is driven
    if check:
        _check(file, structs.replace(scenario, parameters=cross.parameters()))
        return
    if out is None:
        raise ConfigError("play needs --out DIR for the run, or --check")
    from skidpad.campaign.play import run_to
    from skidpad.scenarios.distributions import is_distribution

    if file.is_dir() or is_distribution(file):
        _drive_all(
            Drive(out=out, **structs.asdict(driving)), template, cross, file, seeds, expected
        )
        return
    runs = _runs(template, cross, [file], seeds)
    if len(runs) > 1:
        raise ConfigError("one file is one run: several weathers, grips or seeds take a folder")
    driven = run_to(runs[0], out)
    log = driven.log
    seconds = float(log.t[-1]) if len(log) else 0.0
    typer.echo(f"{driven.outcome.value} after {seconds:.2f} s; log in {out}")
    _cards(runs[0], out)
    if driven.error:
        typer.echo(driven.error.strip().split("\n")[-1], err=True)
    expected.judge({runs[0].name: out})


def _cards(run: RunSpec, out: Path) -> None:
    """The crash cards of one run, where there was a crash."""
    from skidpad.campaign.cast import load_scenario
    from skidpad.campaign.grip_cells import scenario_of
    from skidpad.report.play import write_crashes

    page = write_crashes(out, load_scenario(scenario_of(run)).map)
    if page is not None:
        typer.echo(f"crash cards in {page}")


def _drive_all(
    how: Drive, template: RunSpec, cross: PlayCross, file: Path, seeds: int, expected: Expected
) -> None:
    """The campaign of a folder, its crash cards, and what was expected of its runs."""
    from skidpad.recording.campaigns import RUNS

    left_out: list[Path] = []
    campaign = _campaign(template, cross, file, seeds, left_out)
    folders: list[Path] = []

    def told(folder: Path) -> str:
        from skidpad.report.play import write_crashes

        folders.append(folder)
        page = write_crashes(folder)
        return table(folder) + ("" if page is None else f"\ncrash cards in {page}")

    how(campaign, told)
    runs = {run.name: folders[0] / RUNS / run.name for run in campaign.tasks}
    if how.until_halfwidth is not None:  # which leaves runs out on purpose
        runs = {name: run for name, run in runs.items() if run.exists()}
    expected.judge(runs, [str(f) for f in left_out])


def table(folder: Path) -> str:
    """How the runs of each cell ended, a line per cell."""
    from skidpad.recording.results import read_results

    lines = []
    for runs in read_results(folder).partition_by("scenario", "weather", "friction"):
        counts = runs["outcome"].value_counts().sort("outcome").iter_rows()
        ended = ", ".join(f"{n} {outcome}" for outcome, n in counts)
        nearest = runs["min_cvip_m"].drop_nulls().to_list()
        told = f"; least distance {min(nearest):.1f} m" if nearest else ""
        first = runs.row(0, named=True)
        cell = f"{first['scenario']} in {first['weather']}, {first['friction']} friction"
        lines.append(f"{cell}: {ended}{told}")
    return "\n".join([*lines, f"results in {folder}"])


def _template(
    cross: PlayCross,
    controller: Controller,
    run: RunSpec,
    scenario: Scenario,
    tuned: Tuned,
    backend: BackendChoice,
) -> RunSpec:
    from skidpad.cli.carla_backend import checked
    from skidpad.physics.presets import find_weather

    return structs.replace(
        tuned.resolve(run, grip=cross.frictions()[1]),
        driver=controller.chosen(),
        course=structs.replace(scenario, parameters=cross.parameters()),
        backend=checked(backend),
        weather=find_weather(PLAIN),
    )


def _campaign(
    template: RunSpec, cross: PlayCross, folder: Path, seeds: int, left_out: list[Path]
) -> Campaign[RunSpec, GripKey, GripMetrics]:
    """Of all that can be played; the others are added to `left_out`."""
    from skidpad.campaign.campaign import Campaign
    from skidpad.campaign.files import RECIPE, scenario_files
    from skidpad.cli.carla_backend import drives_alone

    found = scenario_files(folder) if folder.is_dir() else [folder]
    files = [file for file in found if _playable(file, template)]
    left_out += [file for file in found if file not in files]
    runs = _runs(template, cross, files, seeds)
    return Campaign(RECIPE, runs, alone=drives_alone(template.backend))


def _runs(template: RunSpec, cross: PlayCross, files: Sequence[Path], seeds: int) -> list[RunSpec]:
    from skidpad.campaign.files import runs_of
    from skidpad.physics.presets import find_weather

    words = [part.strip() for part in cross.weather.split(",")]
    weathers = [None if word == OF_FILE else find_weather(word) for word in words]
    first = range(cross.seed, cross.seed + seeds)
    return runs_of(template, files, weathers, cross.frictions()[0], first)


def _playable(file: Path, template: RunSpec) -> bool:
    """Whether it can be played; says what hinders."""
    from skidpad.campaign.cast import load_scenario
    from skidpad.campaign.files import courses_of
    from skidpad.campaign.grip_cells import scenario_of
    from skidpad.core.errors import InputError

    try:
        for course in courses_of(scenario_of(template), file):
            load_scenario(course)
    except InputError as error:
        typer.echo(f"left out: {error}", err=True)
        return False
    return True


def _check(path: Path, course: Scenario) -> None:
    """Say of a file, or of each in a folder, everything that is wrong or unknown in it."""
    from skidpad.campaign.files import scenario_files

    files = scenario_files(path) if path.is_dir() else [path]
    clean = [_is_clean(file, course) for file in files]
    if not all(clean):
        raise typer.Exit(2)


def _is_clean(file: Path, course: Scenario) -> bool:
    """Say everything that is found in a file, and in each choice where it is a distribution."""
    from skidpad.campaign.cast import check_scenario
    from skidpad.campaign.files import courses_of
    from skidpad.core.errors import FileError

    try:
        found = [check_scenario(one) for one in courses_of(course, file)]
    except FileError as error:
        typer.echo(f"error: {error}")
        return False
    for finding in dict.fromkeys(f for compiled in found for f in compiled.findings):
        typer.echo(f"{finding.kind.value}: {finding}")
    if any(compiled.scenario is None for compiled in found):
        return False
    typer.echo(f"{file.name}: can be played")
    return True
