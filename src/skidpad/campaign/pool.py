"""A pool of long-lived, killable worker processes: one run at a time each, with a deadline.

A run that hangs or kills its process costs that process and nothing else: the worker is replaced,
the run is tried once more and then recorded as crashed or timed out (decision L-7). Results do not
travel through here, except one small value per run: runs write their own files.
"""

from __future__ import annotations

import importlib
import multiprocessing
import os
import signal
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from skidpad.core.errors import SkidpadError

ATTEMPTS = 2  # a run that killed its worker gets one more try
SINGLE_THREADED = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "POLARS_MAX_THREADS",
    "OPENCV_FOR_THREADS_NUM",
)


@dataclass(frozen=True, slots=True)
class Job:
    """One run: `target` names a function "module:function" that is called with `argument`."""

    key: str
    target: str
    argument: Any
    deadline_s: float = 3600.0


@dataclass(frozen=True, slots=True)
class Finished:
    """How a job ended. `failure` is None, "crashed" or "timeout"."""

    job: Job
    value: Any = None
    failure: str | None = None
    detail: str = ""
    wall_s: float = 0.0


@dataclass(slots=True)
class _Worker:
    process: BaseProcess
    pipe: Connection
    job: Job | None = None
    started: float = 0.0


@dataclass(slots=True)
class _Queue:
    waiting: deque[Job]
    attempts: dict[str, int] = field(default_factory=dict)

    def again(self, job: Job) -> bool:
        """Put a job whose worker died back, if it has tries left."""
        self.attempts[job.key] = self.attempts.get(job.key, 1) + 1
        if self.attempts[job.key] > ATTEMPTS:
            return False
        self.waiting.append(job)
        return True


def run_jobs(jobs: Iterable[Job], workers: int, warm: str | None = None) -> Iterator[Finished]:
    """Run all jobs on `workers` processes; yield each as it ends, in order of ending.

    warm: "module:function", called once in a process of its own before the workers start, so that
    kernels are compiled once and not once per worker (decision X-10).
    """
    queue = _Queue(deque(jobs))
    if not queue.waiting:
        return
    context = multiprocessing.get_context("spawn")
    with single_threaded():
        if warm is not None:
            process = context.Process(target=_warm, args=(warm,))
            process.start()
            process.join()
        crew = [_hire(context) for _ in range(min(max(workers, 1), len(queue.waiting)))]
        try:
            yield from _supervise(context, crew, queue)
        finally:
            for worker in crew:
                _dismiss(worker)


def _supervise(
    context: multiprocessing.context.SpawnContext, crew: list[_Worker], queue: _Queue
) -> Iterator[Finished]:
    while queue.waiting or any(w.job for w in crew):
        for place, worker in enumerate(crew):
            if worker.job is None and queue.waiting:
                crew[place] = _give(context, worker, queue.waiting.popleft())
        busy = [w for w in crew if w.job]
        ready = wait([w.pipe for w in busy], timeout=_patience(busy))
        for worker in busy:
            finished = _collect(worker, worker.pipe in ready)
            if finished is None:
                continue
            if finished.failure is not None:
                crew[crew.index(worker)] = _hire(context)
                _dismiss(worker)
                if queue.again(finished.job):
                    continue
            worker.job = None
            yield finished


def _give(context: multiprocessing.context.SpawnContext, worker: _Worker, job: Job) -> _Worker:
    """The worker with its job, or a new one when it died idle: no fault of the job."""
    try:
        worker.pipe.send(job)
    except OSError:
        _dismiss(worker)
        worker = _hire(context)
        worker.pipe.send(job)
    worker.job, worker.started = job, time.monotonic()
    return worker


def _patience(busy: list[_Worker]) -> float:
    """Seconds until the next deadline."""
    left = [w.started + w.job.deadline_s - time.monotonic() for w in busy if w.job]
    return max(min(left, default=0.0), 0.0) + 0.01


def _collect(worker: _Worker, ready: bool) -> Finished | None:
    """What became of the worker's job, None while it runs."""
    job = worker.job
    assert job is not None
    wall = time.monotonic() - worker.started
    if ready:
        try:
            value, error = worker.pipe.recv()
        except (EOFError, OSError):
            worker.process.join(timeout=5)
            how = f"the worker process ended with exit code {worker.process.exitcode}"
            return Finished(job, failure="crashed", detail=how, wall_s=wall)
        if error:
            return Finished(job, failure="crashed", detail=error, wall_s=wall)
        return Finished(job, value=value, wall_s=wall)
    if wall > job.deadline_s:
        return Finished(
            job, failure="timeout", detail=f"no end after {job.deadline_s:g} s", wall_s=wall
        )
    return None


def _hire(context: multiprocessing.context.SpawnContext) -> _Worker:
    here, there = context.Pipe()
    process = context.Process(target=_work, args=(there,), daemon=True)
    process.start()
    there.close()
    return _Worker(process, here)


def _dismiss(worker: _Worker) -> None:
    worker.pipe.close()
    worker.process.kill()
    worker.process.join()


def _work(pipe: Connection) -> None:
    """The worker process: jobs in, values out, until the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle
    _die_with_parent()
    while True:
        try:
            job: Job = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            answer: tuple[Any, str] = (resolve(job.target)(job.argument), "")
        except SkidpadError as error:  # one sentence for a person; where it arose says no more
            answer = (None, str(error))
        except Exception:
            answer = (None, traceback.format_exc())
        pipe.send(answer)


def _die_with_parent() -> None:
    """Leave at once when the parent vanishes: an orphan would write beside a resumed campaign."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def resolve(target: str) -> Callable[[Any], Any]:
    """The function that `module:function` names."""
    module, _, name = target.partition(":")
    function: Callable[[Any], Any] = getattr(importlib.import_module(module), name)
    return function


def _warm(target: str) -> None:
    module, _, name = target.partition(":")
    getattr(importlib.import_module(module), name)()
    sys.stdout.flush()


@contextmanager
def single_threaded() -> Iterator[None]:
    """Children inherit one thread for each library; the parent's own settings come back after."""
    before = {name: os.environ.get(name) for name in SINGLE_THREADED}
    os.environ.update(dict.fromkeys(SINGLE_THREADED, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
