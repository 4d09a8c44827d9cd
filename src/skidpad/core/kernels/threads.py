"""Work in threads beside each other: kernels hold no lock, so they run on all processors at once."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager
from functools import cache
from typing import ParamSpec, TypeVar

T = TypeVar("T")
P = ParamSpec("P")


def count_processors() -> int:
    """Returns how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):  # on Linux
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@cache
def _pool() -> ThreadPoolExecutor:
    """Returns the threads of this process, one per processor; they start when there is work for them."""
    return ThreadPoolExecutor(count_processors(), thread_name_prefix="beside")


class Beside(AbstractContextManager["Beside"]):
    """Starts calls in threads; all of them have ended when it is left. A context manager.

    Calls must not share anything that one of them writes, and not start further ones. On one processor each
    is made when it is started.
    """

    def __init__(self) -> None:
        self._started: list[Future[object]] = []

    def start(self, call: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Returns the future of a call that has been started."""
        if count_processors() == 1:
            future: Future[T] = Future()
            future.set_result(call(*args, **kwargs))
            return future
        future = _pool().submit(call, *args, **kwargs)
        self._started.append(future)  # type: ignore[arg-type]
        return future

    def __exit__(self, *error: object) -> None:
        """Waits for all calls, whatever became of them."""
        wait(self._started)
