"""The whole stack against hand-drawn scenes."""

from __future__ import annotations

import pytest

from skidpad.core.vocabulary import DetectionStatus, Tier
from skidpad.stack.adas import AdasStack
from support.stackfakes import SPECS, ArcMap, Car, ego_at, frame


def drive(stack, level, n=80, v=20.0, v_lead=10.0, gap=40.0, **options):
    """Commands and reports while the ego keeps speed v and closes in on a slower car."""
    log = []
    for k in range(n):
        x, lead = v * 0.05 * k, gap + v_lead * 0.05 * k
        cars = [Car(lead - x)] if lead - x > 1.0 else []
        command = stack.tick(frame(k, cars, ego_at(x, 0.0, 0.0, v), level=level, **options))
        log.append((command, stack.report))
    return log


@pytest.mark.req("A-010", "A-141")
@pytest.mark.parametrize("level", ["pixels", "objects"])
def test_closing_in_ends_in_emergency_and_hard_stop(level):
    log = drive(AdasStack(SPECS, ArcMap(), {"configuration": 2}), level)
    tiers = [report.tier for _, report in log]
    order = [Tier.ACC_HOLD, Tier.ACC_CLOSE, Tier.EMERGENCY, Tier.HARD_STOP]
    first = [tiers.index(tier) for tier in order if tier in tiers]
    assert Tier.EMERGENCY in tiers
    assert Tier.HARD_STOP in tiers
    assert first == sorted(first)
    report = log[-1][1]
    assert report.status is DetectionStatus.FUSION_DETECT
    assert report.detected
    assert log[-1][0].brake == 1.0
