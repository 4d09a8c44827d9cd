"""Whose green comes together at a crossing, and where one waits for it, however a file draws lights."""

from __future__ import annotations

from copy import copy

import numpy as np
import pytest

from skidpad.core.vocabulary import LightState
from skidpad.roads.bundled import load_map
from skidpad.roads.lanes import SignalKind
from skidpad.roads.queries import RoadMap
from skidpad.simulation.world.lights import CYCLE_S, GREEN_S, RED_S, YELLOW_S, Lights
from skidpad.simulation.world.traffic.priority import LIGHT, bake_priority

TOWN = load_map("town")
CROSSING = 9000


def redrawn(*, controllers: bool) -> RoadMap:
    """Town with its lights drawn on the lanes of the crossing, as others' files do."""
    map, s = copy(TOWN), TOWN.signals
    rows, lanes = [], []
    for row in range(len(s.id)):
        light = s.kind[row] == SignalKind.LIGHT
        for lane in TOWN.successors(int(s.lane[row])) if light else [int(s.lane[row])]:
            rows.append(row)
            lanes.append(lane)
    columns = {name: getattr(s, name)[rows] for name in s._fields}
    light = columns["kind"] == SignalKind.LIGHT
    columns["lane"] = np.array(lanes, dtype=s.lane.dtype)
    columns["s"] = np.where(light, 0.0, columns["s"])
    if not controllers:
        columns["group"] = np.where(light, CROSSING, columns["group"]).astype(s.group.dtype)
    map.signals = type(s)(**columns)
    return map


def phases(map: RoadMap) -> list[set[int]]:
    return [{light.signal for light in phase} for phase in Lights(map).groups[CROSSING].phases]


def test_controllers_of_the_file_are_the_phases() -> None:
    assert phases(TOWN) == [{1001, 1002}, {1003, 1004}]
    assert phases(redrawn(controllers=True)) == phases(TOWN)


def test_facing_arms_of_a_controller_take_turns_where_that_is_asked_for() -> None:
    apart = [{light.signal for light in p} for p in Lights(TOWN, arms=True).groups[CROSSING].phases]
    assert sorted(map(min, apart)) == [1001, 1002, 1003, 1004]
    assert [len(p) for p in apart] == [1, 1, 1, 1]


def test_without_controllers_every_arm_has_its_turn() -> None:
    assert sorted(map(min, phases(redrawn(controllers=False)))) == [1001, 1002, 1003, 1004]


def test_one_waits_before_the_crossing_wherever_the_light_is_drawn() -> None:
    map = redrawn(controllers=True)
    ours = bake_priority(TOWN.samples, TOWN.lanes, TOWN.signals, None)[0]
    theirs = bake_priority(map.samples, map.lanes, map.signals, None)[0]
    np.testing.assert_array_equal(theirs["control"], ours["control"])
    held = np.flatnonzero(ours["control"] == LIGHT)
    assert len(held) == 4
    for lane in held:
        ids = TOWN.signals.id[ours["signal"][lane]], map.signals.id[theirs["signal"][lane]]
        assert ids[0] == ids[1]


def test_one_arm_at_a_time_has_green_or_yellow_and_all_have_their_turn() -> None:
    map, dt = redrawn(controllers=False), 0.05
    for seed in range(4):
        lights = Lights.build_pretimed(map, seed, dt)
        open_for = dict.fromkeys((1001, 1002, 1003, 1004), 0.0)
        cycle = 4 * (GREEN_S + YELLOW_S + RED_S)
        assert cycle > CYCLE_S
        for _ in range(round(cycle / dt)):
            lights.advance(dt)
            going = [i for i, s in lights.by_id.items() if s is not LightState.RED]
            assert len(going) <= 1
            for i in going:
                open_for[i] += dt
        for seconds in open_for.values():
            assert seconds == pytest.approx(GREEN_S + YELLOW_S, abs=2 * dt)


def test_a_light_that_is_held_stays_and_nobody_crosses_it() -> None:
    lights = Lights.build_pretimed(TOWN, 1, 0.05)
    lights.hold([(1003, LightState.GREEN), (77, LightState.RED)])
    wanted = {
        1001: LightState.RED,
        1002: LightState.RED,
        1003: LightState.GREEN,
        1004: LightState.RED,
    }
    for _ in range(2000):
        assert not lights.advance(0.05)
        assert {id: lights.by_id[id] for id in wanted} == wanted
    lights.hold([(1003, LightState.GREEN), (1004, LightState.YELLOW)])
    assert lights.by_id[1004] is LightState.YELLOW
    assert lights.by_id[1003] is LightState.GREEN
    for light in lights.lights:
        assert (lights.by_row[list(light.rows)] == light.state).all()
