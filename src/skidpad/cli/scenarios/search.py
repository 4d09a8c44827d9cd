"""`skidpad search`: which values of a scenario make a stack fail, and what would have been enough."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from msgspec import Meta, Struct

from skidpad.cli.options.asked import EgoStack, PlayCross, Tuned
from skidpad.cli.scenarios.play import play_template
from skidpad.cli.scenarios.varied import Batches, Vary, scenario_options, vary_scenario
from skidpad.core.courses import Scenario
from skidpad.core.run import RunSpec
from skidpad.core.simulator import BackendChoice

if TYPE_CHECKING:
    from skidpad.recording.campaign.searches import Search, Trial
    from skidpad.search.hazard import Scene


class Varied(Struct, frozen=True):
    """What varies, and how it is searched."""

    vary: Vary = ()
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
    varied: Varied,
    cross: PlayCross,
    ego: EgoStack,
    run: RunSpec,
    scenario: Scenario,
    tuned: Tuned,
    how: Batches,
    file: Annotated[
        Path | None,
        typer.Argument(
            help="A scenario (.xosc), a file of parameter distributions for one, or a name of the "
            "catalogue; not with --from."
        ),
    ] = None,
    source: Annotated[
        Path | None,
        typer.Option(
            "--from",
            help="Search around a hazard instead: a folder of `skidpad monitor`, its hazards.txt, a "
            "fleet's record, or a .xosc of `skidpad hazards export`.",
        ),
    ] = None,
    hazard: Annotated[
        str | None, typer.Option("--hazard", help="Which one of --from, by its id.")
    ] = None,
    exposure: Annotated[
        Path | None,
        typer.Option(
            "--exposure", help="YAML that says how likely values are, as for `skidpad risk`."
        ),
    ] = None,
) -> None:
    """Find the values of a scenario that make the ego crash or leave the road.

    A failure is a contact above 5 km/h (with a person or a two-wheeler any) or a departure that the
    reference driver avoids in the same place, or that braking or steering from the same state avoids;
    others are listed apart. The page shows each kind with the smallest change that makes it harmless.
    """
    from skidpad.core.errors import ConfigError, require_choice
    from skidpad.recording.campaign.searches import Search
    from skidpad.search.exposure import NO_EXPOSURE, read_exposure
    from skidpad.search.loop import check_folder, write_search
    from skidpad.search.margin import OBJECTIVES
    from skidpad.search.methods import METHODS

    require_choice("--method", varied.method, tuple(METHODS))
    require_choice("--objective", varied.objective, tuple(OBJECTIVES))
    if (file is None) == (source is None):
        raise ConfigError("a search begins from a scenario or from a hazard: give FILE or --from")
    if hazard is not None and source is None:
        raise ConfigError("--hazard chooses one of --from")
    likely = NO_EXPOSURE if exposure is None else read_exposure(exposure)
    scene = None
    below = likely.variables
    if source is not None:
        from skidpad.search.hazard import prepare_scene

        check_folder(how.out, resume=how.resume)
        scene = prepare_scene(source, hazard, how.out)
        file, below = scene.varied, (*scene.variables, *below)
    assert file is not None
    template = play_template(cross, ego, run, scenario, tuned, BackendChoice())
    template, space = vary_scenario(file, varied.vary, below, template, cross)
    found = Search(
        run=template.to_plain(), space=space, method=varied.method, objective=varied.objective,
        budget=varied.budget, seed=varied.search_seed,
    )  # fmt: skip
    known = write_search(how.out, found, resume=how.resume)
    _drive(found, how, known, scene, has_exposure=exposure is not None)
    from skidpad.report.search import write_search_report

    typer.echo(write_search_report(how.out))
    if scene is not None and scene.monitored is not None:
        _tell_monitor(how.out, *scene.monitored)


def _tell_monitor(out: Path, folder: Path, id: str) -> None:
    """Adds what was found to the records and the page of the hazard in a monitor's folder.

    id: of the hazard. Without a summary there, no page is written.
    """
    from skidpad.recording.campaign.searches import read_hazard
    from skidpad.recording.channels.monitored import SUMMARY
    from skidpad.recording.hazards.searched import add_search
    from skidpad.report.channels.page import write_drive_report
    from skidpad.report.search_sentences import hazard_sentences

    hazard = read_hazard(out)
    assert hazard is not None
    add_search(folder, id, hazard_sentences(hazard))
    if (folder / SUMMARY).is_file():
        typer.echo(f"hazard: {write_drive_report(folder)}")


def _drive(
    found: Search, how: Batches, known: Sequence[Trial], scene: Scene | None, *, has_exposure: bool
) -> None:
    """Searches on from the known trials, with progress shown, and writes the findings.

    scene: of a hazard, which is judged as well; None: of no hazard.
    """
    from skidpad.search.failures import look_at_failures, write_findings, write_hazard
    from skidpad.search.loop import search as drive_search

    with how.drive() as (runner, shown):
        bar = shown.add_task("searching", total=found.budget)
        trials, failures = [], 0
        for trial in drive_search(found, how.out, runner, known):
            trials.append(trial)
            failures += trial.is_failure
            shown.update(bar, advance=1, description=f"searching, {failures} failures")
        shown.update(bar, description="looking at failures")
        write_findings(how.out, found, look_at_failures(found, trials, runner))
        if scene is not None:
            from skidpad.search.hazard import judge_hazard

            write_hazard(how.out, judge_hazard(found, scene, trials, runner, has_exposure))
