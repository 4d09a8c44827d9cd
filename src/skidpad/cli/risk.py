"""`skidpad risk`: how probable a crash is in one encounter, given how encounters vary."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from msgspec import Meta, Struct

from skidpad.cli.asked import Controller, PlayCross, Tuned
from skidpad.cli.campaigns import CORES, Workers
from skidpad.cli.search import read_varied, require_parameters, runner_of, template_of
from skidpad.cli.spread import spread_fields
from skidpad.core.run import RunSpec, Scenario
from skidpad.core.vocabulary import SensorLevel

if TYPE_CHECKING:
    from skidpad.campaign.worker import Runner
    from skidpad.recording.risks import Risk
    from skidpad.recording.searches import Trial

scenario_options = spread_fields(sensors=SensorLevel.OBJECTS, duration=60.0)


class Encounters(Struct, frozen=True):
    """How encounters vary and how often they happen, and how many runs are spent on them."""

    vary: Annotated[
        tuple[str, ...],
        Meta(
            description="NAME=LOW:HIGH, NAME=normal(MEAN,SIGMA), NAME=lognormal(MEAN,SIGMA) or "
            "NAME=one|other; NAME: a parameter of the file, weather, weather.FIELD, or seed."
        ),
    ] = ()
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
    file: Annotated[
        Path,
        typer.Argument(
            help="A scenario (.xosc), a file of parameter distributions for one, or a name of the "
            "catalogue."
        ),
    ],
    encounters: Encounters,
    cross: PlayCross,
    controller: Controller,
    run: RunSpec,
    scenario: Scenario,
    tuned: Tuned,
    out: Annotated[Path, typer.Option(help="Folder for runs and the page.")],
    workers: Workers = CORES,
    cluster: Annotated[
        str | None, typer.Option(help="Dask scheduler's address, or local:N.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Finish what was begun.")] = False,
) -> None:
    """Estimate the probability of a crash in one encounter, by two methods that must agree.

    A crash is a contact above 5 km/h (with a person or a two-wheeler any) or a departure from the road.
    Where the methods disagree or are too uncertain, the answer is "not determined".
    """
    from skidpad.core.space import Space
    from skidpad.recording.risks import Risk
    from skidpad.search.exposure import NO_EXPOSURE, read_exposure
    from skidpad.search.loop import begin_risk
    from skidpad.search.space import check_space, parse_variable

    exposure = NO_EXPOSURE if encounters.exposure is None else read_exposure(encounters.exposure)
    played, of_file = read_varied(file)
    given = [parse_variable(text) for text in encounters.vary]
    known_names = {v.name for v in given}
    below = {v.name: v for v in (*of_file, *exposure.variables) if v.name not in known_names}
    space = check_space(Space((*below.values(), *given)))
    template = template_of(played, cross, controller, run, scenario, tuned)
    require_parameters(template, space)
    asked = Risk(
        run=template.to_plain(), space=space, per_hour=exposure.per_hour,
        per_100km=exposure.per_100km, repetitions=encounters.repetitions,
        per_level=encounters.per_level, samples=encounters.samples, seed=encounters.draw_seed,
    )  # fmt: skip
    known = begin_risk(out, asked, resume=resume)
    with runner_of(workers, cluster) as runner:
        _drive(asked, out, runner, known)
    from skidpad.report.risk import write_risk_report

    typer.echo(write_risk_report(out))


def _drive(asked: Risk, out: Path, runner: Runner, known: Sequence[Trial]) -> None:
    from rich.progress import Progress

    from skidpad.cli.progress import console
    from skidpad.search.risk import estimate_risk

    with Progress(console=console, disable=not console.is_terminal) as shown:
        bar = shown.add_task("driving", total=None)

        def tell(runs: int) -> None:
            shown.update(bar, completed=runs, description=f"{runs} runs")

        try:
            estimate_risk(asked, out, runner, known, tell)
        except KeyboardInterrupt:
            console.print(f"interrupted; what is done is kept: --out {out} --resume finishes it")
            raise SystemExit(130) from None
