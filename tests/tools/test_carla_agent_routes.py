"""The way that is given to an agent of CARLA's goes straight on and ends where the road does."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))

import carla_agent_routes as routes


def waypoint(yaw, *further):
    """A waypoint with this direction in degrees, and those that follow."""
    transform = SimpleNamespace(rotation=SimpleNamespace(yaw=yaw))
    return SimpleNamespace(transform=transform, next=lambda step: list(further))


def test_a_way_goes_straight_on_over_the_turn_of_the_circle_and_ends_with_the_road():
    end = waypoint(-178.0)
    straight, left = waypoint(-179.0, end), waypoint(120.0)
    first = waypoint(179.0, left, straight)
    assert routes.lay_way(first, 1.0) == [first, straight, end]
    assert routes.lay_way(first, 0.02) == [first, straight]
    assert routes.turn(first, straight) == 2.0
