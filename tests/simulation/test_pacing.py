"""Real time: what is waited for, what is not caught up, and when garbage is collected."""

import gc

import pytest

from skidpad.simulation import pacing
from skidpad.simulation.pacing import COLLECT_EVERY, Pacer


class Wall:
    def __init__(self):
        self.now, self.slept = 0.0, []

    def __call__(self):
        return self.now

    def wait(self, seconds):
        self.slept.append(seconds)
        self.now += seconds


@pytest.mark.req("A-262", "A-267", "A-268")
def test_a_paced_loop_waits_and_collects_garbage_itself(monkeypatch):
    wall, collected = Wall(), []
    monkeypatch.setattr(pacing.gc, "collect", lambda *g: collected.append(g))
    one = Pacer(clock=wall, wait=wall.wait)
    one.begin()
    assert not gc.isenabled()
    for work in (0.01, 0.03, 0.2, 0.01):
        wall.now += work
        one.tick(0.05)
    one.end()
    one.end()
    assert gc.isenabled()
    assert wall.slept == pytest.approx([0.04, 0.02, 0.04])
    assert one.late == 1
    assert len(collected) == 4  # at the start, and in the three pauses


def test_as_fast_as_it_can_collects_now_and_then(monkeypatch):
    wall, collected = Wall(), []
    monkeypatch.setattr(pacing.gc, "collect", lambda *g: collected.append(g))
    free = Pacer(clock=wall, wait=wall.wait)
    free.begin()
    for _ in range(2 * COLLECT_EVERY):
        free.tick(0.0)
    free.end()
    assert (wall.slept, free.late) == ([], 0)
    assert collected == [(), (2,), (2,)]


def test_garbage_is_left_alone_where_it_is_not_asked_for():
    kept = Pacer(own_gc=False, clock=(wall := Wall()), wait=wall.wait)
    kept.begin()
    assert gc.isenabled()
    kept.tick(0.05)
    kept.end()
    assert gc.isenabled()
    assert wall.slept == [0.05]


def test_what_is_a_little_late_is_caught_up_only_within_the_grace():
    for grace, total in ((0.05, 0.20), (0.0, 0.23)):
        wall = Wall()
        one = Pacer(grace=grace, clock=wall, wait=wall.wait)
        one.begin()
        for work in (0.01, 0.08, 0.01, 0.01):
            wall.now += work
            one.tick(0.05)
        one.end()
        assert wall.now == pytest.approx(total)
