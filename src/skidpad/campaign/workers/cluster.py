"""The same jobs on many machines: Dask distributed behind the same interface as the local pool.

The ledger on disk stays the truth; the scheduler only moves jobs. On each machine a job runs in a
killable process of the pool's kind, with its deadline; Dask's own worker hands it over and waits.
Workers need to see the output folder under the same path. A machine that is lost costs the jobs
that it held; they are tried once more and then recorded as crashed, as in the pool (decision L-7).
"""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from importlib import import_module
from multiprocessing.connection import wait
from typing import Any

from skidpad.campaign.workers.pool import ATTEMPTS, SINGLE_THREADED, warm
from skidpad.campaign.workers.worker import Finished, Job, Runner, Worker, give_job
from skidpad.core.errors import BackendError, ConfigError, MissingExtra
from skidpad.core.vocabulary import Outcome

LOCAL = "local:"
AHEAD = 4  # jobs per thread that wait at the scheduler: enough to keep it busy, few enough to lose
CONNECT_S = 30.0
_here = threading.local()  # one killable process for each thread of a Dask worker
_warming = threading.Lock()
_warmed: list[Callable[[], None]] = []


def work(job: Job, warm_up: Callable[[], None] | None) -> Finished:
    """Does a job on a machine of the cluster, and kills its process at the deadline."""
    # Dask starts its workers as daemons, which may not have children; ours end with their parent.
    multiprocessing.current_process()._config["daemon"] = False  # type: ignore[attr-defined]
    os.environ.update(dict.fromkeys(SINGLE_THREADED, "1"))
    if warm_up is not None:
        _warm_once(warm_up)
    worker: Worker = give_job(getattr(_here, "worker", None), job)
    finished = None
    while finished is None:
        wait(worker.signs, worker.patience())
        finished = worker.collect()
    worker.job = None
    _here.worker = worker
    if finished.failure is not None:
        worker.dismiss()
        _here.worker = None
    return finished


def _warm_once(warm_up: Callable[[], None]) -> None:
    """Compiles before the first job of this process, so that no deadline pays for it."""
    with _warming:
        if warm_up not in _warmed:
            warm(warm_up)
            _warmed.append(warm_up)


@contextmanager
def runner_of(address: str, warm_up: Callable[[], None] | None = None) -> Iterator[Runner]:
    """Yields a runner on a cluster: `local:N` starts one here, else the scheduler at the address.

    warm_up: compiles every kernel that a job may need, on each of the cluster's processes.
    ConfigError for another N, BackendError without a scheduler.
    """
    try:
        dask: Any = import_module("distributed")
    except ImportError as error:
        raise MissingExtra("--cluster", "cluster") from error
    if address.startswith(LOCAL):
        text = address.removeprefix(LOCAL)
        if not text.isdigit() or int(text) < 1:
            raise ConfigError(f"--cluster local:N needs a number of workers, got {address!r}")
        with (
            dask.LocalCluster(
                n_workers=int(text), threads_per_worker=1, processes=True, dashboard_address=None
            ) as cluster,
            dask.Client(cluster) as client,
        ):
            yield partial(run_on, client, warm_up=warm_up)
        return
    try:
        client = dask.Client(address, timeout=CONNECT_S)
    except (OSError, ValueError, TimeoutError) as error:
        raise BackendError(f"--cluster {address}: no scheduler answers there ({error})") from None
    with client:
        yield partial(run_on, client, warm_up=warm_up)


def run_on(
    client: Any, jobs: Iterable[Job], warm_up: Callable[[], None] | None = None
) -> Iterator[Finished]:
    """Runs all jobs on the cluster and yields each as it ends; a failed one is tried ATTEMPTS times."""
    dask: Any = import_module("distributed")
    waiting = list(jobs)[::-1]
    if not waiting:
        return
    threads = sum(client.nthreads().values()) or 1
    held: dict[Any, Job] = {}
    attempts: dict[str, int] = {}

    def submit(job: Job) -> Any:
        attempts[job.key] = attempts.get(job.key, 0) + 1
        future = client.submit(work, job, warm_up, pure=False, retries=0)
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
        yield replace(finished, attempts=attempts[job.key])


def _collect(future: Any, job: Job) -> Finished:
    """Returns how a job on the cluster ended; one whose worker was lost counts as crashed."""
    error = future.exception()
    if error is not None:
        return Finished(job, failure=Outcome.CRASHED, detail=f"the worker was lost: {error}")
    finished: Finished = future.result()
    return finished
