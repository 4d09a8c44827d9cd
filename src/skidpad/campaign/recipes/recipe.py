"""What a kind of campaign is made of: its runs, how one is driven, what row comes back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from skidpad.campaign.user_files import with_kept_map
from skidpad.campaign.workers.worker import Runner
from skidpad.core.run import RunSpec
from skidpad.core.vocabulary import Outcome
from skidpad.recording.campaign.added_metrics import AddedMetric
from skidpad.recording.campaign.ledger import Entry, K
from skidpad.recording.campaign.results import Columns, Timing


class Task(Protocol):
    """One run of a campaign. Its name is its cell and its number, parted by the last hyphen."""

    @property
    def name(self) -> str:
        """Returns the run's name, CELL-NUMBER, of which the campaign has no other."""
        ...

    @property
    def deadline_s(self) -> float:
        """Returns the wall time in s after which the run counts as hanging."""
        ...

    def to_identity(self) -> dict[str, Any]:
        """Returns everything that decides the run, as plain data."""
        ...


T = TypeVar("T", bound=Task)
M = TypeVar("M")


@dataclass(frozen=True, slots=True, kw_only=True)
class Driven(Generic[K, M]):
    """What a worker says of a run; `error` is the last line of one that the stack made."""

    key: K
    metrics: M
    timing: Timing
    error: str = ""
    added: tuple[AddedMetric, ...] = ()  # by installed packages


def nothing_else(tasks: Sequence[Any], out: Path, runner: Runner) -> None:
    """Does nothing: the `finish` of recipes that leave only results."""
    del tasks, out, runner


def no_drive(key: Any) -> None:
    """Returns None: the `drive_of` of recipes whose runs are never compared in how they moved."""
    del key


def no_quick_way(out: Path, task: Any) -> str:
    """Returns that runs of this kind have no quick way: the `why_not_quick` of most recipes."""
    del out, task
    return "runs of this kind are driven tick by tick"


def find_reason(out: Path, spec: RunSpec) -> str:
    """Returns the first reason against the quick way of a run in the folder of its campaign; "": none."""
    from skidpad.campaign.runs.run import find_reason as find_in

    return find_in(with_kept_map(spec, out))


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe(Generic[T, K, M]):
    """What a kind of campaign is made of. `drive` and `warm_up` are called in workers."""

    command: str  # that wrote the folder; reports go by it
    columns: Columns[K, M]
    entry: type[Entry[K, M]]  # of its ledger
    key: Callable[[T, Outcome], K]  # of a run that crashed or timed out
    drive: Callable[[Path, T], Driven[K, M]]  # a run of the campaign in this folder
    warm_up: Callable[[], None]  # compiles every kernel that a run may need
    success: Callable[[M], bool | None]  # what a stopping rule counts; None: not a trial
    success_means: str  # in words, after a number of runs
    drive_of: Callable[[K], tuple[str, str] | None] = no_drive  # what drove, and how it moved
    why_not_quick: Callable[[Path, T], str] = no_quick_way  # a run of the campaign in this folder
    finish: Callable[[Sequence[T], Path, Runner], None] = nothing_else


def cell_of(run: str) -> str:
    """Returns the cell of a run: its name without the last hyphen and number."""
    return run.rpartition("-")[0]
