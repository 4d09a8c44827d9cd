"""The process that makes the pictures, as the page's process sees it."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from skidpad.cockpit.feed import Feed
from skidpad.cockpit.words import End, Word, encode
from skidpad.core.errors import InputError, SkidpadError

ENDS_WITHIN = 120.0  # s to write the run's folder
# what a terminal or a service sends to all processes at once
GROUP = [getattr(signal, n) for n in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, n)]
Job = Callable[[str, Connection, dict[str, Any]], str]


class Producer:
    """Runs a job in a process of its own, from `start` to `stop`.

    A job is given the feed's name, the pipe and plain data; what it returns is said at the end.
    """

    def __init__(self, job: Job, about: dict[str, Any]) -> None:
        self.feed = Feed()
        context = multiprocessing.get_context("spawn")
        self._pipe, self._theirs = context.Pipe()
        told = (job, self.feed.name, self._theirs, about)
        self._process = context.Process(target=_work, args=told, name="cockpit")
        self._said: tuple[str, str] | None = None

    def start(self) -> None:
        """Starts the process that makes pictures."""
        self._process.start()
        self._theirs.close()

    def say(self, word: Word) -> None:
        """Sends a word to the job; one that comes too late is lost."""
        try:
            self._pipe.send_bytes(encode(word))
        except (BrokenPipeError, OSError):
            return

    @property
    def result(self) -> tuple[str, str] | None:
        """Returns ("done", "refused" or "failed", a sentence) once it has ended; None: it still works."""
        if self._said is None and self._pipe.poll():
            try:
                self._said = self._pipe.recv()
            except (EOFError, OSError):
                self._said = ("failed", "the simulator's process ended without a word")
        return self._said

    def wait(self, seconds: float) -> bool:
        """Waits at most so many s for the end; True when it has ended."""
        if self.result is None:
            self._pipe.poll(seconds)
        return self.result is not None

    def stop(self) -> None:
        """Ends the job, kills a process that stays for two times ENDS_WITHIN s, and releases the memory.

        Safe to call twice.
        """
        self.say(End())
        if self._process.is_alive():
            self.wait(ENDS_WITHIN)
            self._process.join(ENDS_WITHIN)
            if self._process.is_alive():
                self._process.kill()
                self._process.join()
        self.feed.close()

    def outcome(self) -> str:
        """Returns the sentence of its end; InputError when it was refused, SkidpadError when it failed."""
        kind, text = self.result or ("failed", "the drive was not ended")
        if kind == "refused":
            raise InputError(text)
        if kind == "failed":
            raise SkidpadError(text)
        return text


def _work(job: Job, name: str, pipe: Connection, about: dict[str, Any]) -> None:
    """Runs a job in its process and sends how it ended through the pipe: done, refused or failed."""
    for one in GROUP:  # the page's process hears it: the pipe says so, and the drive is kept
        signal.signal(one, signal.SIG_IGN)
    feed_name = name
    try:
        said = ("done", job(feed_name, pipe, about))
    except InputError as error:
        said = ("refused", str(error))
    except SkidpadError as error:
        said = ("failed", str(error))
    except Exception as error:  # whatever it is, the page must hear of it
        said = ("failed", f"the simulator failed: {error!r}")
    try:
        pipe.send(said)
    except (BrokenPipeError, OSError):
        return
