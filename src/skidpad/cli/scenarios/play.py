"""`skidpad play`: play OpenSCENARIO files, or say what in them cannot be played."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from msgspec import structs

from skidpad.cli.options.asked import OF_FILE, EgoStack, PlayCross, Tuned
from skidpad.cli.options.campaigns import CampaignOptions, Checkpoints, Driving, How, Seeds
from skidpad.cli.options.spread import spread_fields
from skidpad.cli.scenarios.expected import Expected, exit_by_verdicts, played_report
from skidpad.core.courses import Scenario
from skidpad.core.run import RunSpec
from skidpad.core.simulator import BackendChoice
from skidpad.core.vocabulary import SensorLevel

if TYPE_CHECKING:
    from skidpad.campaign.campaign import Campaign
    from skidpad.recording.campaign.grip import GripKey, GripMetrics
    from skidpad.recording.run.staging import LeftOut
    from skidpad.report.play.runs import Played

PLAIN = "clear-noon"  # what a file leaves open of the weather
scenario_options = spread_fields(sensors=SensorLevel.OBJECTS, duration=120.0)


@scenario_options
def play_folder(
    how: How,
    folder: Annotated[Path, typer.Argument(help="Folder with .xosc files, at any depth.")],
    cross: PlayCross,
    ego: EgoStack,
    run: RunSpec,
    scenario: Scenario,
    tuned: Tuned,
    backend: BackendChoice,
    seeds: Seeds = 1,
) -> None:
    """Play every scenario of a folder in each weather, grip and seed that is asked for.

    By default the weather is the file's own and the grip physical. Files that cannot be played are
    left out with a message.
    """
    template = play_template(cross, ego, run, scenario, tuned, backend)
    how(_campaign(template, cross, folder, seeds, []), played_report)


@scenario_options
def play(
    file: Annotated[
        Path,
        typer.Argument(
            help="OpenSCENARIO XML 1.0 to 1.3 (.xosc), a folder of them, or a name of the catalogue."
        ),
    ],
    cross: PlayCross,
    ego: EgoStack,
    run: RunSpec,
    scenario: Scenario,
    tuned: Tuned,
    backend: BackendChoice,
    driving: Driving,
    expected: Expected,
    seeds: Seeds = 1,
    out: Annotated[Path | None, typer.Option(help="Folder for the run, or for the runs.")] = None,
    checkpoints: Checkpoints = None,
    check: Annotated[
        bool, typer.Option("--check", help="List all that is wrong or unknown; run nothing.")
    ] = False,
    tree: Annotated[
        bool, typer.Option("--tree", help="As --check, and print the storyboard as a tree.")
    ] = False,
) -> None:
    """Play a scenario, or all of a folder; ends with verdicts, a page and a table."""
    from skidpad.core.environment.surface import PatchError
    from skidpad.core.errors import ConfigError
    from skidpad.scenarios.shipped import find_scenario

    file = find_scenario(file)
    template = play_template(cross, ego, run, scenario, tuned, backend)
    expected.check()  # what cannot be read is said before anything is driven
    if check or tree:
        _check(file, structs.replace(scenario, parameters=cross.parameters()), tree)
        return
    if out is None:
        raise ConfigError("play needs --out DIR for the run, or --check, or --tree")
    from skidpad.scenarios.reading.distributions import is_distribution

    how = CampaignOptions(out=out, **structs.asdict(driving))
    if file.is_dir() or is_distribution(file):
        if checkpoints is not None:
            raise ConfigError("--checkpoints is for a single file: of a folder, rerun one run")
        _drive_all(how, template, cross, file, seeds, expected)
        return
    runs = play_runs(template, cross, [file], seeds)
    if len(runs) > 1:
        raise ConfigError("one file is one run: several weathers, grips or seeds take a folder")
    try:
        _drive_one(how, runs[0], checkpoints, expected)
    except PatchError as error:
        raise tuned.name_surface(error) from None


def _drive_one(
    how: CampaignOptions, run: RunSpec, checkpoints: float | None, expected: Expected
) -> None:
    """Drives one run, prints its verdict, and exits with 1 for a bad one; only plans it if asked to."""
    from skidpad.campaign.campaign import Campaign
    from skidpad.campaign.recipes.files import RECIPE
    from skidpad.campaign.runs.play import run_to

    if how.plan:
        how(Campaign(RECIPE, [run]), played_report)
    driven = run_to(run, how.out, checkpoints)
    if driven.error:
        typer.echo(driven.error.strip().split("\n")[-1], err=True)
    played, text = expected.conclude(how.out)
    typer.echo(text)
    exit_by_verdicts(played)


def _drive_all(
    how: CampaignOptions,
    template: RunSpec,
    cross: PlayCross,
    file: Path,
    seeds: int,
    expected: Expected,
) -> None:
    """Drives the campaign of a folder, prints its verdicts, and exits with 1 for a bad one."""
    left_out: list[LeftOut] = []
    campaign = _campaign(template, cross, file, seeds, left_out)
    ends: list[Played] = []

    def conclude(folder: Path) -> str:
        played, text = expected.conclude(folder, left_out)
        ends.append(played)
        return text

    how(campaign, conclude)
    exit_by_verdicts(ends[0])


def play_template(
    cross: PlayCross,
    ego: EgoStack,
    run: RunSpec,
    scenario: Scenario,
    tuned: Tuned,
    backend: BackendChoice,
) -> RunSpec:
    """Returns the run that the options describe; `play_runs` chooses file, weather and seed."""
    from skidpad.cli.options.carla_backend import check_backend
    from skidpad.physics.presets import find_weather

    return structs.replace(
        tuned.resolve(run, grip=cross.frictions()[1]),
        driver=ego.find_driver(),
        course=structs.replace(scenario, parameters=cross.parameters()),
        backend=check_backend(backend),
        weather=find_weather(PLAIN),
    )


def _campaign(
    template: RunSpec, cross: PlayCross, folder: Path, seeds: int, left_out: list[LeftOut]
) -> Campaign[RunSpec, GripKey, GripMetrics]:
    """Returns the campaign of all files that can be played; adds the others to `left_out`."""
    from skidpad.campaign.campaign import Campaign
    from skidpad.campaign.recipes.files import RECIPE, scenario_files
    from skidpad.cli.options.carla_backend import drives_alone
    from skidpad.recording.run.staging import LeftOut

    found = scenario_files(folder) if folder.is_dir() else [folder]
    hindrances = {file: _hindrance(file, template) for file in found}
    left_out += [LeftOut(str(file), why) for file, why in hindrances.items() if why]
    files = [file for file, why in hindrances.items() if not why]
    runs = play_runs(template, cross, files, seeds, folder)
    return Campaign(RECIPE, runs, alone=drives_alone(template.backend))


def play_runs(
    template: RunSpec,
    cross: PlayCross,
    files: Sequence[Path],
    seeds: int,
    below: Path | None = None,
) -> list[RunSpec]:
    """Returns the runs of files in every weather, grip and seed that is asked for.

    below: the folder by which files are named where two have the same name.
    """
    from skidpad.campaign.recipes.files import runs_of
    from skidpad.physics.presets import find_weather

    words = [part.strip() for part in cross.weather.split(",")]
    weathers = [None if word == OF_FILE else find_weather(word) for word in words]
    first = range(cross.seed, cross.seed + seeds)
    return runs_of(template, files, weathers, cross.frictions()[0], first, below)


def _hindrance(file: Path, template: RunSpec) -> str:
    """Returns what keeps a file from being played, and prints it; "" where nothing does."""
    from skidpad.campaign.cells.grip import scenario_of
    from skidpad.campaign.driving.course_file import load_scenario
    from skidpad.campaign.recipes.files import courses_of
    from skidpad.core.errors import InputError

    try:
        for course in courses_of(scenario_of(template), file):
            load_scenario(course)
    except InputError as error:
        typer.echo(f"left out: {error}", err=True)
        return str(error) or "it cannot be read"
    return ""


def _check(path: Path, course: Scenario, tree: bool) -> None:
    """Prints of a file, or of each in a folder, all that is wrong or unknown; exits with 2 if any is.

    tree: the storyboards of those that can be played are printed too.
    """
    from skidpad.campaign.recipes.files import scenario_files

    files = scenario_files(path) if path.is_dir() else [path]
    clean = [_is_clean(file, course, tree) for file in files]
    if not all(clean):
        raise typer.Exit(2)


def _is_clean(file: Path, course: Scenario, tree: bool) -> bool:
    """Prints all that is found in a file or its choices; returns True when all can be played.

    tree: each storyboard among the choices is printed too, once.
    """
    from skidpad.campaign.driving.course_file import check_scenario
    from skidpad.campaign.recipes.files import courses_of
    from skidpad.core.errors import FileError
    from skidpad.scenarios.tree import storyboard_tree

    try:
        found = [check_scenario(one) for one in courses_of(course, file)]
    except FileError as error:
        typer.echo(f"error: {error}")
        return False
    for finding in dict.fromkeys(f for compiled in found for f in compiled.findings):
        typer.echo(f"{finding.kind.value}: {finding}")
    scenarios = [compiled.scenario for compiled in found if compiled.scenario is not None]
    if len(scenarios) < len(found):
        return False
    typer.echo(f"{file.name}: can be played")
    if tree:
        for text in dict.fromkeys(storyboard_tree(one.storyboard) for one in scenarios):
            typer.echo(text)
    return True
