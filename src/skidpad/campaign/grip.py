"""Drive the friction campaign: pool in front, ledger behind, series of every run, results at the end."""

from __future__ import annotations

import shutil
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import yaml

from skidpad import __version__
from skidpad.campaign.grip_cells import GripCell, identity
from skidpad.campaign.matrix import CONFIG, ERROR, FAILURES
from skidpad.campaign.pool import Finished, Job, run_jobs
from skidpad.core.vocabulary import Outcome
from skidpad.recording.campaigns import RUNS
from skidpad.recording.files import write_bytes
from skidpad.recording.fingerprint import fingerprint
from skidpad.recording.grip import (
    GripEntry,
    GripKey,
    GripMetrics,
    GripTiming,
    series_path,
    write_grip_results,
    write_series,
)
from skidpad.recording.ledger import Ledger, fingerprints, latest

if TYPE_CHECKING:
    from skidpad.campaign.play import Played

TARGET = "skidpad.campaign.grip:drive_one"
WARM = "skidpad.campaign.grip:warm_up"
Runner = Callable[[Iterable[Job]], Iterator[Finished]]
Answer = tuple[GripKey, GripMetrics, GripTiming, str]


@dataclass(frozen=True, slots=True)
class GripSummary:
    """What a campaign came to."""

    folder: Path
    runs: int
    driven: int  # in this call
    failed: int  # crashed or timed out
    content_hash: str
    mixed_machines: bool


@dataclass(frozen=True, slots=True)
class Task:
    """What a worker is given."""

    cell: GripCell
    out: Path
    keep: bool = False


def local(workers: int) -> Runner:
    """The pool of this machine."""
    return lambda jobs: run_jobs(jobs, workers, warm=WARM)


def run_grip(
    batches: Sequence[Sequence[GripCell]],
    out: Path,
    runner: Runner,
    *,
    resume: bool = False,
    csv: bool = False,
    keep_all: bool = False,
    wanted: Callable[[list[GripEntry]], set[str]] | None = None,
    on_run: Callable[[GripEntry], None] = lambda _: None,
) -> GripSummary:
    """Drive what the ledger does not have yet, then write results.parquet.

    batches: driven one after the other. wanted: given all entries so far, the cells that need the
    next batch; None: all of them (decision G-8).
    """
    cells = [c for batch in batches for c in batch]
    here = fingerprint().short
    driven = 0
    with Ledger(out, identity(cells), resume, GripEntry) as ledger:
        for k, batch in enumerate(batches):
            done = ledger.done()
            still = None if wanted is None or k == 0 else wanted(latest(ledger.entries))
            by_name = {c.name: c for c in batch if still is None or c.cell in still}
            jobs = [
                Job(name, TARGET, Task(c, out, keep_all), c.deadline_s)
                for name, c in by_name.items()
                if name not in done
            ]
            for finished in runner(jobs):
                entry = _entry(by_name[finished.job.key], finished, here)
                ledger.append(entry)
                on_run(entry)
            driven += len(jobs)
        entries = latest(ledger.entries)
    digest = write_grip_results(out, entries, csv=csv)
    failed = sum(Outcome(e.key.outcome) in FAILURES.values() for e in entries)
    return GripSummary(out, len(entries), driven, failed, digest, len(fingerprints(entries)) > 1)


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


def drive_one(task: Task) -> Answer:
    """In a worker: drive a cell, write its series, return its row and the last line of an error."""
    from skidpad.evidence.grip.scores import grip_metrics, grip_series
    from skidpad.physics.grip import friction_ratio
    from skidpad.recording.logfiles import log_hash, write_log

    cell, out = task.cell, task.out
    folder = out / RUNS / cell.name
    if folder.exists():  # what a killed attempt left
        shutil.rmtree(folder)
    wall, cpu = time.perf_counter(), time.process_time()
    played = play_cell(cell, folder if task.keep else None)
    log = played.run.log
    metrics = grip_metrics(
        log,
        played.outcome,
        triggered=played.triggered,
        route_length=played.route_length,
        ratio=friction_ratio(cell.weather, cell.grip),
    )
    write_series(series_path(out, cell.cell, cell.seed), grip_series(log))
    if task.keep or played.run.error:
        write_bytes(folder / CONFIG, yaml.safe_dump(cell.resolved(), sort_keys=False).encode())
        write_log(folder, log)
    if played.run.error:
        write_bytes(folder / ERROR, played.run.error.encode())
    digest = log_hash(log)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    timing = _timing(cell, wall, cpu)
    error = played.run.error.strip().split("\n")[-1]
    return grip_key(cell, played.outcome, digest), metrics, timing, error


def _timing(cell: GripCell, wall: float, cpu: float) -> GripTiming:
    return GripTiming(
        scenario=cell.scenario,
        weather=cell.weather.name,
        friction=cell.friction.value,
        seed=cell.seed,
        wall_s=wall,
        cpu_s=cpu,
    )


def _entry(cell: GripCell, finished: Finished, here: str) -> GripEntry:
    if finished.failure is None:
        key, metrics, timing, error = finished.value
    else:
        key, metrics = grip_key(cell, FAILURES[finished.failure]), GripMetrics()
        timing, error = _timing(cell, finished.wall_s, 0.0), finished.detail.strip()
    return GripEntry(
        run=cell.name, key=key, metrics=metrics, timing=timing, fingerprint=here, error=error
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


def uncertain_cells(entries: Iterable[GripEntry], halfwidth: float) -> set[str]:
    """Cells whose interval of completion is still wider than asked for (decision G-8)."""
    from skidpad.evidence.statistics import clopper_pearson

    runs: dict[str, list[bool]] = defaultdict(list)
    for e in entries:
        if e.metrics.completion is not None:
            runs[e.run.rsplit("-", 1)[0]].append(e.metrics.completion)
    found = set()
    for cell, completed in runs.items():
        low, high = clopper_pearson(sum(completed), len(completed))
        if (high - low) / 2.0 > halfwidth:
            found.add(cell)
    return found
