"""How many runs each method needs to a first avoidable failure, and how many distinct ones it finds.

    python tools/search_benchmark.py drive --out out/benchmark --seeds 30 [--verifai VENV/bin/python]
    python tools/search_benchmark.py table --out out/benchmark

`drive` goes seed by seed through all cells, stacks and methods, a race at a time in each of --workers
processes, and goes on where it was left. VerifAI runs in an environment of its own (`pip install
verifai`), told margins over a pipe. Cost is simulated seconds in units of the longest run, replays with
the reference driver included. The share of failures is that of the random runs of all seeds. Distinct
failures differ in kind, or lie in another tenth of a variable's range.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import structs
from scipy.stats import binomtest
from typer.testing import CliRunner

from skidpad.campaign.workers.worker import Finished, Job
from skidpad.cli.main import app
from skidpad.core.arrays import Floats
from skidpad.core.errors import OutputError
from skidpad.core.maths.space import Choice, Space
from skidpad.recording.campaign.searches import Search, Trial, read_search, read_trials
from skidpad.search import methods
from skidpad.search.loop import search, write_search

RUNS = 1000  # of a race
TENTHS = 10
WITHIN = (1e-4, 1e-3)  # share of failures of random runs that a cell should have
STACKS = {"ours": "4", "envelope": "5", "follow_lane": "examples/follow_lane.py:FollowLane"}
OWN = ("cma", "halton", "random")
VERIFAI = ("verifai-ce", "verifai-mab", "verifai-halton")
SAMPLERS = {"ce": "crossEntropy", "mab": "multiArmedBandit", "halton": "halton"}
SERVER = """
import json, random, sys
import numpy as np
from verifai.features import Box, Feature, FeatureSpace
from verifai.samplers import FeatureSampler
name, d, seed = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
random.seed(seed); np.random.seed(seed)
space = FeatureSpace({"x": Feature(Box(*[[0.0, 1.0]] * d))})
parameters = {}
if name == "halton":  # its points are the same for every seed but for where it begins
    from dotmap import DotMap
    parameters = {"halton_params": DotMap(sample_index=1000 * seed, bases_skipped=0)}
sampler = getattr(FeatureSampler, name + "SamplerFor")(space, **parameters)
for line in sys.stdin:
    asked = json.loads(line)
    if isinstance(asked, int):
        held = [sampler.getSample() for _ in range(asked)]
        print(json.dumps([list(map(float, sample.x)) for sample, _ in held]), flush=True)
    else:
        for (sample, info), rho in zip(held, asked):
            sampler.update(sample, info, rho)
"""


@dataclass(frozen=True)
class Cell:
    """A scenario of the catalogue and how its values are drawn."""

    scenario: str
    vary: tuple[str, ...]
    duration: int  # s


CELLS = {
    "cut-in": Cell(
        "ghost_cut_in",
        ("GhostS=normal(40,8,10:80)", "GhostSpeed=normal(20,2,12:28)",
         "MergeDistance=normal(4,1,0.5:9)", "MergeTime=normal(3.1,0.35,0.8:5)"),
        16,
    ),
    "slowdown": Cell(
        "lead_slowdown",
        ("TriggerDistance=normal(40,8,8:80)", "Deceleration=normal(4,1.2,1:9)",
         "LeadSpeed=normal(20,0.75,10:26)", "weather.ice_thickness=0:10"),
        20,
    ),
    "accident": Cell(
        "front_accident",
        ("TriggerDistance=normal(45,8,8:90)", "SwerveTime=normal(1.5,0.4,0.4:4)",
         "SecondDeceleration=normal(5,1.2,1:9)", "LeadSpeed=normal(19,0.38,10:26)",
         "weather.ice_thickness=0:10"),
        20,
    ),
}  # fmt: skip


class Sampler:
    """A sampler of VerifAI as a method of the search."""

    def __init__(self, python: str, name: str, dimensions: int, seed: int, budget: int) -> None:
        """python: of the environment that has VerifAI. name: of SAMPLERS."""
        del budget
        call = [python, "-W", "ignore", "-c", SERVER, SAMPLERS[name], str(dimensions), str(seed)]
        self.process = subprocess.Popen(
            call, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def _say(self, what: Any) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(what) + "\n")
        self.process.stdin.flush()

    def ask(self, count: int) -> Floats:
        """Return the next points of the sampler."""
        assert self.process.stdout is not None
        self._say(count)
        line = self.process.stdout.readline()
        if not line:
            raise OutputError("the process with VerifAI ended; its message is above")
        return np.array(json.loads(line))

    def tell(self, points: Floats, margins: Floats) -> None:
        """Tell the sampler its margins, in which a failure is below 0."""
        del points
        self._say([float(m) if m > 0.0 else float(m) - 1e-6 for m in margins])


def run_here(jobs: Iterable[Job]) -> Iterator[Finished]:
    """Do jobs one after the other in this process."""
    for job in jobs:
        yield Finished(job, job.work(job.argument))


def template_of(out: Path, cell: str, stack: str) -> Search:
    """Return the search of a cell with a stack as the command writes it; its one run is not used."""
    folder = out / "templates" / f"{cell}-{stack}"
    of = CELLS[cell]
    call = ["search", of.scenario, "--stack", STACKS[stack], "--budget", "1", "--workers", "1"]
    call += ["--duration", str(of.duration), "--out", str(folder), "--method", "random"]
    for text in of.vary:
        call += ["--vary", text]
    if not (folder / "found.json").is_file():
        CliRunner().invoke(app, [*call, "--resume"], catch_exceptions=False)
    return read_search(folder)


def cost_of(trial: Trial, cell: str) -> float:
    """Return the simulated seconds of a trial and its replay, in units of the longest run."""
    replay = 0.0 if trial.reference is None else trial.reference.simulated_s
    return (trial.simulated_s + replay) / CELLS[cell].duration


def race(
    out: Path, cell: str, stack: str, method: str, seed: int, until: float, *, first: bool
) -> bool:
    """Drive one method to the end of the budget; returns whether there was time for it.

    first: end at the first avoidable failure, so that distinct ones are not counted.
    """
    found = structs.replace(
        template_of(out, cell, stack), method=method, seed=seed, budget=RUNS, objective="combined"
    )
    folder = out / "races" / f"{cell}-{stack}-{method}-{seed:03d}"
    known = write_search(folder, found, resume=True)
    if is_over(known, cell) or (first and any(t.is_avoidable for t in known)):
        return True
    spent = 0.0
    if time.time() > until:
        return False
    for trial in search(found, folder, run_here, known):
        spent += cost_of(trial, cell)
        if spent >= RUNS or (first and trial.is_avoidable):
            break
        if time.time() > until:
            return False
    return True


def is_over(trials: Sequence[Trial], cell: str) -> bool:
    """Return whether a race has spent its budget."""
    return len(trials) >= RUNS or sum(cost_of(t, cell) for t in trials) >= RUNS


def within_budget(trials: Sequence[Trial], cell: str) -> list[Trial]:
    """Return the trials that the budget pays for."""
    spent = np.cumsum([cost_of(t, cell) for t in trials])
    return [t for t, s in zip(trials, spent, strict=True) if s <= RUNS]


def first_cost(trials: Sequence[Trial], cell: str) -> float | None:
    """Return the cost up to the first avoidable failure, with its own; None where there is none."""
    spent = 0.0
    for trial in trials:
        spent += cost_of(trial, cell)
        if trial.is_avoidable:
            return spent
    return None


def count_distinct(trials: Iterable[Trial], space: Space) -> int:
    """Return how many avoidable failures differ in kind, or by a tenth of a variable's range."""
    return len({(t.kind, *_tenths(t, space)) for t in trials if t.is_avoidable})


def _tenths(trial: Trial, space: Space) -> Iterator[int | str]:
    for variable in space.variables:
        value = trial.values[variable.name]
        if isinstance(variable.law, Choice) or isinstance(value, str):
            yield str(value)
        else:
            low, high = variable.law.range
            yield min(int(TENTHS * (value - low) / (high - low)), TENTHS - 1)


def median_text(costs: Sequence[float | None]) -> str:
    """Return the median with its 95 % interval by order statistics; ">" where it was not reached."""
    ordered = sorted(np.inf if c is None else c for c in costs)
    n = len(ordered)
    k = next((j for j in range(n // 2, 0, -1) if binomtest(j - 1, n).pvalue < 0.05), None)
    ends = [ordered[k - 1], ordered[n - k]] if k else [0.0, np.inf]
    low, middle, high = (
        f"{v:.0f}" if np.isfinite(v) else f"above {RUNS}"
        for v in (ends[0], np.median(ordered), ends[1])
    )
    return f"{middle} ({low} to {high})" if k else f"{middle} (too few for an interval)"


def table(out: Path) -> str:
    """Return what all races came to as a table of a page."""
    heads = ("cell", "stack", "share of failures, random", "method", "seeds",
             "runs to first failure", f"distinct failures in {RUNS}")  # fmt: skip
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for cell in CELLS:
        for stack in STACKS:
            drawn = [
                t
                for folder in sorted(out.glob(f"races/{cell}-{stack}-random-*"))
                for t in read_trials(folder)
            ]
            share = share_text(drawn)
            for method in (*OWN, *VERIFAI):
                row = _row(out, cell, stack, method)
                if row is not None:
                    said = share if method == "random" else ""
                    lines.append(f"| {cell} | {stack} | {said} | {method} | {row} |")
    return "\n".join(lines)


def share_text(trials: Sequence[Trial]) -> str:
    """Return the share of avoidable failures with its exact 95 % interval."""
    if not trials:
        return "not measured"
    bad = sum(t.is_avoidable for t in trials)
    ends = binomtest(bad, len(trials)).proportion_ci(0.95, "exact")
    low, high = WITHIN
    is_inside, is_outside = (
        low <= ends.low and ends.high <= high,
        ends.low > high or ends.high < low,
    )
    judged = "within" if is_inside else "outside of" if is_outside else "not yet known to be within"
    return (
        f"{bad} of {len(trials)} ({ends.low:.1e} to {ends.high:.1e}), {judged} {low:g} to {high:g}"
    )


def _row(out: Path, cell: str, stack: str, method: str) -> str | None:
    firsts: list[float | None] = []
    counts = []
    for folder in sorted(out.glob(f"races/{cell}-{stack}-{method}-[0-9]*")):
        trials = read_trials(folder)
        paid = within_budget(trials, cell)
        over, cost = is_over(trials, cell), first_cost(paid, cell)
        if over or cost is not None:
            firsts.append(cost)
        if over:
            counts.append(count_distinct(paid, read_search(folder).space))
    if not firsts:
        return None
    distinct = f"{np.median(counts):g}, of {len(counts)}" if counts else "not counted"
    return f"{len(firsts)} | {median_text(firsts)} | {distinct}"


def with_verifai(python: str) -> None:
    """Makes VerifAI's samplers methods of the search in this process; "": does nothing."""
    if not python:
        return
    own = {m: partial(Sampler, python, m.partition("-")[2]) for m in VERIFAI}
    methods.METHODS = {**methods.METHODS, **own}


def drive(asked: argparse.Namespace) -> None:
    """Drive all races that fit, seed by seed, each in one of the worker processes."""
    names = [m for m in (*OWN, *(VERIFAI if asked.verifai else ())) if m in asked.methods]
    pairs = [(cell, stack) for cell in asked.cells for stack in asked.stacks]
    for cell, stack in pairs:
        template_of(asked.out, cell, stack)
    with ProcessPoolExecutor(
        asked.workers, initializer=with_verifai, initargs=(asked.verifai,)
    ) as pool:
        going = {}
        for seed in range(1, asked.seeds + 1):
            for cell, stack in pairs:
                for method in names:
                    one = pool.submit(
                        race, asked.out, cell, stack, method, seed, asked.until, first=asked.first
                    )
                    going[one] = f"{cell} {stack} {method} {seed}"
        for one in as_completed(going):
            print(going[one] if one.result() else f"no time for {going[one]}", flush=True)


def main() -> None:
    """Drive races, or print their table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["drive", "table"])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--cells", nargs="+", choices=list(CELLS), default=list(CELLS))
    parser.add_argument("--stacks", nargs="+", choices=list(STACKS), default=list(STACKS))
    parser.add_argument("--methods", nargs="+", choices=OWN + VERIFAI, default=OWN + VERIFAI)
    parser.add_argument("--verifai", default="", help="python of an environment with VerifAI")
    parser.add_argument("--first", action="store_true", help="end at the first avoidable failure")
    parser.add_argument("--hours", type=float, default=24.0, help="after which no run begins")
    parser.add_argument("--workers", type=int, default=1)
    asked = parser.parse_args()
    asked.until = time.time() + 3600.0 * asked.hours
    if asked.what == "drive":
        with suppress(KeyboardInterrupt):
            drive(asked)
    else:
        print(table(asked.out))


if __name__ == "__main__":
    main()
