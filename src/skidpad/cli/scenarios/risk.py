"""`skidpad risk`: how probable a crash is in one encounter, given how encounters vary."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from msgspec import Meta, Struct

from skidpad.cli.options.asked import EgoStack, PlayCross, Tuned
from skidpad.cli.scenarios.play import play_template
from skidpad.cli.scenarios.varied import Batches, VariedFile, Vary, scenario_options, vary_scenario
from skidpad.core.courses import Scenario
from skidpad.core.run import RunSpec
from skidpad.core.simulator import BackendChoice


class Encounters(Struct, frozen=True):
    """How encounters vary and how often they happen, and how many runs are spent on them."""

    vary: Vary = ()
    exposure: Annotated[
        Path | None,
        Meta(description="YAML with variables, rates and their sources; --vary comes over it."),
    ] = None
    repetitions: Annotated[
        int, Meta(ge=2, le=100, description="Independent repetitions of subset simulation.")
    ] = 10
    per_level: Annotated[
        int, Meta(ge=50, le=100_000, description="Runs of each level of a repetition.")
    ] = 300
    samples: Annotated[
        int, Meta(ge=100, le=1_000_000, description="Runs of importance sampling.")
    ] = 2000
    draw_seed: Annotated[int, Meta(ge=0, description="Of all draws.")] = 1


@scenario_options
def risk(
    file: VariedFile,
    encounters: Encounters,
    cross: PlayCross,
    ego: EgoStack,
    run: RunSpec,
    scenario: Scenario,
    tuned: Tuned,
    how: Batches,
) -> None:
    """Estimate the probability of a crash in one encounter, by two methods that must agree.

    A crash is a contact above 5 km/h (with a person or a two-wheeler any) or a departure.
    Where the methods disagree or are too uncertain, the answer is "not determined".
    """
    from skidpad.recording.campaign.risks import Risk
    from skidpad.search.exposure import NO_EXPOSURE, read_exposure
    from skidpad.search.loop import begin_risk
    from skidpad.search.risk import estimate_risk

    exposure = NO_EXPOSURE if encounters.exposure is None else read_exposure(encounters.exposure)
    template = play_template(cross, ego, run, scenario, tuned, BackendChoice())
    template, space = vary_scenario(file, encounters.vary, exposure.variables, template, cross)
    asked = Risk(
        run=template.to_plain(), space=space, per_hour=exposure.per_hour,
        per_100km=exposure.per_100km, repetitions=encounters.repetitions,
        per_level=encounters.per_level, samples=encounters.samples, seed=encounters.draw_seed,
    )  # fmt: skip
    known = begin_risk(how.out, asked, resume=how.resume)
    with how.drive() as (runner, shown):
        bar = shown.add_task("driving", total=None)

        def show_runs(runs: int) -> None:
            shown.update(bar, completed=runs, description=f"{runs} runs")

        estimate_risk(asked, how.out, runner, known, show_runs)
    from skidpad.report.risk import write_risk_report

    typer.echo(write_risk_report(how.out))
