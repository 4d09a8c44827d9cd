"""`skidpad adas`: drive the ADAS-in-weather matrix and write its report."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from msgspec import structs

from skidpad.cli.options.asked import Climate, Drivers, Tuned
from skidpad.cli.options.campaigns import Checkpoints, FirstSeed, How, Seeds
from skidpad.cli.options.spread import spread_fields
from skidpad.core.courses import Roads
from skidpad.core.run import RunSpec
from skidpad.core.simulator import BackendChoice, BackendKind


@spread_fields()
def adas(
    how: How,
    drivers: Drivers,
    climate: Climate,
    run: RunSpec,
    roads: Roads,
    tuned: Tuned,
    backend: BackendChoice,
    grip: Annotated[
        str | None, typer.Option(help="none, statistical or physical; default: the profile's.")
    ] = None,
    range: Annotated[
        str | None, typer.Option(help="none or physical; default: the profile's.")
    ] = None,
    seeds: Seeds = 1,
    first_seed: FirstSeed = 1,
    distinct: Annotated[
        bool,
        typer.Option(
            "--distinct",
            help="Where the first seed moves alike in several weathers, drive the other seeds "
            "in one of them.",
        ),
    ] = False,
    parity_seeds: Annotated[
        int,
        typer.Option(
            "--parity-seeds",
            min=0,
            help="With --sensors objects: drive so many of the seeds on pixels too, and show how "
            "they differ.",
        ),
    ] = 0,
    checkpoints: Checkpoints = None,
) -> None:
    """Drive configurations x weathers x seeds; prints the answer and the path of the report."""
    from skidpad.cli.options.carla_backend import check_backend, drives_alone
    from skidpad.roads.map_files import require_map

    # what is misspelt is said before kernels and tables load
    run = tuned.resolve(run, grip=grip, range=range)
    chosen, weathers = drivers.find_drivers(), climate.find_weathers()
    if backend.backend != BackendKind.CARLA:
        require_map(roads.map)
        tuned.require_surface_on(roads, run.surface)
    from skidpad.campaign.campaign import Campaign
    from skidpad.campaign.recipes.matrix import RECIPE, drive_one
    from skidpad.campaign.user_files import found_again, keep_maps
    from skidpad.cli.campaigns.adas_plan import on_pixels, plan
    from skidpad.recording.campaign.matrix import PIXELS

    run = structs.replace(run, course=roads, backend=check_backend(backend), seed=first_seed)
    run = found_again(run, how.folder)
    alone = drives_alone(run.backend)
    cells, files = keep_maps(plan(run, chosen, weathers, seeds))
    recipe = replace(RECIPE, drive=partial(drive_one, checkpoints_s=checkpoints))
    campaign = Campaign(recipe, cells, alone=alone, files=files, distinct=distinct)
    twins = on_pixels(cells, parity_seeds)
    parts = {PIXELS: Campaign(RECIPE, twins, alone=alone, files=files)} if twins else {}
    how(campaign, answer, parts)


def answer(folder: Path) -> str:
    """Writes the report of a campaign; returns what it answers, its path, and the next command."""
    from skidpad.report.matrix.answers import terminal_answer
    from skidpad.report.matrix.data import load_matrix
    from skidpad.report.matrix.page import write_report

    page = write_report(folder)
    *lines, last = terminal_answer(load_matrix(folder))
    told = [*lines, str(page), last] if last.startswith("Next: ") else [*lines, last, str(page)]
    return "\n".join(told)


def report(
    folder: Annotated[Path, typer.Argument(help="A campaign's folder, or the folder of one run.")],
) -> None:
    """Write the report of a campaign again, from what it left behind; of a run, its own page."""
    from skidpad.core.errors import FileError
    from skidpad.recording.campaign.ledger import LEDGER, campaign_command
    from skidpad.recording.campaign.results import RESULTS
    from skidpad.recording.campaign.risks import RISK_FOUND
    from skidpad.recording.campaign.searches import FOUND
    from skidpad.recording.run.log_files import TICKS

    if (folder / TICKS).is_file():
        typer.echo(_report_run(folder))
        return
    if (folder / FOUND).is_file():
        command = "search"
    elif (folder / RISK_FOUND).is_file():
        command = "risk"
    elif any((folder / name).is_file() for name in (RESULTS, LEDGER)):
        command = campaign_command(folder)
    else:
        raise FileError(
            f"{folder} holds no results of a campaign; give the folder that a campaign wrote to, "
            f"or drive one: skidpad adas --out {folder}"
        )
    typer.echo(_reports()[command](folder))


def _reports() -> dict[str, Callable[[Path], object]]:
    """Returns the function that writes the report of each kind of folder, by kind."""
    from skidpad.cli.channels.drive import totals
    from skidpad.cli.scenarios.expected import played_report
    from skidpad.report.grip.page import write_grip_report
    from skidpad.report.grip.threshold import write_threshold_report
    from skidpad.report.risk import write_risk_report
    from skidpad.report.search import write_search_report

    return {
        "adas": answer,
        "grip": write_grip_report,
        "grip-threshold": write_threshold_report,
        "channels": totals,
        "play": played_report,
        "search": write_search_report,
        "risk": write_risk_report,
    }


def _report_run(run: Path) -> str:
    """Writes the page of one run, with its verdict if it plays a scenario, else its crash cards.

    Returns the text to print, also where there was no crash and so no page.
    """
    from skidpad.cli.runs.show import open_run
    from skidpad.cli.scenarios.expected import played_report
    from skidpad.recording.run.staging import STAGING
    from skidpad.report.crashes.page import write_crashes

    if (run / STAGING).is_file():
        return played_report(run)
    page = write_crashes(run, open_run(run)[1])
    if page is None:
        return f"{run}: no crash, so there is no page; skidpad show {run} prints its metrics"
    return f"crash cards in {page}"


def show(run: Annotated[Path, typer.Argument(help="A run's folder.")]) -> None:
    """Print one run: what it was, what it came to, and its crashes."""
    from skidpad.cli.options.folders import require_run

    require_run(run)
    from skidpad.cli.runs.show import show as print_run

    print_run(run)
