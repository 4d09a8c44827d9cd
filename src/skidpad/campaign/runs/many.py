"""Many runs by one call: in this process or over workers, in order, with what they share made once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, TypeVar, overload

from skidpad.campaign.driving.sharing import share_setups
from skidpad.campaign.runs.drive import describe, drive
from skidpad.campaign.runs.folder import last_line
from skidpad.campaign.runs.run import Run, run
from skidpad.campaign.runs.together import drive_together
from skidpad.campaign.workers.pool import run_jobs
from skidpad.campaign.workers.worker import Job
from skidpad.core.errors import BackendError, ConfigError
from skidpad.core.run import RunSpec
from skidpad.stack.interface import Stack, VectorStack

T = TypeVar("T")
Described = RunSpec | Mapping[str, Any]
CPU, CUDA = "cpu", "cuda"
DEFAULTS = {name: value for name, value in (drive.__kwdefaults__ or {}).items() if name != "out"}


@overload
def drive_many(
    runs: Sequence[Described], *, workers: int = ..., device: str = ..., judge: None = ...
) -> list[Run]: ...
@overload
def drive_many(
    runs: Sequence[Described],
    *,
    workers: int = ...,
    device: str = ...,
    judge: Callable[[Run], T],
) -> list[T]: ...


def drive_many(
    runs: Sequence[Described],
    *,
    workers: int = 1,
    device: str = CPU,
    judge: Callable[[Run], Any] | None = None,
) -> list[Any]:
    """Drive a list of runs; the results come in the order of the list.

    Each run has the content hash that it has alone. Scenario files are compiled once for all runs that
    differ in other things only.

    Args:
        runs: run values, as `skidpad.Scenario(...).spec` is one, or mappings of what `skidpad.drive` takes.
            Runs whose `stack` is the same `VectorStack`, an object, are driven by it together.
        workers: processes; 1 drives in this one.
        device: "cpu", or "cuda" for a graphics card (extra `gpu`). Runs with a quick way whose world a kernel
            steps (no script, patches, wind, roll-over or envelope) are then driven on the card together, all
            others on the CPU. On a card the first 50 ticks are those of the CPU to 1e-9; content hashes are
            not those of the CPU.
        judge: is called with each run where it was driven, and its value stands in the list in place of
            the run. With workers it is a function of a module. Logs are not kept then.

    Returns:
        A run for each description, or what `judge` made of it.

    Raises:
        ConfigError: a value is out of its range, or the device is not there.
        BackendError: a worker's run failed; the message names it.

    Example:
        >>> runs = drive_many([{"stack": 2, "seed": s, "sensors": "objects"} for s in range(1, 9)])
        >>> [len(run.log.contacts) for run in runs]
    """
    if device not in (CPU, CUDA):
        raise ConfigError(f"device must be 'cpu' or 'cuda', got {device!r}")
    if workers < 1:
        raise ConfigError(f"workers must be at least 1, got {workers}")
    vectors = [_vector_of(one) for one in runs]
    described = [_describe(one) for one in runs]
    if device == CUDA:
        if any(vector is not None for vector in vectors):
            raise ConfigError("a stack that drives several runs together needs device='cpu'")
        return _drive_on_card(described, judge, workers)
    drive_one = partial(_drive_one, judge)
    if workers == 1:
        with share_setups():
            if any(vector is not None for vector in vectors):
                return _drive_with_vectors(described, vectors, judge)
            return [drive_one(spec, kind) for spec, kind in described]
    if any(vector is not None for vector in vectors):
        raise ConfigError("a stack that drives several runs together needs workers=1")
    specs = [spec for spec, _ in described]
    jobs = [Job(str(k), drive_one, spec, spec.deadline_s) for k, spec in enumerate(specs)]
    found: dict[int, Any] = {}
    for finished in run_jobs(jobs, workers):
        k = int(finished.job.key)
        if finished.failure is not None:
            raise BackendError(f"run {k} ({specs[k].name}): {last_line(finished.detail)}")
        found[k] = finished.value
    return [found[k] for k in range(len(specs))]


def _drive_on_card(
    described: Sequence[tuple[RunSpec, type[Stack] | None]],
    judge: Callable[[Run], Any] | None,
    workers: int,
) -> list[Any]:
    """Drives runs on the card, in this process or in parts by several that share it."""
    from skidpad.campaign.runs.card import drive_on_card  # it imports numba's CUDA
    from skidpad.core.kernels.card import require_card

    require_card()
    if not described:
        return []
    if workers == 1:
        with share_setups():
            return drive_on_card(described, judge)
    size = -(-len(described) // workers)
    sent = [(spec, None) for spec, _ in described]  # a worker loads the stack itself
    parts = [sent[first : first + size] for first in range(0, len(sent), size)]
    drive_part = partial(drive_on_card, judge=judge)
    jobs = [
        Job(str(k), drive_part, part, 3600.0 + sum(spec.deadline_s for spec, _ in part))
        for k, part in enumerate(parts)
    ]
    found: dict[int, list[Any]] = {}
    for finished in run_jobs(jobs, workers):
        if finished.failure is not None:
            raise BackendError(f"runs of worker {finished.job.key}: {last_line(finished.detail)}")
        found[int(finished.job.key)] = finished.value
    return [one for k in range(len(parts)) for one in found[k]]


def _vector_of(one: Described) -> VectorStack | None:
    """Returns the stack that drives this run together with others; None: it has one of its own."""
    stack = None if isinstance(one, RunSpec) else one.get("stack")
    together = isinstance(stack, VectorStack) and not isinstance(stack, type)
    return stack if together else None


def _describe(one: Described) -> tuple[RunSpec, type[Stack] | None]:
    """Returns a run, and the class of its stack where it is loaded."""
    if isinstance(one, RunSpec):
        return one, None
    vector = _vector_of(one)
    own = one if vector is None else {**one, "stack": type(vector)}
    return describe(**{**DEFAULTS, **own})


def _drive_with_vectors(
    described: Sequence[tuple[RunSpec, type[Stack] | None]],
    vectors: Sequence[VectorStack | None],
    judge: Callable[[Run], Any] | None,
) -> list[Any]:
    """Drives runs of which some are driven together, and returns them in their order, judged if asked."""
    found: dict[int, Any] = {}
    for k, ((spec, kind), vector) in enumerate(zip(described, vectors, strict=True)):
        if vector is None:
            found[k] = _drive_one(judge, spec, kind)
        elif k not in found:
            group = [i for i, other in enumerate(vectors) if other is vector]
            driven = drive_together(vector, {i: described[i][0] for i in group})
            found |= driven if judge is None else {i: judge(run) for i, run in driven.items()}
    return [found[k] for k in range(len(described))]


def _drive_one(
    judge: Callable[[Run], Any] | None, spec: RunSpec, kind: type[Stack] | None = None
) -> Any:
    """Drives a run and returns it, or what `judge` makes of it. kind: the stack's class, if it is loaded."""
    driven = run(spec, kind)
    return driven if judge is None else judge(driven)
