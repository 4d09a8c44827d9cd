"""What studies count in a log, by logs in which the answer is plain."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from skidpad.core.states import ContactEvent, StackReport
from skidpad.core.vocabulary import RelocationReason, Supervision, Tier
from skidpad.evidence.drive import manner
from skidpad.recording.run.events import Relocation
from skidpad.recording.run.log import RunLog
from support.makelog import DT, drive, pose


def tiers(*stretches: tuple[Tier, int], throttle: float = 0.5, far: float = 100.0) -> RunLog:
    """A log that goes through tiers, with another car `far` m ahead."""
    each = [tier for tier, n in stretches for _ in range(n)]
    log = drive(
        len(each),
        lambda k: [{"x": float(k), "vx": 20.0}, {"x": k + far, "vx": 20.0}],
        report=lambda k: StackReport(tier=each[k]),
    )
    return replace(log, applied=log.applied._replace(throttle=np.full(len(each), throttle)))


def speeds(v: Callable[[float], float], seconds: float = 20.0, **more: object) -> RunLog:
    return drive(round(seconds / DT), lambda k: [{"vx": v(k * DT)}], **more)  # type: ignore[arg-type]


def test_braking_for_nothing_has_nobody_near() -> None:
    swing = [(Tier.CRUISE, 40), (Tier.EMERGENCY, 5), (Tier.CRUISE, 40), (Tier.HARD_STOP, 5)]
    assert manner.phantom_brakings(tiers(*swing)) == 2
    assert manner.phantom_brakings(tiers(*swing, far=39.0)) == 0


@pytest.mark.parametrize(
    ("coasted", "throttle", "found"), [(0, 0.5, 1), (39, 0.5, 1), (41, 0.5, 0), (0, 0.2, 0)]
)
def test_a_surge_is_pulling_away_just_before_emergency_braking(
    coasted: int, throttle: float, found: int
) -> None:
    follow = [(Tier.ACC_HOLD, coasted)] if coasted else []
    log = tiers((Tier.CRUISE, 60), *follow, (Tier.EMERGENCY, 20), throttle=throttle)
    assert manner.surges(log) == found


def test_changes_of_mode_are_counted_per_minute_of_following_and_cruising() -> None:
    log = tiers(*[(Tier.ACC_OPEN, 10), (Tier.ACC_CLOSE, 10), (Tier.CRUISE, 20)] * 15)
    assert manner.mode_changes_per_min(log) == pytest.approx(29 * 60 / (600 * DT))
    stopped = tiers((Tier.ACC_HOLD, 20), (Tier.EMERGENCY, 20), (Tier.CRUISE, 20))
    assert manner.mode_changes_per_min(stopped) == 0.0
    assert manner.mode_changes_per_min(tiers((Tier.HOLDING_AT_LINE, 20))) is None


def test_jerk_of_a_known_motion() -> None:
    assert manner.jerk_rms(speeds(lambda t: 5.0 + 0.5 * t)) == pytest.approx(0.0, abs=1e-4)
    assert manner.jerk_rms(speeds(lambda t: 5.0 + t * t)) == pytest.approx(2.0, abs=1e-3)
    slow = manner.jerk_rms(speeds(lambda t: 20.0 + math.sin(t), seconds=20 * math.pi))
    assert slow == pytest.approx(math.sqrt(0.5), rel=0.05)
    assert manner.jerk_rms(speeds(lambda t: t, seconds=0.5)) is None
    supervised = speeds(lambda t: t * t, supervision=lambda _k: Supervision.BRAKE)
    assert manner.jerk_rms(supervised) is None


def sliding(angle_deg: float, v: float = 20.0, **more: object) -> RunLog:
    def rows(k: int) -> list[dict[str, float]]:
        turned = math.radians(angle_deg) if 20 <= k < 30 else 0.0
        return [{"x": v * k * DT, "vx": v, "yaw": turned}]

    return drive(60, rows, **more)  # type: ignore[arg-type]


def test_a_slide_is_moving_elsewhere_than_one_points() -> None:
    assert manner.spins(sliding(16.0)) == manner.spins(sliding(-16.0)) == 1
    assert manner.spins(sliding(14.0)) == 0
    assert manner.spins(sliding(90.0, v=4.0)) == 0
    struck = ContactEvent(15, 1, "", 900.0, 15.0, 70.0, 0.0)
    assert manner.spins(sliding(40.0, contacts=[struck])) == 0


@pytest.mark.parametrize(("tick", "found"), [(10, 0), (11, 1), (70, 1), (71, 0)])
def test_a_second_hit_comes_within_three_seconds_of_a_relocation(tick: int, found: int) -> None:
    def extra(log: object, k: int) -> None:
        if k == 10:
            moved = Relocation(10, RelocationReason.COLLISION, 0.0, pose(0.0), pose(1.0))
            log.relocated(moved)  # type: ignore[attr-defined]

    hit = ContactEvent(tick, -1, "guardrail", 5.0, 1.0, 0.0, 0.0)
    log = drive(100, lambda k: [{"x": float(k), "vx": 20.0}], contacts=[hit], extra=extra)
    assert manner.hits_in_cool_down(log) == found
