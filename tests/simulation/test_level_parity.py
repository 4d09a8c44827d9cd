"""Pixels and objects in lockstep: the same drive, seen at both levels (decision M-3)."""

from dataclasses import replace

import numpy as np
import pytest

from skidpad.campaign.cells import Cell, Driver
from skidpad.campaign.drive import prepare, run_cell
from skidpad.core.vocabulary import DetectionStatus, SensorLevel, Supervision
from skidpad.physics.presets import find_weather
from skidpad.simulation.embedded.sensing import Objects
from skidpad.stack.adas import AdasStack
from skidpad.stack.configurations import functions_of
from skidpad.stack.settings import load_profile

SEEING = (DetectionStatus.FUSION_DETECT, DetectionStatus.FUSION_PERSIST)


class Shadow:
    """A second stack that sees the drive of the first through the object level."""

    def __init__(self, cell):
        ready = prepare(replace(cell, level=SensorLevel.OBJECTS))
        self.ready, self.seed, self.suite = ready, cell.seed, None
        plain = {
            "functions": sorted(f.value for f in cell.driver.functions),
            "profile": cell.profile,
        }
        self.stack = AdasStack(ready.setup.specs, ready.map, plain)
        self.rows = []

    def see(self, frame, truth, report):
        if self.suite is None:
            self.suite = Objects(self.ready.map, truth.table, self.ready.setup, self.seed)
        seen = self.suite.read(frame.tick, truth.states, frame.lights, None)
        self.stack.tick(replace(frame, images={}, segments=seen.segments, radar=seen.radar))
        if frame.supervision is Supervision.NONE:
            self.rows.append((report, self.stack.report))


@pytest.mark.req("M-3")
@pytest.mark.parametrize(("weather", "seed"), [("clear-noon", 2)])
def test_both_levels_read_the_same_distances(weather, seed):
    cell = Cell(
        driver=Driver(label="4", functions=functions_of(4)),
        weather=find_weather(weather),
        seed=seed,
        profile="recommended",
        settings=load_profile("recommended"),
        duration=40.0,
    )
    shadow = Shadow(cell)
    run_cell(cell, watchers=(shadow,))
    both = [
        (p.fused, o.fused) for p, o in shadow.rows if p.fused is not None and o.fused is not None
    ]
    assert len(both) > 100
    difference = np.abs(np.subtract(*zip(*both, strict=True)))
    assert np.median(difference) <= 0.3
    detected = np.array([(p.status in SEEING, o.status in SEEING) for p, o in shadow.rows])
    agreement = np.mean(detected[:, 0] == detected[:, 1])
    print(f"median {np.median(difference):.3f} m, agreement {agreement:.3f}")
    assert agreement >= 0.97
