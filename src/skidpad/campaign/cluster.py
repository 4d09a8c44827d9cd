"""The same jobs on many machines: Dask distributed behind the same interface as the local pool.

The ledger on disk stays the truth; the scheduler only moves jobs. Workers need to see the output
folder under the same path. A worker that is killed costs the jobs that it held; they are tried once
more and then recorded as crashed, as in the pool (decision L-7).
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from skidpad.campaign.pool import ATTEMPTS, Finished, Job, resolve, single_threaded
from skidpad.core.errors import BackendError, ConfigError, MissingExtra

LOCAL = "local:"
AHEAD = 4  # jobs per thread that wait at the scheduler: enough to keep it busy, few enough to lose
CONNECT_S = 30.0


def work(job: Job) -> tuple[Any, str, float]:
    """On a worker: the value, or the traceback, and the wall time."""
    import traceback

    began = time.monotonic()
    try:
        return resolve(job.target)(job.argument), "", time.monotonic() - began
    except Exception:
        return None, traceback.format_exc(), time.monotonic() - began


@contextmanager
def runner_of(address: str) -> Iterator[Any]:
    """A runner on a cluster: `local:N` starts one here, else the scheduler at the address."""
    try:
        dask: Any = import_module("distributed")
    except ImportError as error:
        raise MissingExtra("--cluster", "cluster") from error
    if address.startswith(LOCAL):
        text = address.removeprefix(LOCAL)
        if not text.isdigit() or int(text) < 1:
            raise ConfigError(f"--cluster local:N needs a number of workers, got {address!r}")
        with (
            single_threaded(),
            dask.LocalCluster(
                n_workers=int(text), threads_per_worker=1, processes=True, dashboard_address=None
            ) as cluster,
            dask.Client(cluster) as client,
        ):
            yield lambda jobs: run_on(client, jobs)
        return
    try:
        client = dask.Client(address, timeout=CONNECT_S)
    except (OSError, ValueError, TimeoutError) as error:
        raise BackendError(f"--cluster {address}: no scheduler answers there ({error})") from None
    with client:
        yield lambda jobs: run_on(client, jobs)


def run_on(client: Any, jobs: Iterable[Job]) -> Iterator[Finished]:
    """Run all jobs on the cluster; yield each as it ends."""
    dask: Any = import_module("distributed")
    waiting = list(jobs)[::-1]
    if not waiting:
        return
    threads = sum(client.nthreads().values()) or 1
    held: dict[Any, Job] = {}
    attempts: dict[str, int] = {}

    def submit(job: Job) -> Any:
        future = client.submit(work, job, pure=False, retries=0, key=f"{job.key}-{len(attempts)}")
        attempts[job.key] = attempts.get(job.key, 0) + 1
        held[future] = job
        return future

    running = dask.as_completed(
        [submit(waiting.pop()) for _ in range(min(len(waiting), AHEAD * threads))]
    )
    for future in running:
        job = held.pop(future)
        finished = _collect(future, job)
        if finished.failure is not None and attempts[job.key] < ATTEMPTS:
            running.add(submit(job))
            continue
        if waiting:
            running.add(submit(waiting.pop()))
        yield finished


def _collect(future: Any, job: Job) -> Finished:
    error = future.exception()
    if error is not None:
        return Finished(job, failure="crashed", detail=f"the worker was lost: {error}")
    value, trace, wall = future.result()
    if trace:
        return Finished(job, failure="crashed", detail=trace, wall_s=wall)
    return Finished(job, value=value, wall_s=wall)
