"""Pixels and objects in lockstep: the same drive, seen at both levels (decision M-3)."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from msgspec import structs

from skidpad.campaign.driving.loop import Moment, Sink
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.runs.run import run
from skidpad.core.run import RunSpec
from skidpad.core.states import StackReport
from skidpad.core.vocabulary import DetectionStatus, SensorLevel, Supervision, Tier
from skidpad.simulation.sensing import Objects
from skidpad.stack.adas import AdasStack
from support.runs import adas_run

SEEING = (DetectionStatus.FUSION_DETECT, DetectionStatus.FUSION_PERSIST)
TO_A_LEAD = frozenset(
    {
        Tier.HARD_STOP,
        Tier.STOPPED_TOO_CLOSE,
        Tier.EMERGENCY,
        Tier.STOPPED_BEHIND_CAR,
        Tier.APPROACH,
        Tier.ACC_HOLD,
        Tier.ACC_OPEN,
        Tier.ACC_CLOSE,
    }
)
HARD = frozenset({Tier.HARD_STOP, Tier.STOPPED_TOO_CLOSE, Tier.EMERGENCY})
Reports = list[tuple[StackReport, StackReport]]  # of pixels and of objects, tick by tick


class Shadow(Sink):
    """A second stack that sees the drive of the first through the object level."""

    def __init__(self, spec: RunSpec) -> None:
        self.stage = stage_of(structs.replace(spec, sensors=SensorLevel.OBJECTS))
        self.seed = spec.seed
        self.suite: Objects | None = None
        plain = {"configuration": int(spec.driver.label), "profile": spec.settings.profile}
        self.stack = AdasStack(self.stage.setup.specs, self.stage.map, plain)
        self.rows: Reports = []

    def see(self, moment: Moment) -> None:
        frame, truth = moment.frame, moment.truth
        if self.suite is None:
            self.suite = Objects(self.stage.map, truth.table, self.stage.setup, self.seed)
        seen = self.suite.read(frame.tick, truth.states, frame.lights, None)
        self.stack.tick(replace(frame, images={}, segments=seen.segments, radar=seen.radar))
        if frame.supervision is Supervision.NONE:
            self.rows.append((moment.report, self.stack.report))


@lru_cache(maxsize=2)
def in_lockstep(number: int, weather: str, seed: int) -> Reports:
    """One drive on pixels, seen by a shadow."""
    spec = adas_run(number, weather, sensors=SensorLevel.PIXELS, seed=seed, duration=36.0)
    shadow = Shadow(spec)
    run(spec, sinks=[shadow])
    return shadow.rows


def first_events(rows: Reports, tiers: frozenset[Tier]) -> tuple[int, int]:
    """Tick at which one of the tiers acts for the first time, at pixel and at object level."""
    pixels, objects = (
        next(k for k, both in enumerate(rows) if both[level].tier in tiers) for level in (0, 1)
    )
    return pixels, objects


CITY, OPEN_ROAD = (4, "clear-noon", 2), (1, "rain-night", 1)  # configuration, weather, seed


@pytest.mark.req("M-3")
def test_both_levels_read_the_same_distances() -> None:
    rows = in_lockstep(*CITY)
    both = [(p.fused, o.fused) for p, o in rows if p.fused is not None and o.fused is not None]
    assert len(both) > 100
    difference = np.abs(np.subtract(*zip(*both, strict=True)))
    assert np.median(difference) <= 0.3
    detected = np.array([(p.status in SEEING, o.status in SEEING) for p, o in rows])
    agreement = np.mean(detected[:, 0] == detected[:, 1])
    print(f"median {np.median(difference):.3f} m, agreement {agreement:.3f}")
    assert agreement >= 0.97


@pytest.mark.req("M-3")
@pytest.mark.parametrize(
    ("drive", "tiers"),
    [
        pytest.param(OPEN_ROAD, TO_A_LEAD, id="open road, any tier"),
        pytest.param(OPEN_ROAD, HARD, id="open road, hard braking"),
        pytest.param(CITY, HARD, id="city, hard braking"),
        pytest.param(CITY, TO_A_LEAD, id="city, any tier"),
    ],
)
def test_both_levels_react_within_three_ticks(
    drive: tuple[int, str, int], tiers: frozenset[Tier]
) -> None:
    pixels, objects = first_events(in_lockstep(*drive), tiers)
    assert abs(pixels - objects) <= 3, (pixels, objects)
