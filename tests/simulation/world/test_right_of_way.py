"""Traffic in town: who yields to whom, and an hour without deadlock (decision C-11)."""

import dataclasses
import time

import numpy as np
import pytest
from msgspec.structs import replace

from skidpad.campaign.channels.world import segment_of
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import LightState
from skidpad.roads.bundled import load_map
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.simulation.world.lights import Lights
from skidpad.simulation.world.traffic.priority import STOP, YIELD, bake_priority
from skidpad.simulation.world.traffic.streets import priority_of
from support.runs import segment_run

TOWN = load_map("town")


def lanes_between(from_road: int, to_road: int) -> list[int]:
    """Junction lanes that lead from one road to another."""
    road = TOWN.lanes.road
    return [
        lane
        for lane in range(len(road))
        if TOWN.lanes.junction[lane] >= 0
        and any(road[p] == from_road for p in TOWN.predecessors(lane))
        and any(road[n] == to_road for n in TOWN.successors(lane))
    ]


def conflicts(lane: int) -> dict[int, bool]:
    """Lanes that meet this one, and whether it has to yield."""
    entry, conflict, _, _ = priority_of(TOWN)
    rows = conflict[entry["first"][lane] : entry["first"][lane] + entry["size"][lane]]
    return {int(r["other"]): bool(r["yields"]) for r in rows}


def test_zebras_far_away_cost_the_lanes_nothing():
    """Each lane was compared with each zebra."""
    near = TOWN.roadside.crosswalks

    def seconds(copies: int) -> float:
        far = [np.add(zebra, (1e4 + 10.0 * k, 0.0, 0.0)) for k in range(copies) for zebra in near]
        roadside = dataclasses.replace(TOWN.roadside, crosswalks=(*near, *far))
        began = time.process_time()
        rows = bake_priority(TOWN.samples, TOWN.lanes, TOWN.signals, roadside)[2]
        taken = time.process_time() - began
        assert rows.tolist() == priority_of(TOWN)[2].tolist()
        return taken

    assert min(seconds(250) for _ in range(3)) < 8.0 * min(seconds(0) for _ in range(3))


@pytest.mark.req("C-210")
def test_the_stem_of_a_t_junction_yields_to_the_main_street():
    left, right = lanes_between(1, 6)[0], lanes_between(1, 5)[0]
    through = [*lanes_between(5, 6), *lanes_between(6, 5)]
    for lane in (left, right):
        met = [other for other in through if other in conflicts(lane)]
        assert met
        assert all(conflicts(lane)[other] and not conflicts(other)[lane] for other in met)


@pytest.mark.req("C-210")
def test_left_turns_yield_to_oncoming_traffic():
    left, oncoming = lanes_between(1, 3)[0], lanes_between(2, 1)[0]
    assert conflicts(left)[oncoming]
    assert not conflicts(oncoming)[left]


@pytest.mark.req("C-210")
def test_entries_of_the_roundabout_yield_to_the_circle():
    entry, _, _, _ = priority_of(TOWN)
    entries = [
        lane
        for lane in range(len(TOWN.lanes.road))
        if TOWN.lanes.junction[lane] in range(9010, 9014)
        and any(entry["control"][p] == YIELD for p in TOWN.predecessors(lane))
    ]
    assert len(entries) == 3
    for lane in entries:
        assert any(conflicts(lane).values())


@pytest.mark.req("C-210")
def test_of_two_that_meet_exactly_one_yields_unless_the_lanes_part():
    for lane in range(len(TOWN.lanes.road)):
        for other, yields in conflicts(lane).items():
            back = conflicts(other)[lane]
            parts = set(TOWN.predecessors(lane)) & set(TOWN.predecessors(other))
            assert (yields, back) == (False, False) if parts else yields != back


@pytest.mark.req("C-210")
def test_crossing_streets_never_have_green_together():
    for seed in range(5):
        lights = Lights.build_pretimed(TOWN, seed, 0.05)
        heading = TOWN.signals.heading[lights.rows]
        north_south = np.abs(np.sin(heading)) > 0.7
        for _ in range(1800):
            lights.advance(0.05)
            go = lights.by_row[lights.rows] != LightState.RED
            assert not (go[north_south].any() and go[~north_south].any())


def drive_town(seed: int, seconds: float, vehicles: int) -> dict[str, float]:
    """Drive background traffic alone; what happened."""
    run = segment_run("route-3", seed=seed, duration=60.0)
    segment = segment_of(replace(run, course=replace(run.course, vehicles=vehicles)))
    backend = EmbeddedBackend()
    backend.reset(segment.setup, seed)
    world = backend.world
    world.states.present[0] = False
    driven = world.traffic.drivers.state["active"]
    still, longest, wrecks, halts = np.zeros(len(driven)), 0.0, 0, set()
    stops = {int(lane) for lane in np.flatnonzero(world.traffic.streets.entry["control"] == STOP)}
    for k in range(round(seconds / 0.05)):
        words = segment.crowd.commands(0.05 * k, backend.truth()) if k % 2 == 0 else ()
        backend.step(VehicleCommand(brake=1.0), words)
        v = np.hypot(world.states.vx, world.states.vy)
        still = np.where(driven & (v < 0.3), still + 0.05, 0.0)
        longest = max(longest, float(still.max()))
        wrecks += len(world.events.notices)
        halts |= {int(world.placed["lane"][i]) for i in np.flatnonzero(driven & (v < 0.5))} & stops
    backend.close()
    return {"longest": longest, "wrecks": wrecks, "halts": len(halts), "v": float(v[driven].mean())}


@pytest.mark.req("C-210")
def test_traffic_stops_at_stop_lines_and_goes_on():
    result = drive_town(3, 120.0, 16)
    assert result["halts"] >= 2
    assert result["longest"] < 100.0
    assert result["v"] > 2.0


@pytest.mark.slow
@pytest.mark.req("C-210")
def test_an_hour_in_town_without_deadlock():
    result = drive_town(5, 3600.0, 22)
    assert result["longest"] < 400.0, "everybody gets through within nine cycles of the lights"
    assert result["wrecks"] <= 10, "of 22 vehicles in an hour"
    assert result["v"] > 1.0
