"""Guard rails that are added to files without barriers, against places measured by hand."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.roads.bundled import map_file
from skidpad.roads.opendrive.bake import bake
from skidpad.roads.opendrive.rails import add_rails
from skidpad.roads.queries import RoadMap
from skidpad.roads.roadside import BarrierKind
from support.stadium import RADIUS, STRAIGHT, WIDTH, stadium

ASIDE = 0.3  # m


def with_rails(text: bytes) -> RoadMap:
    return RoadMap(bake(add_rails(text, "mine.xodr"), "mine"))


@pytest.mark.parametrize(("beside", "edge"), [("sidewalk", WIDTH), ("shoulder", WIDTH + 2.0)])
def test_rails_run_all_along_both_edges(beside: str, edge: float) -> None:
    barriers = with_rails(stadium(beside).encode()).roadside.barriers
    assert [b.kind for b in barriers] == [BarrierKind.GUARDRAIL] * 2
    inner, outer = sorted((b.points for b in barriers), key=lambda p: float(np.ptp(p[:, 1])))
    for points, radius in ((outer, RADIUS + edge + ASIDE), (inner, RADIUS - edge - ASIDE)):
        middle = np.clip(points[:, 0], 0.0, STRAIGHT)
        found = np.hypot(points[:, 0] - middle, points[:, 1] - RADIUS)
        assert sorted((found.min(), found.max())) == pytest.approx([radius, radius], abs=0.01)
        steps = np.hypot(*np.diff(points[:, :2], axis=0).T)
        assert steps.max() < 2.5  # no gap


def test_a_file_with_barriers_stays_as_it_is() -> None:
    text = map_file("figure8").read_bytes()
    assert add_rails(text, "figure8.xodr") is text


def test_no_rail_stands_in_a_mouth_or_on_another_road(towns) -> None:  # type: ignore[no-untyped-def]
    map = with_rails((towns / "Town01.xodr").read_bytes())
    points = np.concatenate([b.points for b in map.roadside.barriers])
    assert len(points) > 2000
    assert map.edge.beyond(*points.T).min() > 0.15
