"""A process that does one job at a time, by a deadline, and can be killed at any moment."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection, wait
from typing import Any

from skidpad.core.errors import SkidpadError
from skidpad.core.vocabulary import Outcome

SPARE = 0.01  # s after a deadline until it is looked at
CONTEXT = multiprocessing.get_context("spawn")


@dataclass(frozen=True, slots=True)
class Job:
    """One run: `work`, a function of a module, is called with `argument`."""

    key: str
    work: Callable[[Any], Any]
    argument: Any
    deadline_s: float = 3600.0


@dataclass(frozen=True, slots=True)
class Finished:
    """How a job ended. `failure` is None, CRASHED or TIMEOUT."""

    job: Job
    value: Any = None
    failure: Outcome | None = None
    detail: str = ""
    wall_s: float = 0.0
    attempts: int = 1


Runner = Callable[[Iterable[Job]], Iterator[Finished]]


class Worker:
    """A process that does one job at a time and can be killed at any moment."""

    def __init__(self) -> None:
        self.pipe, there = CONTEXT.Pipe()
        self.process = CONTEXT.Process(target=_work, args=(there,), daemon=True)
        self.process.start()
        there.close()
        self.job: Job | None = None
        self.started = 0.0

    def give(self, job: Job) -> None:
        """Begin a job; OSError when the process died idle."""
        self.pipe.send(job)
        self.job, self.started = job, time.monotonic()

    def patience(self) -> float:
        """Seconds until the job's deadline."""
        assert self.job is not None
        return max(self.started + self.job.deadline_s - time.monotonic(), 0.0) + SPARE

    def collect(self) -> Finished | None:
        """What became of the job, None while it runs."""
        job = self.job
        assert job is not None
        wall = time.monotonic() - self.started
        finished = Finished(job, wall_s=wall)
        if self.pipe.poll():  # also at its end
            try:
                value, error = self.pipe.recv()
            except (EOFError, OSError):
                self.process.join(timeout=5)
                error = f"the worker process ended with exit code {self.process.exitcode}"
                return replace(finished, failure=Outcome.CRASHED, detail=error)
            if error:
                return replace(finished, failure=Outcome.CRASHED, detail=error)
            return replace(finished, value=value)
        if wall > job.deadline_s:
            detail = f"no end after {job.deadline_s:g} s"
            return replace(finished, failure=Outcome.TIMEOUT, detail=detail)
        return None

    def dismiss(self) -> None:
        """Kill it, whatever it does."""
        self.pipe.close()
        self.process.kill()
        self.process.join()


def given(worker: Worker | None, job: Job) -> Worker:
    """A worker that has begun the job: this one, or a new one when it died idle, no fault of the job."""
    if worker is not None:
        try:
            worker.give(job)
        except OSError:
            worker.dismiss()
        else:
            return worker
    worker = Worker()
    worker.give(job)
    return worker


def _work(pipe: Connection) -> None:
    """The worker process: jobs in, values out, until the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle
    die_with_parent()
    me = os.getpid()
    while True:
        try:
            job: Job = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            answer: tuple[Any, str] = (job.work(job.argument), "")
        except SkidpadError as error:  # one sentence for a person; where it arose says no more
            answer = (None, str(error))
        except Exception:
            answer = (None, traceback.format_exc())
        if os.getpid() != me:  # a stack forked: its child must neither answer nor take the next job
            os._exit(0)
        pipe.send(answer)


def die_with_parent() -> None:
    """Leave at once when the parent vanishes: an orphan would write beside a resumed campaign."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
