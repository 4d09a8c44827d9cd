"""The recipe of a folder of scenario files: each in every weather, with and without its grip.

Rows are those of the friction campaign; the whole log of every run is kept.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from msgspec import structs

from skidpad.campaign.cells.grip import scenario_of
from skidpad.campaign.driving.course_file import load_scenario
from skidpad.campaign.driving.outdoors import in_weather_of_file
from skidpad.campaign.recipes.grip import recipe
from skidpad.campaign.recipes.recipe import nothing_else
from skidpad.core.courses import Scenario
from skidpad.core.errors import FileError
from skidpad.core.run import Friction, RunSpec
from skidpad.core.weather import Weather
from skidpad.scenarios.reading.distributions import choices, is_distribution
from skidpad.scenarios.reading.document import holds

RECIPE = replace(recipe(keep_all=True), command="play", finish=nothing_else)


def scenario_files(folder: Path) -> list[Path]:
    """Returns the sorted .xosc files of a folder at any depth, without catalogs; FileError for none."""
    found = sorted(folder.rglob("*.xosc"))
    if not found:
        raise FileError(f"{folder} holds no .xosc file")
    return [file for file in found if not holds(file, "Catalog")]


def courses_of(course: Scenario, file: Path, name: str = "") -> list[Scenario]:
    """Returns the courses of a file: itself, or one per choice of parameters of a distribution.

    name: what results call it, where the name of the file is not enough.
    """
    if not is_distribution(file):
        return [structs.replace(course, file=str(file.resolve()), name=name)]
    return [
        structs.replace(
            course,
            file=str(choice.file),
            parameters={**choice.parameters, **course.parameters},
            variant=f"{name or file.stem}-{k:04d}",
        )
        for k, choice in enumerate(choices(file))
    ]


def names_of(files: Sequence[Path], below: Path | None) -> dict[Path, str]:
    """Returns for each file its path in the folder `below` where two files share a name, else ""."""
    if below is None:
        return dict.fromkeys(files, "")
    shared = {stem for stem, n in Counter(file.stem for file in files).items() if n > 1}
    return {
        file: file.relative_to(below).with_suffix("").as_posix() if file.stem in shared else ""
        for file in files
    }


def runs_of(
    template: RunSpec,
    files: Sequence[Path],
    weathers: Sequence[Weather | None],
    frictions: Sequence[Friction],
    seeds: Iterable[int],
    below: Path | None = None,
) -> list[RunSpec]:
    """Returns a run for every combination, the rest as in `template`, whose course is a scenario.

    below: the folder by which files are named where two have the same name.
    A weather None is that of the file, and of the template what the file leaves open.
    """
    names = names_of(files, below)
    courses = [c for file in files for c in courses_of(scenario_of(template), file, names[file])]
    played = [
        _in_weather(structs.replace(template, course=course), weather)
        for course in courses
        for weather in weathers
    ]
    return [
        structs.replace(run, friction=friction, seed=seed)
        for seed in seeds
        for run in played
        for friction in frictions
    ]


def _in_weather(run: RunSpec, weather: Weather | None) -> RunSpec:
    """Returns the run in the weather; None: in that of its scenario file."""
    if weather is not None:
        return structs.replace(run, weather=weather)
    return in_weather_of_file(run, load_scenario(scenario_of(run)).start.environment)
