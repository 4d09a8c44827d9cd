"""Drive channels over routes for hours: segments with own seeds, a pool, resume (C-12).

OUT/<route>/<route>-<seed>.mcap and, once it is complete, .json with its outcome beside it. A run
that is repeated drives only what is missing.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from math import ceil
from pathlib import Path

import msgspec

from skidpad.campaign.cells import BackendChoice, BackendKind
from skidpad.campaign.channel_drive import SegmentPlan, drive_segment
from skidpad.campaign.channel_routes import DrivenRoute
from skidpad.campaign.pool import Finished, Job, run_jobs
from skidpad.core.errors import OutputError, require_range
from skidpad.recording.channel_drives import ARBITER, DriveOutcome, DriveRecord, read_record
from skidpad.recording.channel_hash import recording_hash
from skidpad.recording.files import write_bytes

SEGMENT = 600.0  # s (C-12)
SEEDS_PER_ROUTE = 1000  # seeds of a route are seed * this + segment number


@dataclass(frozen=True, slots=True)
class DriveSummary:
    """What a campaign came to."""

    folder: Path
    outcomes: tuple[DriveOutcome, ...]
    driven: int  # segments driven in this call
    failed: tuple[str, ...]  # names of segments that crashed or timed out


def segment_plans(
    routes: Sequence[DrivenRoute],
    hours: float,
    *,
    channels: tuple[str, ...],
    seed: int = 0,
    drive_by: str = ARBITER,
    noise: float = 1.0,
    backend: BackendChoice | None = None,
) -> list[SegmentPlan]:
    """Segments of ten minutes, the hours split equally among routes; the last one is the rest."""
    require_range("hours", hours, 1.0 / 3600.0, 10_000.0)
    require_range("noise", noise, 0.0, 10.0)
    seconds = hours * 3600.0 / len(routes)
    return [
        SegmentPlan(
            route=route,
            channels=channels,
            seed=seed * SEEDS_PER_ROUTE + i,
            duration=min(SEGMENT, seconds - i * SEGMENT),
            drive_by=drive_by,
            noise=noise,
            backend=BackendChoice() if backend is None else backend,
        )
        for i in range(ceil(seconds / SEGMENT - 1e-9))
        for route in routes
    ]


def run_drives(
    plans: Iterable[SegmentPlan],
    out: Path,
    *,
    workers: int,
    on_run: Callable[[DriveOutcome], None] = lambda _: None,
) -> DriveSummary:
    """Drive what OUT does not have yet; OutputError when it holds other drives of the same name."""
    outcomes, jobs = [], []
    for plan in plans:
        done = _done(plan, out)
        if done is not None:
            outcomes.append(done)
            continue
        jobs.append(Job(plan.name, "skidpad.campaign.channels:drive_one", (plan, out)))
    failed = []
    for finished in run_jobs(jobs, workers, warm="skidpad.campaign.channels:warm_up"):
        outcome = _outcome(finished)
        if outcome is None:
            failed.append(finished.job.key)
            continue
        outcomes.append(outcome)
        on_run(outcome)
    outcomes.sort(key=lambda o: (o.route, o.seed))
    return DriveSummary(out, tuple(outcomes), len(jobs), tuple(failed))


def drive_one(argument: tuple[SegmentPlan, Path]) -> DriveOutcome:
    """In a worker: drive one segment and write both files."""
    plan, out = argument
    folder = out / plan.route.name
    folder.mkdir(parents=True, exist_ok=True)
    recording = folder / f"{plan.name}.mcap"
    cpu = time.process_time()
    outcome = drive_segment(plan, recording)
    cpu = time.process_time() - cpu
    outcome = msgspec.structs.replace(
        outcome, content_hash=recording_hash(recording), cpu_s=round(cpu, 2)
    )
    _write(folder / f"{plan.name}.json", plan, outcome)
    return outcome


def warm_up() -> None:
    """Compile every kernel that a segment needs, by driving a moment."""
    import tempfile

    from skidpad.campaign.channel_routes import driven_routes

    with tempfile.TemporaryDirectory() as folder:
        plan = SegmentPlan(
            route=driven_routes()["route-4"],
            channels=("lav_like", "tfuse_like"),
            seed=0,
            duration=1.0,
        )
        drive_segment(plan, Path(folder) / "warm.mcap")


def _identity(plan: SegmentPlan) -> dict[str, object]:
    """What decides a segment; where the server is does not."""
    plain: dict[str, object] = msgspec.to_builtins(plan)
    del plain["backend"]
    if plan.backend.kind is not BackendKind.EMBEDDED:
        plain["backend"] = plan.backend.resolved()
    return plain


def _write(path: Path, plan: SegmentPlan, outcome: DriveOutcome) -> None:
    record = DriveRecord(_identity(plan), outcome)
    write_bytes(path, msgspec.json.format(msgspec.json.encode(record), indent=1))


def _done(plan: SegmentPlan, out: Path) -> DriveOutcome | None:
    """The outcome of a finished segment; None: it is still to be driven."""
    path = out / plan.route.name / f"{plan.name}.json"
    if not (path.is_file() and path.with_suffix(".mcap").is_file()):
        return None
    record = read_record(path)
    if record is None:
        return None
    if record.plan != msgspec.json.decode(msgspec.json.encode(_identity(plan))):
        raise OutputError(f"{path}: was driven with other settings; choose another folder")
    return record.outcome


def _outcome(finished: Finished) -> DriveOutcome | None:
    return None if finished.failure is not None else finished.value
