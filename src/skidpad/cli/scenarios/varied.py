"""What `skidpad search` and `skidpad risk` share: a scenario whose values vary, driven in batches."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from msgspec import Meta, Struct

from skidpad.cli.options.campaigns import CORES, Workers
from skidpad.cli.options.spread import spread_fields
from skidpad.core.run import RunSpec
from skidpad.core.vocabulary import SensorLevel

if TYPE_CHECKING:
    from rich.progress import Progress

    from skidpad.campaign.workers.worker import Runner
    from skidpad.cli.options.asked import PlayCross
    from skidpad.core.maths.space import Space, Variable

VariedFile = Annotated[
    Path,
    typer.Argument(
        help="A scenario (.xosc), a file of parameter distributions for one, or a name of the "
        "catalogue."
    ),
]
Vary = Annotated[
    tuple[str, ...],
    Meta(
        description="NAME=LOW:HIGH, NAME=normal(MEAN,SIGMA), NAME=lognormal(MEAN,SIGMA) or "
        "NAME=one|other; NAME: a parameter of the file, weather, weather.FIELD, or seed."
    ),
]
scenario_options = spread_fields(sensors=SensorLevel.OBJECTS, duration=60.0)


class Batches(Struct, frozen=True, kw_only=True):
    """Where and by what batches of runs are driven."""

    out: Annotated[Path, Meta(description="Folder for all runs and the page.")]
    workers: Workers = CORES
    cluster: Annotated[str | None, Meta(description="Dask scheduler's address, or local:N.")] = None
    resume: Annotated[bool, Meta(description="Finish what was begun.")] = False

    @contextmanager
    def drive(self) -> Iterator[tuple[Runner, Progress]]:
        """Yields a runner of batches, and a bar that is shown in a terminal; Ctrl-C says how to go on."""
        from rich.progress import Progress

        from skidpad.campaign.workers import cluster
        from skidpad.campaign.workers.pool import keep_workers
        from skidpad.cli.output.progress import console, interruptible

        here = self.cluster is None
        runners = keep_workers(self.workers) if here else cluster.runner_of(str(self.cluster))
        bar = Progress(console=console, disable=not console.is_terminal)
        with runners as runner, bar as shown, interruptible(self.out):
            yield runner, shown


def vary_scenario(
    file: Path,
    vary: Sequence[str],
    below: Sequence[Variable],
    template: RunSpec,
    cross: PlayCross,
) -> tuple[RunSpec, Space]:
    """Returns the run that a scenario makes of a template, and what varies in it.

    Disturbances vary as well, by their draws.

    `--vary` comes over `below`, and that over what a file of distributions says.

    Raises:
        ConfigError: nothing varies, a law cannot be read, or several weathers or grips are asked for.
        FileError: the file is missing, cannot be played, or declares no parameter of a name that varies.
    """
    from skidpad.cli.scenarios.play import play_runs
    from skidpad.core.errors import ConfigError
    from skidpad.core.maths.space import Space
    from skidpad.search.space import check_space, disturbance_variables, parse_variable

    file, of_file = _read_varied(file)
    given = [parse_variable(text) for text in vary]
    names = {v.name for v in given}
    kept = {v.name: v for v in (*of_file, *below) if v.name not in names}
    if len(cross.frictions()[0]) > 1 or "," in cross.weather:
        raise ConfigError(
            "a search has one weather and one grip; --vary weather=one|other varies it"
        )
    (template,) = play_runs(template, cross, [file], seeds=1)
    named = (*kept.values(), *given)
    if named:
        check_space(Space(named))
    space = Space((*named, *disturbance_variables(template)))
    _require_parameters(template, space)
    return template, space


def _read_varied(file: Path) -> tuple[Path, tuple[Variable, ...]]:
    """Returns the scenario that a file is or names, and what the file itself says that varies.

    Raises FileError for a folder.
    """
    from skidpad.core.errors import FileError
    from skidpad.scenarios.reading.distributions import is_distribution
    from skidpad.scenarios.shipped import find_scenario
    from skidpad.search.files import read_space

    file = find_scenario(file)
    if file.is_dir():
        raise FileError(f"scenario {file}: is a folder; give one file of it")
    if not is_distribution(file):
        return file, ()
    scenario, space = read_space(file)
    return scenario, space.variables


def _require_parameters(template: RunSpec, space: Space) -> None:
    """Raises FileError where the file cannot be played or declares no parameter of a varied name."""
    from skidpad.campaign.cells.grip import scenario_of
    from skidpad.campaign.driving.course_file import load_scenario
    from skidpad.search.space import apply_values

    load_scenario(scenario_of(template))
    middle = apply_values(template, space.values([0.5] * len(space.variables)))
    load_scenario(scenario_of(middle))
