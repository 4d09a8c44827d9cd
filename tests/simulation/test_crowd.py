"""Cyclists at the end of the road."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from skidpad.core.states import ActorStates, ActorTable, WorldTruth
from skidpad.roads.bundled import FOLDER, load_map
from skidpad.simulation.crowd import PERIOD, RIDE_STOP, Crowd


def nobody() -> WorldTruth:
    """A world without actors."""
    none = np.zeros(0)
    table = ActorTable((), (), none.astype(np.uint8), none, none, none, np.zeros((0, 3), np.uint8))
    states = ActorStates.empty(0)
    return WorldTruth(0, table, states, np.zeros((0, 4)), np.zeros((0, 5)), {}, (), ())


def test_a_cyclist_stops_before_a_dead_end(tmp_path: Path) -> None:
    file = tmp_path / "street.xodr"
    file.write_text((FOLDER / "straight.xodr").read_text().replace('max="100.0"', 'max="30.0"'))
    crowd = Crowd(load_map(file), 0, 1, 1)
    (rider,) = crowd.riders
    end = float(crowd.map.lanes.length[rider.lanes[0]])
    rider.s = end - 40.0
    for k in range(400):
        crowd.commands(k * PERIOD, nobody())
    assert rider.v == pytest.approx(0.0, abs=0.05)
    assert rider.s == pytest.approx(end - RIDE_STOP, abs=0.5)
