"""Methods: points within the cube, the same for the same seed, and better than chance where they learn."""

import numpy as np
import pytest

from skidpad.search.methods import BATCH, METHODS, batch_sizes, make_method

CENTRE = np.array([0.82, 0.13, 0.55])


def margins_of(points):
    """A small ball fails: 4/3 pi 0.1^3 is 0.42 % of the cube."""
    return np.linalg.norm(points - CENTRE, axis=1) - 0.1


def drive(name, seed, budget=640):
    method = make_method(name, 3, seed, budget)
    points, margins = [], []
    for size in batch_sizes(budget):
        batch = method.ask(size)
        told = margins_of(batch)
        method.tell(batch, told)
        points.append(batch)
        margins.append(told)
    return np.concatenate(points), np.concatenate(margins)


@pytest.mark.parametrize("name", METHODS)
def test_points_lie_in_the_cube_and_repeat_with_the_seed(name):
    if name == "tpe":
        pytest.importorskip("optuna")
    points, _ = drive(name, 3, 96)
    again, _ = drive(name, 3, 96)
    other, _ = drive(name, 4, 96)
    assert points.shape == (96, 3)
    assert ((points >= 0.0) & (points <= 1.0)).all()
    assert np.array_equal(points, again)
    assert not np.array_equal(points, other)


def test_descents_find_a_small_region_sooner_than_chance():
    """Median run of the first failure over 15 seeds; chance needs about 165 runs in the median."""
    first = {
        name: np.median([np.argmax(np.append(drive(name, s)[1], -1.0) <= 0.0) for s in range(15)])
        for name in ("cma", "random")
    }
    assert first["cma"] < first["random"], first
    found = {name: np.mean([(drive(name, s)[1] <= 0.0).sum() for s in range(5)]) for name in first}
    assert found["cma"] > 10.0 * found["random"], found


def test_batches_make_up_the_budget():
    assert batch_sizes(40) == [BATCH, BATCH, 8]
    assert batch_sizes(32) == [BATCH, BATCH]


def test_a_crash_that_the_reference_driver_has_too_is_no_place_to_look():
    from skidpad.recording.campaign.searches import Trial
    from skidpad.search.loop import _told_margin

    hit = Trial(number=0, unit=(0.5,), values={}, margin=-1.0, contact_kmh=30.0, other="lead")
    clean = Trial(number=0, unit=(0.5,), values={}, margin=1.5)
    assert _told_margin(Trial(**{**_fields(hit), "reference": clean})) == -1.0
    assert _told_margin(Trial(**{**_fields(hit), "reference": hit})) == 2.0
    assert _told_margin(clean) == 1.5


def _fields(trial):
    return {name: getattr(trial, name) for name in trial.__struct_fields__}


def test_what_cannot_be_driven_is_no_harmless_neighbour():
    """Halving stops where neither side of the border is known; before, such a run counted as harmless."""
    from skidpad.core.courses import Scenario
    from skidpad.core.maths.space import Space, Uniform, Variable
    from skidpad.core.run import RunSpec
    from skidpad.recording.campaign.searches import Group, Search, Trial
    from skidpad.search import failures

    space = Space((Variable("x", Uniform(0.0, 1.0)),))
    search = Search(
        run=RunSpec(course=Scenario(file="lead_slowdown")).to_plain(), space=space, method="cma",
        objective="combined", budget=2, seed=1,
    )  # fmt: skip

    def trial(u, margin=2.0, fault=""):
        return Trial(number=0, unit=(u,), values={"x": u}, margin=margin, fault=fault)

    def drive(points, runner):
        del runner
        (u,) = points[0].unit
        return [trial(u, -1.0) if u > 0.9 else trial(u, fault="refused") if u > 0.3 else trial(u)]

    failing, harmless = trial(1.0, -1.0), trial(0.0)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(failures, "drive_all", drive)
        found = failures.find_border(search, Group(kind="k", failures=(failing,)), [harmless], None)
    assert found.harmless == harmless
    assert found.failing == failing
