"""Drive all cells of a campaign: pool in front, ledger behind, results at the end."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

from skidpad import __version__
from skidpad.campaign.cells import Cell, identity
from skidpad.campaign.pace import Pace
from skidpad.campaign.pool import Finished, Job, run_jobs
from skidpad.core.setup import DT
from skidpad.core.vocabulary import Outcome, SensorLevel
from skidpad.core.weather import Weather
from skidpad.evidence.drive.prepared import LeadDefinition, MetricSettings
from skidpad.recording.campaigns import RUNS
from skidpad.recording.files import write_bytes
from skidpad.recording.fingerprint import fingerprint
from skidpad.recording.ledger import Entry, Ledger, fingerprints, latest
from skidpad.recording.results import Metrics, RunKey, Timing, write_results
from skidpad.stack.settings import LaneTruth

CONFIG, ERROR = "config.yaml", "error.txt"
FAILURES = {"crashed": Outcome.CRASHED, "timeout": Outcome.TIMEOUT}
TIMES_OF_DAY = ("sunrise", "noon", "night")


@dataclass(frozen=True, slots=True)
class Summary:
    """What a campaign came to."""

    folder: Path
    runs: int
    driven: int  # in this call; the others were in the ledger
    failed: int  # crashed or timed out
    content_hash: str
    mixed_machines: bool  # byte equality is not promised across this campaign


def run_matrix(
    cells: Sequence[Cell],
    out: Path,
    *,
    workers: int,
    resume: bool = False,
    csv: bool = False,
    on_run: Callable[[Entry], None] = lambda _: None,
) -> Summary:
    """Drive what the ledger does not have yet, then write results.parquet.

    OutputError when `out` holds something else, or this campaign and `resume` is false.
    """
    here = fingerprint().short
    with Ledger(out, identity(cells), resume, Entry) as ledger:
        done = ledger.done()
        jobs = [
            Job(c.name, "skidpad.campaign.matrix:drive_one", (c, out), c.deadline_s)
            for c in cells
            if c.name not in done
        ]
        by_name = {c.name: c for c in cells}
        for finished in run_jobs(jobs, workers, warm="skidpad.campaign.matrix:warm_up"):
            entry = _entry(by_name[finished.job.key], finished, here)
            ledger.append(entry)
            on_run(entry)
        entries = latest(ledger.entries)
    digest = write_results(
        out, [(e.key, e.metrics) for e in entries], [e.timing for e in entries], csv=csv
    )
    failed = sum(Outcome(e.key.outcome) in FAILURES.values() for e in entries)
    mixed = len(fingerprints(entries)) > 1
    return Summary(out, len(entries), len(jobs), failed, digest, mixed)


def warm_up() -> None:
    """Compile every kernel that a run may need, by driving a moment of each kind."""
    from skidpad.campaign.drive import drive
    from skidpad.evidence.drive.metrics import run_metrics
    from skidpad.roads.bundled import load_map

    for level in SensorLevel:
        run = drive(4, weather="rain-night", duration=1.0, sensors=level.value)
        run_metrics(run.log, load_map("figure8"))
    see_all()


def see_all() -> None:
    """Draw every image once and look for lamps: a moment's drive meets no light."""
    from skidpad.physics.presets import preset
    from skidpad.roads.bundled import load_map
    from skidpad.sensors.bench import convoy
    from skidpad.sensors.suite import PixelSuite
    from skidpad.sensors.twelve import twelve_sensors
    from skidpad.stack.perception.hsv import LampCamera

    road_map, specs = load_map("figure8"), twelve_sensors()
    table, states = convoy(road_map)
    suite = PixelSuite(road_map, table, specs, preset("rain-night"), render_all=True)
    LampCamera(specs).look(suite.observe(0, states, {}).images)


def drive_one(argument: tuple[Cell, Path]) -> tuple[RunKey, Metrics, Timing, str]:
    """In a worker: drive a cell, write its folder, return its row and the last line of an error."""
    # numba and friends are imported only where they are needed, not in the parent.
    from skidpad.campaign.backends import WATCHDOG, keep_server, make_backend
    from skidpad.campaign.drive import run_cell
    from skidpad.evidence.drive.metrics import run_metrics
    from skidpad.recording.logfiles import write_log
    from skidpad.roads.bundled import load_map

    cell, out = argument
    folder = out / RUNS / cell.name
    if folder.exists():  # what a killed attempt left
        shutil.rmtree(folder)
    folder.mkdir(parents=True)
    write_bytes(folder / CONFIG, yaml.safe_dump(cell.resolved(), sort_keys=False).encode())
    wall, cpu = time.perf_counter(), time.process_time()
    pace = Pace(DT)
    keep_server(cell.backend)
    backend = make_backend(cell.backend, WATCHDOG)
    run = run_cell(cell, backend=backend, folder=folder, watchers=(pace,))
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    digest = write_log(folder, run.log)
    if run.error:
        write_bytes(folder / ERROR, run.error.encode())
    timing = Timing(
        config=cell.driver.label,
        weather=cell.weather.name,
        seed=cell.seed,
        wall_s=wall,
        cpu_s=cpu,
        rtf=len(run.log) * run.log.header.dt / wall,
        rtf_below_0_9_pct=pace.slow_pct,
    )
    metrics = Metrics()
    if len(run.log):  # a stack may fail before it has answered once
        metrics = run_metrics(run.log, load_map(cell.map), metric_settings(cell))
    return run_key(cell, run.outcome, digest), metrics, timing, run.error.strip().split("\n")[-1]


def metric_settings(cell: Cell) -> MetricSettings:
    """The definitions that the cell's profile asks for (D-102, D-103)."""
    same_road = cell.settings.lane_truth is LaneTruth.SAME_ROAD
    return MetricSettings(
        lead=LeadDefinition.SAME_ROAD_AND_LANE if same_road else LeadDefinition.AHEAD_ON_LANE
    )


def _entry(cell: Cell, finished: Finished, here: str) -> Entry:
    if finished.failure is None:
        key, metrics, timing, error = finished.value
    else:
        key, metrics = run_key(cell, FAILURES[finished.failure]), Metrics()
        timing = Timing(
            config=cell.driver.label,
            weather=cell.weather.name,
            seed=cell.seed,
            wall_s=finished.wall_s,
            cpu_s=0.0,
            rtf=0.0,
        )
        error = finished.detail.strip()
    return Entry(
        run=cell.name, key=key, metrics=metrics, timing=timing, fingerprint=here, error=error
    )


def run_key(cell: Cell, outcome: Outcome, log_hash: str | None = None) -> RunKey:
    """The identifying columns of a cell's row."""
    return RunKey(
        config=cell.driver.label,
        weather=cell.weather.name,
        precipitation_kind=cell.weather.precipitation_kind,
        time_of_day=time_of_day(cell.weather),
        seed=cell.seed,
        profile=cell.profile,
        map=cell.map,
        sensors=cell.level.value,
        grip=cell.settings.grip.value,
        range=cell.settings.range.value,
        outcome=outcome.value,
        version=__version__,
        log_hash=log_hash,
    )


def time_of_day(weather: Weather) -> str:
    """Which of the published times a preset's name ends in, "" for others."""
    return next((t for t in TIMES_OF_DAY if weather.name.endswith(t)), "")
