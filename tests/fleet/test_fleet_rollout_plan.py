"""The sequential test keeps its promise: how often it errs, however often it looks."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.core.errors import ConfigError
from skidpad.fleet.loop.plan import Decision, Plan, choose_vehicles, look

PLAN = Plan(stages=(0.2, 1.0), least_drives=10, looks=3, margin=0.5)


def outcome(rng: np.random.Generator, mean: float) -> Decision:
    """One roll-out whose drives differ by `mean` errors on average."""
    d: list[float] = []
    for _ in PLAN.stages:
        for left in (2, 1, 0):
            d += (
                rng.poisson(1.0 + max(mean, 0.0), 10) - rng.poisson(1.0 - min(mean, 0.0), 10)
            ).tolist()
            decision = look(d, PLAN, left).decision
            if decision is not Decision.WAIT:
                break
        if decision is Decision.REVERT:
            return decision
    return decision


def test_what_is_worse_by_the_margin_seldom_passes_and_what_is_better_mostly_does():
    rng = np.random.default_rng(5)
    worse = [outcome(rng, PLAN.margin) for _ in range(60)]
    better = [outcome(rng, -0.8) for _ in range(60)]
    assert worse.count(Decision.ADVANCE) <= 6  # 3 expected at alpha 0.05 and worst; 60 draws
    assert better.count(Decision.ADVANCE) >= 54


def test_clear_cases_are_clear_at_the_first_look():
    assert look([-1.0] * 10, PLAN, 2).decision is Decision.ADVANCE
    assert look([0.0] * 10, PLAN, 2).decision is Decision.ADVANCE  # equal is no worse by the margin
    worse = look([1.0] * 10, PLAN, 2)
    assert (worse.decision, worse.mean) == (Decision.REVERT, 1.0)
    assert look([2.0, -2.0] * 5, PLAN, 1).decision is Decision.WAIT
    assert look([2.0, -2.0] * 5, PLAN, 0).decision is Decision.REVERT


def test_a_plan_that_could_never_decide_is_refused():
    for bad in (
        {"stages": (0.5,)}, {"stages": ()}, {"stages": (0.5, 0.4, 1.0)}, {"stages": (0.0, 1.0)},
        {"least_drives": 4}, {"looks": 0}, {"alpha": 0.5}, {"margin": -1.0}, {"margin": float("nan")},
    ):  # fmt: skip
        with pytest.raises(ConfigError):
            Plan(**bad)


def test_stages_hold_the_earlier_ones_and_releases_choose_anew():
    vehicles = [f"{k:032x}" for k in range(4000)]
    for share in (0.1, 0.5):
        on = choose_vehicles("a", vehicles, share)
        assert abs(len(on) / 4000 - share) < 0.04  # fixed hashes, no chance
        assert on <= choose_vehicles("a", vehicles, 0.6)
        assert on != choose_vehicles("b", vehicles, share)
    assert choose_vehicles("a", vehicles, 1.0) == set(vehicles)
    assert len(choose_vehicles("a", vehicles[:3], 1e-9)) == 1
    assert choose_vehicles("a", [], 0.5) == set()
