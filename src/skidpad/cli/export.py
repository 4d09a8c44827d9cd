"""`skidpad export`: any run's folder as OpenSCENARIO and OpenDRIVE."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from skidpad.cli.hazards import Osc

if TYPE_CHECKING:
    from skidpad.scenarios.environment import Environment


def export(
    run: Annotated[Path, typer.Argument(help="A run's folder: OUT of play, or OUT/runs/NAME.")],
    out: Annotated[
        Path | None, typer.Option(help="Where to; default: RUN/scenario.", show_default=False)
    ] = None,
    osc: Annotated[Osc, typer.Option(help="1.2, or 1.0 for CARLA ScenarioRunner.")] = Osc.v1_2,
) -> None:
    """Write a driven run as .xosc and .xodr that other simulators replay."""
    from skidpad.recording.logfiles import read_log
    from skidpad.scenarios.run_export import export_run
    from skidpad.scenarios.writer import OscVersion

    log = read_log(run)
    folder = run / "scenario" if out is None else out
    name = run.resolve().name
    scenario, road, known = export_run(
        log, folder, name, _roads(run), OscVersion(osc.value), _environment(run)
    )
    typer.echo(f"{scenario} with {road.name}")
    if not known:
        typer.echo(f"the road {log.header.map!r} is not there: a straight one lies under the run")


def _environment(run: Path) -> Environment | None:
    """Weather and road of the run, where its description is there."""
    from skidpad.campaign.outdoors import environment_of
    from skidpad.campaign.stored import read_run
    from skidpad.core.errors import InputError

    try:
        return environment_of(read_run(run.resolve()).weather)
    except InputError:
        return None


def _roads(run: Path) -> list[Path]:
    """Files that may be the run's road: those kept with it, and what its description names."""
    from skidpad.campaign.cast import load_scenario
    from skidpad.campaign.stored import read_run
    from skidpad.core.errors import InputError
    from skidpad.core.run import Roads, Scenario
    from skidpad.roads.bundled import KEPT

    run = run.resolve()
    kept = [file for above in (run, *run.parents[:2]) for file in above.glob(f"{KEPT}/*/*.xodr")]
    try:
        course = read_run(run).course
        if isinstance(course, Roads):
            return [*kept, Path(course.map)]
        if isinstance(course, Scenario):
            return [*kept, Path(load_scenario(course).map_name)]
    except InputError:  # the road is known by its content, or it is not
        return kept
    return kept
