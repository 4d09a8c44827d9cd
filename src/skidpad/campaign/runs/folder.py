"""What a driven run leaves in OUT/runs/<run>, whichever campaign it belongs to."""

from __future__ import annotations

import shutil
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml
from msgspec import structs

from skidpad.core.files.names import inside
from skidpad.core.run import RunSpec
from skidpad.evidence.pairs import Pair, pairs, pairs_of_others
from skidpad.recording.campaign.folder import RUNS
from skidpad.recording.campaign.results import Timing
from skidpad.recording.files import csv_text, output_error, write_bytes
from skidpad.recording.run.log_files import write_log
from skidpad.recording.run.readings import write_readings
from skidpad.recording.run.surfaces import write_laid_surfaces
from skidpad.scenarios.playing.results import write_results

if TYPE_CHECKING:
    from skidpad.campaign.runs.run import Run

CONFIG, ERROR, PAIRS = "config.yaml", "error.txt", "pairs.csv"


class Stopwatch:
    """Measures wall and processor time from its making on; they are outside every hash."""

    def __init__(self) -> None:
        self.wall, self.cpu = time.perf_counter(), time.process_time()

    def timing_of(self, driven: Run, slow_pct: float | None = None) -> Timing:
        """Returns the times so far with the real-time factor of a run, and how it was driven."""
        log, dt = driven.log, driven.log.header.dt
        table = None if driven.played is None else driven.played.table
        return replace(
            self.timing(len(log) * dt, slow_pct),
            quick_pct=100.0 * driven.quick_ticks / max(len(log), 1),
            why_not_quick=driven.why_not_quick or None,
            story_table_pct=None if table is None else 100.0 * table.by_table / max(table.ticks, 1),
            why_no_story_table=None if table is None else table.reason or None,
        )

    def timing(self, simulated_s: float | None = None, slow_pct: float | None = None) -> Timing:
        """Returns the times so far and, with `simulated_s`, the real-time factor."""
        wall, cpu = time.perf_counter() - self.wall, time.process_time() - self.cpu
        rtf = None if simulated_s is None else simulated_s / wall
        return Timing(wall_s=wall, cpu_s=cpu, rtf=rtf, rtf_below_0_9_pct=slow_pct)


def fresh_folder(out: Path, run: str) -> Path:
    """Removes what an earlier attempt of the run left and returns its folder, which is not made yet.

    Nothing outside OUT/runs is ever removed: ConfigError for a name that leads out of it.
    """
    folder = inside(out / RUNS, run)
    try:
        if folder.is_symlink():
            folder.unlink()
        elif folder.exists():
            shutil.rmtree(folder)
    except OSError as error:
        raise output_error(folder, error) from error
    return folder


def write_config(folder: Path, config: dict[str, Any]) -> None:
    """Writes the resolved set-up of a run as config.yaml."""
    write_bytes(folder / CONFIG, yaml.safe_dump(config, sort_keys=False).encode())


def write_run(folder: Path, driven: Run) -> str:
    """Writes log, events, sensor readings and the stack's error; returns the log's content hash."""
    digest = write_log(folder, driven.log)
    write_laid_surfaces(folder, driven.laid)
    if driven.readings is not None:
        write_readings(folder, driven.readings)
    if driven.error:
        write_bytes(folder / ERROR, driven.error.encode())
    return digest


def write_drive(folder: Path, spec: RunSpec, driven: Run) -> None:
    """Writes all that a run leaves: the run with what lay on its road at the begin, log, and story."""
    write_config(folder, structs.replace(spec, surface=driven.surface).to_plain())
    write_run(folder, driven)
    write_played(folder, driven)


def write_played(folder: Path, driven: Run) -> None:
    """Writes what a scenario leaves besides: trajectories, story, and pairs.csv with how close any two came.

    Nothing for a run without a scenario.
    """
    if driven.played is None:
        return
    write_results(folder, driven.log, driven.played)
    rows = (
        (pair.one, pair.other, *("" if v is None else f"{v:.4f}" for v in pair[2:]))
        for pair in (*pairs(driven.log), *pairs_of_others(driven.log))
    )
    write_bytes(folder / PAIRS, csv_text(Pair._fields, rows).encode())


def last_line(error: str) -> str:
    """Returns the last line of a traceback, "" of an empty one."""
    return error.strip().rpartition("\n")[2]
