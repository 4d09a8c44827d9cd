"""What a drive says for the findings: violations by cause, times by module."""

import numpy as np
import polars as pl
import pytest

from skidpad.evidence.channels.judging.causes import ego_motion
from skidpad.evidence.channels.judging.facts import (
    COMPARED,
    WARM_CYCLES,
    Observer,
    ViolationCause,
    times_of,
)
from skidpad.evidence.channels.monitor import Monitor
from skidpad.recording.channels.cycles import cycles
from support.channel_worlds import Eyes, World, drive


def facts(world, eyes, seconds=12.0, change=None):
    source = drive(world, eyes, seconds)
    seen = list(cycles(source))
    monitor = Monitor(source.channels)
    observer = Observer(monitor, ego_motion(seen))
    for k, cycle in enumerate(seen):
        observer.see(k, monitor.update(cycle))
    if change:
        change(observer)
    return observer.facts()


def by_cause(found):
    """Violations of each cause, over all indicators."""
    return {
        cause: sum(
            v for name, v in found.items() if name.startswith(f"cause_{cause.name.lower()}_")
        )
        for cause in ViolationCause
    }


AHEAD = [(30.0, 0, 0, 15.0, 0), (50.0, 3.5, 0, 15, 0), (70.0, 3.5, 0, 15, 0), (90.0, 0, 0, 15, 0)]
WORLD = World((0.0, 0.0, 0.0, 15.0, 0.0), np.array(AHEAD))
BLIND = (
    Eyes("a", 0.03),
    Eyes("b", 0.03, blind=(0, 1, 2)),
)  # one of four objects is below the bound


@pytest.mark.req("C-215")
def test_every_violation_has_one_cause_and_a_blind_channel_is_named():
    found = facts(WORLD, BLIND)
    causes = by_cause(found)
    total = sum(v for name, v in found.items() if name.startswith("violations_"))
    assert total > 0
    assert sum(causes.values()) == total
    assert causes[ViolationCause.UNEQUAL] == total


@pytest.mark.req("C-215")
@pytest.mark.parametrize(
    ("cause", "change"),
    [
        (ViolationCause.SILENT, lambda o: o.silent.__setitem__(slice(None), True)),
        (ViolationCause.STANDING, lambda o: o.motion["v"].__setitem__(slice(None), 1.9)),
        (ViolationCause.TURN, lambda o: o.motion["yaw_rate"].__setitem__(slice(None), -0.13)),
        (ViolationCause.NOISE, lambda o: o.unequal.__setitem__(slice(None), False)),
    ],
)
def test_what_was_going_on_decides_the_cause_in_its_order(cause, change):
    found = by_cause(facts(WORLD, BLIND, change=change))
    assert {c for c, n in found.items() if n} == {cause}


@pytest.mark.req("C-233")
def test_times_leave_the_first_cycles_out_and_know_their_deviation_and_breaches():
    warm = np.array([20.0, 30.0] * 20)
    total = np.concatenate([np.full(WARM_CYCLES, 999.0), warm])
    times = times_of(pl.DataFrame({"total": total, **dict.fromkeys(COMPARED, total / 10.0)}))
    assert times["total_mean_ms"] == pytest.approx(25.0)
    assert times["total_std_ms"] == pytest.approx(5.0)
    assert times["total_max_ms"] == pytest.approx(30.0)
    assert times["total_breaches_pct"] == pytest.approx(50.0), "25 ms and less is no breach"
    assert times[f"{COMPARED[0]}_std_ms"] == pytest.approx(0.5)
    assert times[f"{COMPARED[0]}_max_ms"] == pytest.approx(3.0)
    assert times["total_min_ms"] == pytest.approx(20.0)
    assert times["total_within_90_pct"] == 0.0, "30 ms is beyond, 20 ms below 22.5"
    assert times[f"{COMPARED[0]}_within_90_pct"] == pytest.approx(50.0), "of its own maximum"
    assert times_of(pl.DataFrame({"total": total[:5]})) == {}
