"""What a driven run leaves in OUT/runs/<run>, whichever campaign it belongs to."""

from __future__ import annotations

import csv
import io
import shutil
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from skidpad.core.names import inside
from skidpad.evidence.pairs import Pair, pairs, pairs_of_others
from skidpad.recording.campaign.folder import RUNS
from skidpad.recording.campaign.results import Timing
from skidpad.recording.files import output_error, write_bytes
from skidpad.recording.run.log_files import write_log
from skidpad.recording.run.readings import write_readings
from skidpad.scenarios.playing.results import write_results

if TYPE_CHECKING:
    from skidpad.campaign.runs.run import Run

CONFIG, ERROR, PAIRS = "config.yaml", "error.txt", "pairs.csv"


class Stopwatch:
    """Wall and processor time since it was made; outside every hash."""

    def __init__(self) -> None:
        self.wall, self.cpu = time.perf_counter(), time.process_time()

    def timing(self, simulated_s: float | None = None, slow_pct: float | None = None) -> Timing:
        """What a run took so far, and its real-time factor."""
        wall, cpu = time.perf_counter() - self.wall, time.process_time() - self.cpu
        rtf = None if simulated_s is None else simulated_s / wall
        return Timing(wall_s=wall, cpu_s=cpu, rtf=rtf, rtf_below_0_9_pct=slow_pct)


def fresh_folder(out: Path, run: str) -> Path:
    """Where a run of this name goes, without what a killed attempt left; it does not exist yet.

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
    """Write the resolved set-up of a run."""
    write_bytes(folder / CONFIG, yaml.safe_dump(config, sort_keys=False).encode())


def write_run(folder: Path, driven: Run) -> str:
    """Write log, events, sensor readings and the stack's error; returns the log's content hash."""
    digest = write_log(folder, driven.log)
    if driven.readings is not None:
        write_readings(folder, driven.readings)
    if driven.error:
        write_bytes(folder / ERROR, driven.error.encode())
    return digest


def write_played(folder: Path, driven: Run) -> None:
    """What a scenario leaves besides: trajectories, its story, how critical any two became."""
    if driven.played is None:
        return
    write_results(folder, driven.log, driven.played)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(Pair._fields)
    for pair in (*pairs(driven.log), *pairs_of_others(driven.log)):
        numbers = ("" if v is None else f"{v:.4f}" for v in pair[2:])
        writer.writerow((pair.one, pair.other, *numbers))
    write_bytes(folder / PAIRS, text.getvalue().encode())


def last_line(error: str) -> str:
    """What a traceback comes down to."""
    return error.strip().rpartition("\n")[2]
