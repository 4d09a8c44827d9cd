"""The probability of a failure per encounter: runs behind the methods of `search.probability`."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from math import isfinite
from pathlib import Path

import msgspec
import numpy as np
from scipy.special import ndtr

from skidpad.campaign.workers.worker import Job, Runner
from skidpad.core.arrays import Floats
from skidpad.core.errors import BackendError
from skidpad.core.maths.space import Choice, Variable
from skidpad.recording.campaign.risks import (
    RISK_FOUND,
    RISK_RUNS,
    SCALES,
    SPLITTING,
    Influence,
    Probability,
    Repetition,
    Risk,
    RiskFound,
    read_repetitions,
)
from skidpad.recording.campaign.searches import Trial
from skidpad.recording.files import write_bytes, write_json
from skidpad.search.branching import SplitTask, split_drives
from skidpad.search.loop import StoredTrials, drive_all
from skidpad.search.probability import (
    Estimate,
    Weighted,
    compare_estimates,
    counting_estimate,
    explore,
    importance_estimate,
    joint_interval,
    sample_mixture,
    subset_estimate,
)
from skidpad.search.splitting import METHOD as SPLITTING_METHOD
from skidpad.search.splitting import splitting_estimate
from skidpad.search.trial import Point, unit_tuple

OBJECTIVE = "combined"
LEAST_EFFECTIVE = 30.0  # failures of equal weight below which a changed input is not judged
OUTSIDE = 0.01  # share of a changed input that may lie where none was drawn
SPLIT_DEADLINE_S = 7 * 86_400.0  # of one repetition of splitting
ENOUGH = 100  # counted failures from which on counting alone determines the result: +-20 %


class LimitOfRuns:
    """The margin of runs as a limit: drives what is not known yet, and keeps every run on disk."""

    def __init__(
        self, asked: Risk, out: Path, runner: Runner, known: Sequence[Trial],
        on_run: Callable[[int], None],
    ) -> None:  # fmt: skip
        """known: runs of an earlier stretch, in order. on_run: is called with the runs so far."""
        self.asked, self.on_run, self.template = asked, on_run, asked.template
        self.stored = StoredTrials(out / RISK_RUNS, known, partial(drive_all, runner=runner))
        self.trials: list[Trial] = []

    def __call__(self, z: Floats) -> Floats:
        """Returns the margins of samples (n, d) in their order; drives those that are not stored."""
        first = len(self.trials)
        self.trials += self.stored.drive([
            Point(self.template, self.asked.space, first + k, unit_tuple(u), OBJECTIVE)
            for k, u in enumerate(ndtr(z))
        ])  # fmt: skip
        self.on_run(len(self.trials))
        return np.array([t.margin for t in self.trials[first:]])

    def simulated_s(self, first: int, last: int | None = None) -> float:
        """Returns the simulated seconds of the runs from number `first` up to, without, `last`."""
        return sum(t.simulated_s for t in self.trials[first:last])


def estimate_risk(
    asked: Risk, out: Path, runner: Runner, known: Sequence[Trial], on_run: Callable[[int], None]
) -> RiskFound:
    """Drives everything that the question needs, writes what came of it and returns it.

    on_run: called with the runs so far after each batch.
    """
    limit = LimitOfRuns(asked, out, runner, known, on_run)
    rng = np.random.default_rng(asked.seed)
    found = explore(limit, len(asked.space.variables), rng, asked.repetitions, asked.per_level)
    explored, first = len(limit.trials), len(found.first)
    counted, subset = counting_estimate(found.first), subset_estimate(found)
    repetitions: tuple[Repetition, ...] = ()
    if asked.disturbed_actors:
        repetitions = split_all(asked, out, runner, lambda runs: on_run(explored + runs))
        samples, trials = _independent(found.first), limit.trials[:first]
        answer = answer_by_splitting(counted, subset, repetitions)
    elif counted.p * first >= ENOUGH:
        samples, trials = _independent(found.first), limit.trials[:first]
        answer = Answer(counted.p, counted.low, counted.high, "", (counted,))
    elif len(found.failing):
        samples = sample_mixture(limit, found.failing, rng, asked.samples)
        weighted = importance_estimate(samples, explored)
        ends = joint_interval(weighted, subset)
        why_not = compare_estimates(weighted, subset).why_not
        answer = Answer(weighted.p, *ends, why_not, (counted, subset, weighted))
        trials = limit.trials[explored:]
    else:
        samples, trials = Weighted(np.empty((0, 0)), np.empty(0), np.empty(0)), []
        answer = Answer(0.0, 0.0, counted.high, "no failure was reached", (counted, subset))
    seconds = {
        counted.method: limit.simulated_s(0, first),
        subset.method: limit.simulated_s(0, explored),
        SPLITTING_METHOD: sum(r.simulated_s for r in repetitions),
    }
    result = RiskFound(
        probabilities=tuple(
            _plain(e, seconds.get(e.method, limit.simulated_s(0))) for e in answer.estimates
        ),
        p=answer.p,
        low=answer.low,
        high=_end(answer.high),
        why_not=answer.why_not,
        levels=tuple(found.chains[0].levels),
        ancestors=tuple(c.ancestors for c in found.chains),
        effective=samples.effective,
        kinds=_kinds_of_splits(repetitions) if repetitions else _kinds(trials, samples),
        influences=tuple(
            influence_of(v, k, trials, samples) for k, v in enumerate(asked.space.variables)
        ),
        faults=sum(bool(t.fault) for t in limit.trials) + sum(r.faults for r in repetitions),
        splitting=repetitions,
    )
    write_json(out / RISK_FOUND, result)
    return result


@dataclass(frozen=True, slots=True)
class Answer:
    """A probability, its interval, why it is not determined, and the estimates behind it."""

    p: float
    low: float
    high: float
    why_not: str
    estimates: tuple[Estimate, ...]


def split_all(
    asked: Risk, out: Path, runner: Runner, on_run: Callable[[int], None]
) -> tuple[Repetition, ...]:
    """Returns all repetitions of splitting in their order; each is written down once it is driven.

    Raises:
        BackendError: the process that drove a repetition was lost.
    """
    known = {r.number: r for r in read_repetitions(out)}
    write_bytes(out / SPLITTING, msgspec.json.Encoder().encode_lines(list(known.values())))
    missing = [k for k in range(asked.repetitions) if k not in known]
    jobs = [
        Job(f"splitting {k}", split_drives, SplitTask(asked, k), SPLIT_DEADLINE_S) for k in missing
    ]
    for done in runner(jobs):
        if done.failure is not None:
            last = done.detail.strip().rpartition("\n")[2]
            raise BackendError(f"{done.job.key} was lost ({last}); --resume drives it again")
        known[done.value.number] = done.value
        with (out / SPLITTING).open("ab") as file:
            file.write(msgspec.json.Encoder().encode_lines([done.value]))
        on_run(sum(r.runs for r in known.values()))
    return tuple(known[k] for k in range(asked.repetitions))


def answer_by_splitting(
    counted: Estimate, subset: Estimate, repetitions: Sequence[Repetition]
) -> Answer:
    """Returns the answer of splitting beside counting, or beside subset simulation where that has too few."""
    found = splitting_estimate([r.p for r in repetitions], sum(r.runs for r in repetitions))
    every = counted, subset, found
    if found.p == 0.0:
        return Answer(counted.p, counted.low, counted.high, "splitting reached no failure", every)
    other = counted if counted.p * counted.runs >= ENOUGH else subset
    return Answer(
        found.p, *joint_interval(found, other), compare_estimates(found, other).why_not, every
    )


def _independent(margins: Floats) -> Weighted:
    """Returns independent draws by their margins, each with a weight of 1."""
    return Weighted(np.empty((len(margins), 0)), np.ones(len(margins)), margins)


def _kinds_of_splits(repetitions: Sequence[Repetition]) -> dict[str, float]:
    """Returns the share of the probability by kind of failure, the largest first."""
    return _shares(
        (kind, one.p * count / one.failing)
        for one in repetitions
        for kind, count in one.kinds.items()
    )


def _plain(e: Estimate, simulated_s: float) -> Probability:
    """Returns the estimate as a record; an infinite upper limit becomes None."""
    return Probability(
        method=e.method, p=e.p, low=e.low, high=_end(e.high), runs=e.runs, simulated_s=simulated_s
    )


def _end(value: float) -> float | None:
    """Returns the value; None where it is not finite."""
    return value if isfinite(value) else None


def _kinds(trials: Sequence[Trial], samples: Weighted) -> dict[str, float]:
    """Returns the share of the probability by kind of failure, the largest first; {} without a failure."""
    weighed = zip(trials, samples.weights, strict=True)
    return _shares((trial.kind, float(weight)) for trial, weight in weighed if trial.is_failure)


def _shares(weights: Iterable[tuple[str, float]]) -> dict[str, float]:
    """Returns the share of each kind in the sum of all weights, the largest first."""
    shares: dict[str, float] = defaultdict(float)
    for kind, weight in weights:
        shares[kind] += weight
    total = sum(shares.values())
    return {k: v / total for k, v in sorted(shares.items(), key=lambda item: -item[1])}


def influence_of(
    variable: Variable, axis: int, trials: Sequence[Trial], samples: Weighted
) -> Influence:
    """Return what other values of one input do, by weighing the same runs anew.

    The runs cannot tell where changed values lie outside of what was drawn, or where too few failures
    carry the weight.
    """
    law = variable.law
    if isinstance(law, Choice):
        nothing = (None,) * len(SCALES)
        return Influence(name=variable.name, factors=nothing, why_not="a choice has no multiples")
    failing = [(t, w) for t, w in zip(trials, samples.weights, strict=True) if t.is_failure]
    weights = np.array([w for _, w in failing])
    values = [law.value(t.unit[axis]) for t, _ in failing]
    factors: list[float | None] = []
    why_not = ""
    for scale in SCALES:
        changed = law.scale_by(scale)
        low, high = law.range
        outside = changed.share_below(low) + 1.0 - changed.share_below(high)
        anew = weights * [changed.density(v) / law.density(v) for v in values]
        effective = float(anew.sum() ** 2 / (anew**2).sum()) if anew.any() else 0.0
        if outside > OUTSIDE:
            why_not = f"with x {scale:g} {outside:.0%} of the values were never drawn"
        elif effective < LEAST_EFFECTIVE:
            why_not = f"with x {scale:g} only {effective:.0f} failures carry the weight"
        is_known = outside <= OUTSIDE and effective >= LEAST_EFFECTIVE
        factors.append(float(anew.sum() / weights.sum()) if is_known else None)
    return Influence(name=variable.name, factors=tuple(factors), why_not=why_not)
