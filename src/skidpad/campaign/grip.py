"""The recipe of the friction campaign: short scenarios in thousands of paired runs.

Every run leaves its series; whole logs are kept of those that the report shows (decision G-7).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from skidpad import __version__
from skidpad.campaign.grip_cells import GripCell
from skidpad.campaign.grip_shown import CELL, shown, write_stopping
from skidpad.campaign.recipe import Driven, Recipe
from skidpad.campaign.runfolder import (
    Stopwatch,
    fresh_folder,
    last_line,
    write_config,
    write_run,
)
from skidpad.campaign.worker import Job, Runner
from skidpad.core.vocabulary import Outcome
from skidpad.recording.campaigns import RUNS
from skidpad.recording.grip import (
    GRIP,
    GripEntry,
    GripKey,
    GripMetrics,
    series_path,
    write_series,
)
from skidpad.recording.logfiles import TICKS, log_hash
from skidpad.recording.results import read_results

if TYPE_CHECKING:
    from skidpad.campaign.play import Played


def warm_up() -> None:
    """Compile every kernel that a run may need."""
    from skidpad.campaign.grip_cells import Friction
    from skidpad.physics.presets import preset

    for scenario in ("front_accident", "ghost_cut_in"):
        for friction in Friction:
            play_cell(
                GripCell(scenario=scenario, weather=preset("icy_30"), friction=friction, seed=0)
            )


def play_cell(cell: GripCell, folder: Path | None = None) -> Played:
    """Play the scenario of a cell; returns what is left behind."""
    from skidpad.campaign.backends import WATCHDOG, keep_server, make_backend
    from skidpad.campaign.play import Play, play
    from skidpad.scenarios.variation import drawn_parameters, drawn_skill, scenario_file

    keep_server(cell.backend)
    return play(
        Play(
            file=scenario_file(cell.scenario),
            label=cell.controller,
            weather=cell.weather,
            seed=cell.seed,
            parameters=drawn_parameters(cell.scenario, cell.seed, cell.cutin),
            skill=drawn_skill(cell.scenario, cell.seed),
            controller=cell.controller,
            config=cell.config,
            profile=cell.profile,
            settings=cell.settings,
            grip=cell.grip,
            mu_ref=cell.mu_ref,
            level=cell.level,
            actors=cell.actors,
            overlay=cell.overlay,
        ),
        make_backend(cell.backend, WATCHDOG),
        folder,
    )


def drive_one(out: Path, cell: GripCell, *, keep: bool = False) -> Driven[GripKey, GripMetrics]:
    """In a worker: drive a cell and write its series, with `keep` its log too."""
    from skidpad.evidence.grip.scores import grip_metrics, grip_series
    from skidpad.physics.grip import friction_ratio

    folder, watch = fresh_folder(out, cell.name), Stopwatch()
    played = play_cell(cell, folder if keep else None)
    log, error = played.run.log, played.run.error
    metrics = grip_metrics(
        log,
        played.outcome,
        triggered=played.triggered,
        route_length=played.route_length,
        ratio=friction_ratio(cell.weather, cell.grip),
    )
    write_series(series_path(out, cell.cell, cell.seed), grip_series(log))
    if keep or error:
        write_config(folder, cell.resolved())
        write_run(folder, log, error)
    return Driven(
        key=grip_key(cell, played.outcome, log_hash(log)),
        metrics=metrics,
        timing=watch.timing(),
        error=last_line(error),
    )


def grip_key(cell: GripCell, outcome: Outcome, log_hash: str | None = None) -> GripKey:
    """The identifying columns of a cell's row."""
    return GripKey(
        scenario=cell.scenario,
        weather=cell.weather.name,
        friction=cell.friction.value,
        seed=cell.seed,
        cutin=cell.cutin.value,
        controller=cell.controller,
        sensors=cell.level.value,
        model=cell.model.value,
        overlay=cell.overlay,
        outcome=outcome.value,
        version=__version__,
        log_hash=log_hash,
    )


def finish(cells: Sequence[GripCell], out: Path, runner: Runner) -> None:
    """Keep the logs of what the report shows (a drive is the same whenever it is driven)."""
    wanted = set(shown(read_results(out)).select(*CELL, "seed").iter_rows())
    work = partial(drive_one, out, keep=True)
    jobs = [
        Job(c.name, work, c, c.deadline_s)
        for c in cells
        if (c.scenario, c.cutin.value, c.overlay, c.weather.name, c.friction.value, c.seed)
        in wanted
        and not (out / RUNS / c.name / TICKS).exists()
    ]
    for _ in runner(jobs):
        pass
    write_stopping(out, list({c.weather.name: c.weather for c in cells}.values()), cells[0].mu_ref)


def recipe(keep_all: bool = False) -> Recipe[GripCell, GripKey, GripMetrics]:
    """keep_all: the whole log of every run."""
    return Recipe(
        command="grip",
        columns=GRIP,
        entry=GripEntry,
        key=grip_key,
        drive=partial(drive_one, keep=keep_all),
        warm_up=warm_up,
        success=lambda metrics: metrics.completion,
        success_means="completed",
        finish=finish,
    )
