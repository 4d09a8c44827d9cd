"""The one campaign: runs in front, a ledger behind, results at the end.

A `Recipe` says what is particular to a kind of campaign. Everything else stands here: what the
ledger has is not driven again, what crashed is retried, cells stop when enough is known.
"""

from __future__ import annotations

import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Generic

import msgspec

from skidpad.campaign.recipes.recipe import Driven, M, Recipe, T, Task, cell_of
from skidpad.campaign.user_files import keep_files
from skidpad.campaign.workers.worker import Finished, Job, Runner
from skidpad.core.errors import ConfigError, StackError, require_range
from skidpad.core.text.wording import count_text
from skidpad.core.vocabulary import Outcome
from skidpad.evidence.statistics import clopper_pearson
from skidpad.recording.campaign.ledger import (
    DAMAGED,
    LEDGER,
    RETRIED,
    Entry,
    K,
    Ledger,
    fingerprints,
    latest,
)
from skidpad.recording.campaign.results import Timing
from skidpad.recording.fingerprint import fingerprint

BATCH = 20  # runs per cell after which a stopping rule looks again (decision G-8)
PROBES = 12  # runs that an estimate drives, spread over the campaign
PROBING_S = 60.0  # CPU time after which it drives no further one


@dataclass(frozen=True, slots=True)
class Summary:
    """What a campaign came to."""

    folder: Path
    runs: int
    driven: int  # in this call; the others were in the ledger
    failed: int  # crashed or timed out
    content_hash: str
    mixed_machines: bool  # byte equality is not promised across this campaign
    error: str = ""  # what the first of the failed runs said
    damaged: int = 0  # lines of the ledger that were set aside; their runs were driven again

    def warnings(self) -> Iterator[str]:
        """Yields the sentences that a reader of the report should know first: damage, machines, failures."""
        if self.damaged:
            lines = count_text(self.damaged, "damaged line")
            yield f"set aside from {LEDGER} into {DAMAGED}: {lines}; what they told of was driven again"
        if self.mixed_machines:
            yield "runs of different machines or versions: bytes may differ"
        if self.failed:
            runs = "1 run" if self.failed == 1 else f"{self.failed} runs"
            said = f" ({self.error})" if self.error else ""
            yield f"{runs} crashed or timed out{said}; --resume tries again"


@dataclass(frozen=True, slots=True)
class Estimate:
    """How long a campaign takes, from a sample of its runs; compilation apart."""

    runs: int
    probes: int
    cpu_s: float  # per run

    def minutes(self, workers: int) -> float:
        """Returns the wall time in min on so many workers."""
        return self.cpu_s * self.runs / workers / 60.0


@dataclass(frozen=True, slots=True)
class Campaign(Generic[T, K, M]):
    """Holds the runs of one kind and how each is driven.

    alone: they need a simulator that drives one run at a time.
    distinct: where the first runs of cells moved alike, drive the further runs of one cell only.
    until_halfwidth: leave a cell once its share of successes is known to +- this.
    files: what the folder keeps of the user's own, by its name there.
    """

    recipe: Recipe[T, K, M]
    tasks: Sequence[T]
    alone: bool = False
    until_halfwidth: float | None = None
    distinct: bool = False
    files: Mapping[str, Path] = field(default_factory=dict)

    def __post_init__(self) -> None:
        twice = [name for name, n in Counter(t.name for t in self.tasks).items() if n > 1]
        if twice:
            raise ConfigError(f"two runs have the same name: {twice[0]}")
        if self.until_halfwidth is not None:
            require_range("--until-halfwidth", self.until_halfwidth, 0.001, 0.5)
            if self.distinct:
                raise ConfigError("--distinct and --until-halfwidth exclude each other; pass one")

    def identity(self) -> dict[str, Any]:
        """Returns the resolved configuration, without workers and paths (decision M-18).

        What all runs have in common, what varies, and a hash over every run.
        """
        plain = [t.to_identity() for t in self.tasks]
        names = sorted({name for p in plain for name in p})
        values = {
            name: list({_text(p.get(name)): p.get(name) for p in plain}.values()) for name in names
        }
        return {
            "command": self.recipe.command,
            "runs": len(plain),
            "common": {name: only[0] for name, only in values.items() if len(only) == 1},
            "varied": {name: several for name, several in values.items() if len(several) > 1},
            "hash": sha256(b"\n".join(map(_text, plain))).hexdigest(),
        }

    def batches(self) -> list[list[T]]:
        """Returns the tasks in batches, after each of which a stopping rule looks; one batch without a rule.

        distinct: first runs of all cells, then the rest. until_halfwidth: BATCH runs per cell each.
        """
        if self.distinct:
            firsts = list({cell_of(t.name): t for t in reversed(self.tasks)}.values())[::-1]
            names = {t.name for t in firsts}
            return [firsts, [t for t in self.tasks if t.name not in names]]
        if self.until_halfwidth is None:
            return [list(self.tasks)]
        batches: list[list[T]] = []
        seen: Counter[str] = Counter()
        for task in self.tasks:
            number = seen[cell_of(task.name)] // BATCH
            seen[cell_of(task.name)] += 1
            if number == len(batches):
                batches.append([])
            batches[number].append(task)
        return batches

    def run(
        self,
        out: Path,
        runner: Runner,
        *,
        resume: bool = False,
        csv: bool = False,
        on_run: Callable[[Entry[K, M]], None] = lambda _: None,
        on_total: Callable[[int], None] = lambda _: None,
    ) -> Summary:
        """Drives what the ledger does not have yet, then writes the results; returns a summary.

        on_run: called with each run that is done, first with those in the ledger.
        on_total: called with the number of runs, when fewer are left than were planned.
        OutputError when `out` holds something else, or this campaign and `resume` is false.
        """
        driven, earlier = 0, set[str]()
        with Ledger(out, self.recipe.entry, self.identity(), resume) as ledger:
            keep_files(out, self.files)
            done = ledger.completed_runs()
            for entry in latest(ledger.entries):
                if entry.run in done:
                    on_run(entry)
            batches = self.batches()
            for k, batch in enumerate(batches):
                wanted = self._uncertain_runs(
                    batch, [e for e in latest(ledger.entries) if e.run in earlier]
                )
                on_total(len(earlier) + len(wanted) + sum(map(len, batches[k + 1 :])))
                todo = {t.name: t for t in wanted if t.name not in done}
                for entry in self._drive(todo, out, runner):
                    ledger.append(entry)
                    on_run(entry)
                driven += len(todo)
                earlier |= {t.name for t in wanted}
            entries = latest(ledger.entries)
        rows, timing = [(e.key, e.metrics) for e in entries], [e.timing for e in entries]
        places = [e.fingerprint for e in entries]
        added = [e.added for e in entries]
        digest = self.recipe.columns.write(
            out, rows, timing, csv=csv, fingerprints=places, added=added
        )
        self.recipe.finish(self.tasks, out, runner)
        failed = [e for e in entries if Outcome(e.key.outcome) in RETRIED]
        error = failed[0].error if failed else ""
        mixed = len(fingerprints(entries)) > 1
        return Summary(
            out, len(entries), driven, len(failed), digest, mixed, error, len(ledger.damaged)
        )

    def _uncertain_runs(self, batch: Sequence[T], entries: Sequence[Entry[K, M]]) -> Sequence[T]:
        """Returns the runs of a batch whose cells are still uncertain, or distinct, by the entries so far.

        All of it without a rule or entries.
        """
        if self.distinct and entries:
            cells = distinct_cells(self.batches()[0], entries, self.recipe.drive_of)
            return [t for t in batch if cell_of(t.name) in cells]
        if self.until_halfwidth is None or not entries:
            return batch
        trials = [(cell_of(e.run), self.success(e)) for e in entries]
        still = uncertain_cells(trials, self.until_halfwidth)
        return [t for t in batch if cell_of(t.name) in still]

    def _drive(self, tasks: dict[str, T], out: Path, runner: Runner) -> Iterator[Entry[K, M]]:
        """Drives the tasks by the runner and yields an entry of the ledger as each run ends."""
        here = fingerprint().short
        work = partial(self.recipe.drive, out)
        for finished in runner([Job(t.name, work, t, t.deadline_s) for t in tasks.values()]):
            driven = self._drive_task(tasks[finished.job.key], finished)
            yield Entry(
                run=finished.job.key,
                key=driven.key,
                metrics=driven.metrics,
                timing=driven.timing,
                fingerprint=here,
                attempts=finished.attempts,
                error=driven.error,
                added=driven.added,
            )

    def _drive_task(self, task: T, finished: Finished) -> Driven[K, M | None]:
        """Returns what a task's run gave; of one that failed, its key and error without metrics."""
        if finished.failure is None:
            driven: Driven[K, M | None] = finished.value
            return driven
        return Driven(
            key=self.recipe.key(task, finished.failure),
            metrics=None,
            timing=Timing(wall_s=finished.wall_s),
            error=finished.detail.strip(),
        )

    def success(self, entry: Entry[K, M]) -> bool | None:
        """Returns True when a run went well by its recipe, None where it does not count."""
        return None if entry.metrics is None else self.recipe.success(entry.metrics)

    def plan(self) -> Iterator[tuple[str, int, str | StackError]]:
        """Yields each cell, how many runs it has, and why its first one is driven tick by tick.

        "" where it has a quick way, the error of a stack that cannot begin. Worlds are built, and
        nothing is driven.
        """
        firsts = {cell_of(t.name): t for t in reversed(self.tasks)}
        with TemporaryDirectory() as folder:
            keep_files(Path(folder), self.files)
            for cell, runs in Counter(cell_of(t.name) for t in self.tasks).items():
                try:
                    yield cell, runs, self.recipe.why_not_quick(Path(folder), firsts[cell])
                except StackError as error:
                    yield cell, runs, error

    def estimate(self) -> Estimate:
        """Drives up to PROBES runs in this process, for PROBING_S s; returns the CPU time per run."""
        sample = self.tasks[:: max(len(self.tasks) // PROBES, 1)][:PROBES]
        self.recipe.warm_up()
        probes, began, spent = 0, time.process_time(), 0.0
        with TemporaryDirectory() as folder:
            keep_files(Path(folder), self.files)
            for task in sample:
                self.recipe.drive(Path(folder), task)
                probes, spent = probes + 1, time.process_time() - began
                if spent > PROBING_S:
                    break
        return Estimate(len(self.tasks), probes, spent / probes)


def uncertain_cells(trials: Iterable[tuple[str, bool | None]], halfwidth: float) -> set[str]:
    """Returns the cells whose 95 % interval of success is wider than +- halfwidth; trials: (cell, success).

    A success of None is not counted.
    """
    runs: dict[str, list[bool]] = defaultdict(list)
    for cell, success in trials:
        if success is not None:
            runs[cell].append(success)
    bounds = {cell: clopper_pearson(sum(s), len(s)) for cell, s in runs.items()}
    return {cell for cell, (low, high) in bounds.items() if (high - low) / 2.0 > halfwidth}


def distinct_cells(
    firsts: Iterable[Task], entries: Iterable[Entry[K, M]], drive_of: Callable[[K], object]
) -> set[str]:
    """Returns the cells whose first run moved as no other before; one without an entry is distinct."""
    by_run = {e.run: e for e in entries}
    seen: set[object] = set()
    found = set()
    for task in firsts:
        drive = drive_of(by_run[task.name].key) if task.name in by_run else None
        if drive is None or drive not in seen:
            found.add(cell_of(task.name))
        seen.add(drive)
    return found


def _text(plain: Any) -> bytes:
    """Returns plain data as JSON bytes, keys in a fixed order."""
    return msgspec.json.encode(plain, order="deterministic")
