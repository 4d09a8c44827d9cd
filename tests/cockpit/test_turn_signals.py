"""Indicators in the pictures of a replay: as a scenario file has them, before turns and lane changes."""

from types import SimpleNamespace

import numpy as np
import pytest

from skidpad.cockpit.turn_signals import TurnSignals, find_side
from skidpad.core.setup import DT
from skidpad.recording.run.lamps import Lamp, LampChange, LampMode, write_lamps
from skidpad.roads.bundled import load_map
from skidpad.roads.lanes import LaneKind


def signals_of(folder):
    """Returns the signals of a source in `folder` that is no run, with two actors."""
    return TurnSignals(SimpleNamespace(folder=folder, table=SimpleNamespace(names=("ego", "lead"))))


def at(signals, t):
    """Returns the indicators at t s."""
    return signals.at(round(t / DT)).tolist()


def test_indicators_flash_as_the_file_says_until_it_switches_them_off(tmp_path):
    write_lamps(
        tmp_path,
        [
            LampChange(1.0, "lead", Lamp.LEFT, LampMode.FLASHING, 0.4, 0.3),
            LampChange(2.0, "lead", Lamp.LEFT, LampMode.OFF),
            LampChange(2.0, "ego", Lamp.WARNING, LampMode.ON),
            LampChange(2.0, "elsewhere", Lamp.RIGHT, LampMode.ON),
        ],
    )
    signals = signals_of(tmp_path)
    dark = [[False, False], [False, False]]
    assert at(signals, 0.9) == dark
    assert at(signals, 1.1) == [[False, False], [True, False]]
    assert at(signals, 1.5) == dark
    assert at(signals, 1.8) == [[False, False], [True, False]]
    assert at(signals, 2.1) == [[True, True], [False, False]]


def test_a_source_without_lamps_and_log_shows_none(tmp_path):
    assert at(signals_of(tmp_path), 5.0) == [[False, False], [False, False]]


def along(road_map, *places):
    """Returns the path (n, 4) over places: lane and m along it."""
    points = [road_map.at(lane, s) for lane, s in places]
    return np.array([[p.x, p.y, p.z, p.heading] for p in points])


def test_a_lane_change_is_signalled_and_driving_on_is_not():
    road_map = load_map("figure8")
    lanes = road_map.lanes
    fits = (lanes.left >= 0) & (lanes.junction < 0) & (lanes.length > 150.0)
    lane = int(np.flatnonzero(fits)[0])
    left = int(lanes.left[lane])
    assert find_side(road_map, along(road_map, (lane, 20.0), (lane, 40.0), (lane, 80.0))) == (
        False, False,
    )  # fmt: skip
    to_left = along(road_map, (lane, 20.0), (lane, 40.0), (left, 80.0))
    assert find_side(road_map, to_left) == (True, False)
    to_right = along(road_map, (left, 20.0), (left, 40.0), (lane, 80.0))
    assert find_side(road_map, to_right) == (False, True)
    ending = along(road_map, (lane, 20.0), (left, 40.0), (left, 80.0))
    assert find_side(road_map, ending) == (True, False)
    assert find_side(road_map, along(road_map, (lane, 40.0), (lane, 40.0), (left, 40.0))) == (
        True, False,
    )  # fmt: skip
    assert find_side(road_map, along(road_map, *[(lane, 40.0)] * 3)) == (False, False)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_turn_at_a_junction_is_signalled_on_its_side(sign):
    road_map = load_map("town")
    lanes, samples = road_map.lanes, road_map.samples
    ends = [samples.heading[[f, f + n - 1]] for f, n in zip(lanes.first, lanes.size, strict=True)]
    turned = np.array([np.diff(np.unwrap(h))[0] for h in ends])
    turning = (lanes.junction >= 0) & (lanes.kind == LaneKind.DRIVING) & (sign * turned > 1.2)
    lane = int(np.flatnonzero(turning)[0])
    before = road_map.predecessors(lane)[0]
    length = float(lanes.length[lane])
    path = along(
        road_map, (before, float(lanes.length[before]) - 5.0), (lane, 1.0), (lane, length - 0.5)
    )
    assert find_side(road_map, path) == (sign > 0, sign < 0)
