"""Drive one run by itself into a folder, as `skidpad play` does."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from skidpad.campaign.driving.backends import WATCHDOG, keep_server, make_backend
from skidpad.campaign.driving.course_file import load_scenario
from skidpad.campaign.runs.folder import write_drive
from skidpad.campaign.runs.run import Run, run
from skidpad.campaign.user_files import keep_road
from skidpad.campaign.workers.pool import run_jobs
from skidpad.campaign.workers.worker import Job
from skidpad.core.courses import Scenario
from skidpad.core.errors import BackendError
from skidpad.core.run import RunSpec
from skidpad.core.simulator import BackendKind
from skidpad.recording.files import require_free


@dataclass(frozen=True, slots=True)
class Task:
    """What a worker is given."""

    run: RunSpec
    out: Path
    checkpoints_s: float | None = None  # s between checkpoints in the folder


def run_to(spec: RunSpec, out: Path, checkpoints_s: float | None = None) -> Run:
    """Drives a run and writes its whole folder; returns the run. OutputError when the folder is taken.

    On a CARLA server a process of its own drives: the wheel's threads can end theirs. BackendError
    when that process fails.
    """
    task = Task(spec, require_free(out), checkpoints_s)
    if spec.backend.backend != BackendKind.CARLA:
        return run_task(task)
    if isinstance(spec.course, Scenario):
        load_scenario(spec.course)  # what is wrong in the file is said here
    (finished,) = run_jobs([Job(out.name, run_task, task)], 1)
    if finished.failure is not None:
        raise BackendError(f"{spec.name} on CARLA: {finished.detail.strip()}")
    driven: Run = finished.value
    return driven


def run_task(task: Task) -> Run:
    """Drives a task in this process, writes its folder and returns the run."""
    keep_server(task.run.backend)
    backend = make_backend(task.run.backend, WATCHDOG)
    driven = run(task.run, backend=backend, folder=task.out, checkpoints_s=task.checkpoints_s)
    write_drive(task.out, task.run, driven)
    keep_road(task.out, driven.road)
    return driven
