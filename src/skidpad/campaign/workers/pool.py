"""A pool of long-lived, killable worker processes: one run at a time each, with a deadline.

A run that hangs or kills its process costs that process and nothing else: the worker is replaced,
the run is tried once more and then recorded as crashed or timed out (decision L-7). Results do not
travel through here, except one small value per run: runs write their own files.
"""

from __future__ import annotations

import os
import sys
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from multiprocessing.connection import wait

from skidpad.campaign.workers.worker import (
    CONTEXT,
    Finished,
    Job,
    Runner,
    Worker,
    die_with_parent,
    give_job,
)

ATTEMPTS = 2  # a run that killed its worker gets one more try
SINGLE_THREADED = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "POLARS_MAX_THREADS",
    "OPENCV_FOR_THREADS_NUM",
)


@dataclass(slots=True)
class _Queue:
    waiting: deque[Job]
    attempts: dict[str, int] = field(default_factory=dict)

    def next(self) -> Job:
        """Takes the next job off the queue and counts the try."""
        job = self.waiting.popleft()
        self.attempts[job.key] = self.attempts.get(job.key, 0) + 1
        return job

    def again(self, job: Job) -> bool:
        """Puts a failed job back; returns False where it has no try left."""
        if self.attempts[job.key] >= ATTEMPTS:
            return False
        self.waiting.append(job)
        return True


def run_jobs(jobs: Iterable[Job], workers: int) -> Iterator[Finished]:
    """Runs all jobs on `workers` processes; yields each as it ends, failures as outcomes."""
    waiting = list(jobs)
    with keep_workers(min(workers, len(waiting))) as run:
        yield from run(waiting)


def _supervise(crew: list[Worker | None], queue: _Queue) -> Iterator[Finished]:
    """Gives waiting jobs to idle workers and yields each as it ends; failed ones are tried again.

    crew: the workers by place; None where there is none yet, or no more.
    """
    while True:
        for place, worker in enumerate(crew):
            if (worker is None or worker.job is None) and queue.waiting:
                crew[place] = give_job(worker, queue.next())
        busy = {place: w for place, w in enumerate(crew) if w is not None and w.job is not None}
        if not busy:
            return
        wait(
            [sign for w in busy.values() for sign in w.signs],
            min(w.patience() for w in busy.values()),
        )
        for place, worker in busy.items():
            finished = worker.collect()
            if finished is None:
                continue
            worker.job = None
            if finished.failure is not None:
                worker.dismiss()
                crew[place] = None
                if queue.again(finished.job):
                    continue
            yield replace(finished, attempts=queue.attempts[finished.job.key])


@contextmanager
def keep_workers(workers: int) -> Iterator[Runner]:
    """Yields a runner whose worker processes stay from one batch of jobs to the next."""
    crew: list[Worker | None] = [None] * max(workers, 1)
    with single_threaded():
        try:
            yield lambda jobs: _supervise(crew, _Queue(deque(jobs)))
        finally:
            for worker in crew:
                if worker is not None:
                    worker.dismiss()


def warm(compile_all: Callable[[], None]) -> None:
    """Compiles in a process of its own, so that it is done once and not by each worker (X-10)."""
    with single_threaded():
        process = CONTEXT.Process(target=_warm, args=(compile_all,))
        process.start()
        process.join()


def local(workers: int, warm_up: Callable[[], None] | None = None) -> Runner:
    """Returns a runner on this machine; `warm_up` is called once, before its first job."""

    def run(jobs: Iterable[Job]) -> Iterator[Finished]:
        nonlocal warm_up
        jobs = list(jobs)
        if jobs and warm_up is not None:
            warm(warm_up)
            warm_up = None
        yield from run_jobs(jobs, workers)

    return run


def _warm(compile_all: Callable[[], None]) -> None:
    """Compiles all kernels in a worker that ends with its parent."""
    die_with_parent()
    compile_all()
    sys.stdout.flush()


@contextmanager
def single_threaded() -> Iterator[None]:
    """Sets one thread for each library in the environment of children; restores it at the end."""
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
