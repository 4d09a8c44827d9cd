"""`skidpad search`: which values of a scenario make a stack fail, and what would have been enough."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer
from msgspec import Meta, Struct

from skidpad.cli.options.asked import EgoStack, PlayCross, Tuned
from skidpad.cli.scenarios.varied import Batches, VariedFile, Vary, scenario_options, vary_scenario
from skidpad.core.run import RunSpec, Scenario

if TYPE_CHECKING:
    from skidpad.recording.campaign.searches import Search, Trial


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
    file: VariedFile,
    varied: Varied,
    cross: PlayCross,
    ego: EgoStack,
    run: RunSpec,
    scenario: Scenario,
    tuned: Tuned,
    how: Batches,
) -> None:
    """Find the values of a scenario that make the ego crash or leave the road.

    A failure is a contact above 5 km/h (with a person or a two-wheeler any) or a departure that the
    reference driver avoids in the same place, or that braking or steering from the same state avoids;
    others are listed apart. The page shows each kind with the smallest change that makes it harmless.
    """
    from skidpad.core.errors import require_choice
    from skidpad.recording.campaign.searches import Search
    from skidpad.search.loop import write_search
    from skidpad.search.margin import OBJECTIVES
    from skidpad.search.methods import METHODS

    require_choice("--method", varied.method, tuple(METHODS))
    require_choice("--objective", varied.objective, tuple(OBJECTIVES))
    template, space = vary_scenario(file, varied.vary, (), cross, ego, run, scenario, tuned)
    found = Search(
        run=template.to_plain(), space=space, method=varied.method, objective=varied.objective,
        budget=varied.budget, seed=varied.search_seed,
    )  # fmt: skip
    _drive(found, how, write_search(how.out, found, resume=how.resume))
    from skidpad.report.search import write_search_report

    typer.echo(write_search_report(how.out))


def _drive(found: Search, how: Batches, known: Sequence[Trial]) -> None:
    from skidpad.search.failures import look_at_failures, write_findings
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
