"""A process that does one job at a time, by a deadline, and can be killed at any moment."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any

from skidpad.campaign.driving.sharing import share_setups
from skidpad.core.errors import SkidpadError
from skidpad.core.text.told import clean, describe_value
from skidpad.core.vocabulary import Outcome

LONGEST_STORY = 20_000  # characters of a traceback
ENDING = 5.0  # s that a process has to be gone once its pipe has ended
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


@dataclass(frozen=True, slots=True)
class _Answer:
    """What a worker says: of which job, from which process, and what."""

    key: str
    process: int
    value: Any
    error: str


class Worker:
    """Runs one job at a time in a process that can be killed at any moment, with its children."""

    def __init__(self) -> None:
        self.pipe, there = CONTEXT.Pipe()
        self.process = CONTEXT.Process(target=_work, args=(there,), daemon=True)
        self.process.start()
        self._end = _end_of(self.process)
        there.close()
        self.job: Job | None = None
        self.started = 0.0

    def give(self, job: Job) -> None:
        """Begins a job; OSError when the process died idle."""
        self.pipe.send(job)
        self.job, self.started = job, time.monotonic()

    def patience(self) -> float:
        """Returns the s until the job's deadline, 0 at least, and SPARE more."""
        assert self.job is not None
        return max(self.started + self.job.deadline_s - time.monotonic(), 0.0) + SPARE

    def collect(self) -> Finished | None:
        """Returns how the job ended, None while it runs; past its deadline a timeout, and it still runs.

        A dead process is a crash. The caller dismisses a worker whose job failed.
        """
        job = self.job
        assert job is not None
        wall = time.monotonic() - self.started
        finished = Finished(job, wall_s=wall)
        ended = bool(wait([self._end], 0.0))  # asked first: its last word may be in the pipe still
        try:
            answer = self._answer(job)
        except Exception:  # the end of the pipe, or what is no message
            answer, ended = None, True
        if answer is not None:
            if answer.error:
                return replace(finished, failure=Outcome.CRASHED, detail=answer.error)
            return replace(finished, value=answer.value)
        if ended:
            wait([self._end], ENDING)
            _kill_group(self.process.pid)
            self.process.join(ENDING)
            error = f"the worker process ended with exit code {self.process.exitcode}"
            return replace(finished, failure=Outcome.CRASHED, detail=error)
        if wall > job.deadline_s:
            detail = f"no end after {job.deadline_s:g} s"
            return replace(finished, failure=Outcome.TIMEOUT, detail=detail)
        return None

    def _answer(self, job: Job) -> _Answer | None:
        """Returns what our process says of this job, None without; words of its children do not count."""
        while self.pipe.poll():  # also at its end
            answer = self.pipe.recv()
            if (
                isinstance(answer, _Answer)
                and answer.key == job.key
                and answer.process == self.process.pid
            ):
                return answer
        return None

    @property
    def signs(self) -> tuple[Any, ...]:
        """Returns what becomes ready when there is something to collect: its pipe, and its end."""
        return self.pipe, self._end

    def dismiss(self) -> None:
        """Kills the process and what it started."""
        self.pipe.close()
        _kill_group(self.process.pid)
        self.process.kill()
        self.process.join()
        if self._end != self.process.sentinel:
            os.close(self._end)
            self._end = self.process.sentinel


def give_job(worker: Worker | None, job: Job) -> Worker:
    """Returns a worker that has begun the job: this one, or a new one when it is None or died idle."""
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


def _end_of(process: SpawnProcess) -> int:
    """Returns a descriptor that is ready when the process has ended, even if a child of it lives on."""
    assert process.pid is not None
    if hasattr(os, "pidfd_open"):
        with suppress(OSError):
            return os.pidfd_open(process.pid)
    return process.sentinel


def _kill_group(leader: int | None) -> None:
    """Kills all processes of a worker's group, if the worker leads one; nothing for None."""
    if leader is None or not hasattr(os, "killpg"):
        return
    try:
        leads = os.getpgid(leader) == leader
    except (
        ProcessLookupError
    ):  # it is gone; its group keeps its number while there is somebody in it
        leads = True
    if leads:
        with suppress(OSError):
            os.killpg(leader, signal.SIGKILL)


def _work(pipe: Connection) -> None:
    """Runs jobs from the pipe in the worker process and sends their values, until the parent is gone."""
    with share_setups():
        _serve(pipe)


def _serve(pipe: Connection) -> None:
    """Runs jobs as they come, which share what they can."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle
    if hasattr(os, "setpgid"):
        os.setpgid(0, 0)  # so that what a stack starts can be ended with it
    die_with_parent()
    me, home = os.getpid(), os.getcwd()
    while True:
        try:
            job: Job = pipe.recv()
        except (EOFError, OSError):
            return
        os.chdir(home)  # wherever the last job's stack went
        value, error = _run_job(job)
        if os.getpid() != me:  # a stack forked: its child must neither answer nor take the next job
            os._exit(0)
        _send(pipe, _Answer(job.key, me, value, error))


def _run_job(job: Job) -> tuple[Any, str]:
    """Returns the value of a job and "", or None and what it failed of; it never raises."""
    try:
        return job.work(job.argument), ""
    except SkidpadError as error:  # one sentence for a person; where it arose says no more
        return None, clean(str(error))
    except BaseException:  # also SystemExit and KeyboardInterrupt: no signal raises them here
        return None, clean(traceback.format_exc(), LONGEST_STORY)


def _send(pipe: Connection, answer: _Answer) -> None:
    """Sends the answer; of a value that cannot be sent, a failure. Exits where the parent is gone."""
    try:
        pipe.send(answer)
    except (EOFError, OSError):  # the parent is gone
        os._exit(1)
    except Exception as error:
        pipe.send(
            replace(answer, value=None, error=f"its result cannot be sent: {describe_value(error)}")
        )


def die_with_parent() -> None:
    """Starts a thread that kills this process and its children when the parent vanishes.

    An orphan would write beside a resumed campaign.
    """
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        """Waits for the parent's end, then kills this process and all that it started."""
        wait([parent.sentinel])
        _kill_group(os.getpid())  # with what it started
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
