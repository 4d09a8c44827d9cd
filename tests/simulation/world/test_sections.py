"""A way through a crossing that a file cuts into lane sections is one way: nobody yields to himself."""

from __future__ import annotations

from copy import deepcopy
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from skidpad.campaign.bench.traffic import FIRST_SEED, background_world
from skidpad.campaign.bench.traffic_options import TrafficBench
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import RoadMap
from skidpad.simulation.world.traffic.streets import priority_of

LARGE = next(
    (
        found
        for p in Path(__file__).parents
        if (found := p / "shared" / "maps" / "Town04.xodr").is_file()
    ),
    None,
)


@pytest.fixture(scope="module")
def cut(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Town with all roads of junctions cut into two lane sections."""
    tree = etree.fromstring((files("skidpad.roads") / "maps" / "town.xodr").read_bytes())
    for road in tree.findall("road"):
        section = road.find("lanes/laneSection")
        if road.get("junction") == "-1" or section is None:
            continue
        rest = deepcopy(section)
        rest.set("s", str(float(road.get("length", "")) / 2.0))
        section.addnext(rest)
        for part, end in ((section, "successor"), (rest, "predecessor")):
            for lane in part.iter("lane"):
                link = lane.find("link")
                if link is None:
                    continue
                for old in link.findall(end):
                    link.remove(old)
                etree.SubElement(link, end, id=lane.get("id", ""))
    file = tmp_path_factory.mktemp("cut") / "cut.xodr"
    file.write_bytes(etree.tostring(tree))
    return file


def ends(map: RoadMap, lane: int) -> tuple[str, str]:
    """Where the way over a lane of a junction comes from and goes to, as road and lane ids."""
    names = []
    for step in (map.predecessors, map.successors):
        here = lane
        while map.lanes.junction[here] == map.lanes.junction[lane]:
            here = step(here)[0]
        names.append(f"{map.lanes.road[here]}:{map.lanes.lane_id[here]}")
    return names[0], names[1]


def yields(map: RoadMap) -> set[tuple[object, ...]]:
    """Who yields to whom, by where they come from and where they go."""
    entry, conflict, *_ = priority_of(map)
    return {
        (ends(map, lane), ends(map, int(row["other"])), bool(row["yields"]), bool(row["joins"]))
        for lane in np.flatnonzero(entry["size"])
        for row in conflict[entry["first"][lane] : entry["first"][lane] + entry["size"][lane]]
    }


def test_sections_change_neither_conflicts_nor_who_yields(cut: Path) -> None:
    theirs = load_map(str(cut))
    assert len(theirs.lanes.first) > len(load_map("town").lanes.first)
    assert yields(theirs) == yields(load_map("town"))


def test_nobody_waits_for_those_behind(cut: Path) -> None:
    world = background_world(TrafficBench(map=str(cut), vehicles=30), "clear-noon", FIRST_SEED)
    standing = np.zeros(len(world.members))
    for _ in range(3000):
        world.step()
        v = np.hypot(world.states.vx, world.states.vy)
        standing = np.where(world.states.present & (v < 0.1), standing + world.dt, 0.0)
        assert standing.max() < 90.0  # two cycles of the lights
        assert world.events.put_back == ()


@pytest.mark.slow
@pytest.mark.skipif(LARGE is None, reason="the large town's file is not here")
def test_a_large_town_flows_for_an_hour() -> None:
    asked = TrafficBench(map=str(LARGE), vehicles=50)
    world = background_world(asked, "clear-noon", FIRST_SEED)
    put_back, standing, longest = 0, np.zeros(50), 0.0
    for _ in range(72_000):
        world.step()
        put_back += len(world.events.put_back)
        v = np.hypot(world.states.vx, world.states.vy)
        standing = np.where(world.states.present & (v < 0.1), standing + world.dt, 0.0)
        longest = max(longest, float(standing.max()))
    assert put_back == 0
    assert longest < 180.0  # three cycles of a crossing of four arms
