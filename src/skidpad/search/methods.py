"""How a search chooses its next points: each method is asked for a batch, then told what came of it.

A method sees the unit cube and the margins only. The same seed and the same answers give the same
points, so that a search can go on where it was left.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from scipy.stats import qmc

from skidpad.core.arrays import Floats
from skidpad.core.errors import MissingExtra

if TYPE_CHECKING:
    from cmaes import CMA

BATCH = 16  # points that are driven side by side; it never depends on the number of workers
EXPLORED = 0.2  # share of the budget that `cma` spends on spreading out before it descends
SIGMA = 0.15  # of a descent's first population, in the unit cube
APART = 0.2  # distance in the unit cube of a new descent's start from earlier ones
FOUND = 0.5  # share of failures in a population from which on a descent has done its work


class Method(Protocol):
    """One way to choose the next points of a search."""

    def ask(self, count: int) -> Floats:
        """Return the next points, (count, d), each in [0, 1]."""
        ...

    def tell(self, points: Floats, margins: Floats) -> None:
        """Takes in what became of the points that were asked for: margins (count,), in their order."""
        ...


class Random:
    """Independent points, as likely as the distributions say."""

    def __init__(self, dimensions: int, seed: int, budget: int) -> None:
        del budget
        self.rng, self.d = np.random.default_rng(seed), dimensions

    def ask(self, count: int) -> Floats:
        """Return points that are independent and uniform."""
        return self.rng.random((count, self.d))

    def tell(self, points: Floats, margins: Floats) -> None:
        """Learns nothing: points do not depend on margins."""


class Halton:
    """Scrambled Halton points: they spread more evenly than random ones (scipy.stats.qmc)."""

    def __init__(self, dimensions: int, seed: int, budget: int) -> None:
        del budget
        # scipy below 1.15 knows this keyword only; newer ones take it as well
        rng = np.random.default_rng(seed)
        self.sequence = qmc.Halton(dimensions, scramble=True, seed=rng)

    def ask(self, count: int) -> Floats:
        """Return the next points of the sequence."""
        return np.asarray(self.sequence.random(count))

    def tell(self, points: Floats, margins: Floats) -> None:
        """Learns nothing: points do not depend on margins."""


class Descents:
    """Halton points first, then CMA-ES from the best of them, again and again (Hansen 2016).

    A descent ends when half of a population fails, or when CMA-ES says that it is stuck; the next one
    starts from the best point that lies apart from all earlier starts, so that it can find another
    kind of failure.
    """

    def __init__(self, dimensions: int, seed: int, budget: int) -> None:
        self.d, self.seed = dimensions, seed
        self.halton = Halton(dimensions, seed, budget)
        self.spread = max(round(EXPLORED * budget), 2 * BATCH)  # points before the first descent
        self.seen: list[tuple[float, tuple[float, ...]]] = []
        self.starts: list[Floats] = []
        self.descent: CMA | None = None

    def ask(self, count: int) -> Floats:
        """Returns the next points: those of the spread-out sequence first, later those of the descents."""
        if len(self.seen) < self.spread:
            return self.halton.ask(count)
        if self.descent is None:
            self.descent = self._start(count)
        return np.array([self.descent.ask() for _ in range(count)])

    def tell(self, points: Floats, margins: Floats) -> None:
        """Lets the descent learn; ends it when half of the points fail or it is stuck."""
        self.seen += [(float(m), tuple(p)) for m, p in zip(margins, points.tolist(), strict=True)]
        if self.descent is None:
            return
        if len(points) == self.descent.population_size:
            self.descent.tell(list(zip(points, margins.tolist(), strict=True)))
        if np.mean(margins <= 0.0) >= FOUND or self.descent.should_stop():
            self.descent = None

    def _start(self, count: int) -> CMA:
        """Returns a new CMA-ES search from the best point that is apart from all earlier starts.

        From a point of the sequence where none is. count: points of each of its populations.
        """
        from cmaes import CMA

        ordered = (np.array(p) for _, p in sorted(self.seen))
        apart = (p for p in ordered if all(np.linalg.norm(p - s) >= APART for s in self.starts))
        start = next(apart, None)
        if start is None:  # everywhere was begun already
            start = self.halton.ask(1)[0]
        self.starts.append(start)
        bounds = np.tile([0.0, 1.0], (self.d, 1))
        return CMA(
            mean=np.clip(start, 0.01, 0.99), sigma=SIGMA, bounds=bounds,
            seed=self.seed + len(self.starts), population_size=count,
        )  # fmt: skip


class Parzen:
    """Tree-structured Parzen estimators of Optuna (Bergstra et al. 2011); needs extra `search`."""

    def __init__(self, dimensions: int, seed: int, budget: int) -> None:
        del budget
        try:
            import optuna
        except ImportError:
            raise MissingExtra("--method tpe", "search") from None
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        sampler = optuna.samplers.TPESampler(seed=seed, constant_liar=True, multivariate=True)
        self.study = optuna.create_study(sampler=sampler)
        unit = optuna.distributions.FloatDistribution(0.0, 1.0)
        self.laws: dict[str, Any] = {f"x{k}": unit for k in range(dimensions)}
        self.open: list[Any] = []

    def ask(self, count: int) -> Floats:
        """Return points that lie where low margins were."""
        self.open = [self.study.ask(self.laws) for _ in range(count)]
        return np.array([[t.params[name] for name in self.laws] for t in self.open])

    def tell(self, points: Floats, margins: Floats) -> None:
        """Let the estimators learn from the margins."""
        del points  # each belongs to an open trial
        for trial, margin in zip(self.open, margins.tolist(), strict=True):
            self.study.tell(trial, margin)


METHODS: Mapping[str, Callable[[int, int, int], Method]] = {
    "cma": Descents,
    "tpe": Parzen,
    "halton": Halton,
    "random": Random,
}


def make_method(name: str, dimensions: int, seed: int, budget: int) -> Method:
    """Returns a method by its name, at its beginning.

    Args:
        name: of METHODS.
        dimensions: of the space.
        seed: the same one gives the same points.
        budget: runs that it will be asked for in all.

    Raises:
        MissingExtra: `tpe` without the extra `search`.
    """
    return METHODS[name](dimensions, seed, budget)


def batch_sizes(budget: int) -> Sequence[int]:
    """Return the sizes of the batches that make up a budget."""
    whole, rest = divmod(budget, BATCH)
    return [BATCH] * whole + ([rest] if rest else [])
