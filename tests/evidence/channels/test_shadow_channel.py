"""A channel in shadow: what it had planned to brake for while another one drove."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.campaign.channels.drive import drive_segment
from skidpad.cli.runs.shadow import channel_lines
from skidpad.core.channels import Decision
from skidpad.core.errors import ConfigError
from skidpad.evidence.channels.shadow import planned_braking, plans_of
from skidpad.evidence.shadow import partings, share_apart
from skidpad.recording.channels.cycles import cycles
from support.channel_worlds import Listed, frame
from support.runs import segment_run

TIMES = np.arange(16) * 0.2


def plan(v: float, a: float) -> np.ndarray:
    """Points of a plan that begins at speed v and changes it by a m/s^2 until it stands."""
    t = np.minimum(TIMES, v / -a) if a < 0.0 else TIMES
    return np.column_stack([v * t + 0.5 * a * t * t, np.zeros(16), TIMES])


def said(t: float, v: float, a: float):
    return frame(t, (0.0, 0.0, 0.0, v, 0.0), plan=plan(v, a))


@pytest.mark.parametrize(("a", "share"), [(0.0, 0.0), (-4.0, 0.5), (-8.0, 1.0), (2.0, 0.0)])
def test_braking_is_read_from_a_plan(a, share):
    assert planned_braking(said(0.0, 15.0, a)) == pytest.approx(share, abs=1e-9)


def test_without_a_plan_there_is_nothing_to_compare():
    assert np.isnan(planned_braking(None))
    assert np.isnan(planned_braking(frame(0.0, (0.0,) * 5, plan=np.zeros((0, 3)))))


@pytest.mark.req("C-010")
def test_a_channel_that_brakes_while_another_drives_is_found():
    rows = [(None, Decision(0.0, "a", "", ()))]
    for k in range(80):
        t = 0.1 * k
        if k == 60:
            rows.append((None, Decision(t, "b", "", ())))  # from here on it drives itself
        rows += [(0, said(t, 15.0, 0.0)), (1, said(t, 15.0, -3.0 if t >= 3.0 else 0.0))]
    t, driving, riding = plans_of(cycles(Listed(("a", "b"), rows)), 1)
    (one,) = partings(t, driving, riding)
    assert one.shadow_brakes
    assert (one.begin, one.end) == (pytest.approx(3.0, abs=0.11), pytest.approx(6.0, abs=0.11))
    assert share_apart(driving, riding) == pytest.approx(0.5, abs=0.03)
    t, driving, riding = plans_of(cycles(Listed(("a", "b"), rows)), 0)
    assert [p.shadow_brakes for p in partings(t, driving, riding)] == [False], "a while b drives"


@pytest.mark.req("C-010")
def test_of_a_driven_recording_each_channel_is_compared(tmp_path):
    drive_segment(segment_run(), tmp_path / "one.mcap")
    told = channel_lines(tmp_path / "one.mcap", None)
    assert sum("in the shadow of the driving channel" in line for line in told) == 2
    with pytest.raises(ConfigError, match="lav_like"):
        channel_lines(tmp_path / "one.mcap", "lav")
