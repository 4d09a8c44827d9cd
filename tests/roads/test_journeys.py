"""A journey follows the road for its length, and a car's progress on it neither jumps nor falls."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.core.errors import ConfigError
from skidpad.roads.bundled import load_map
from skidpad.roads.journeys import Journey, progress_along
from skidpad.roads.queries import RoadMap


def driven(map: RoadMap, length: float, aside: float = 0.0) -> tuple[np.ndarray, ...]:
    """Places every metre along the lane from the start, `aside` m to the left of it."""
    start = map.on_lane(1, -2, 20.0)
    points = [start] + [p for k in range(1, int(length) + 1) if (p := map.ahead(start, float(k)))]
    x = [p.x - aside * np.sin(p.heading) for p in points]
    y = [p.y + aside * np.cos(p.heading) for p in points]
    return np.array(x), np.array(y), np.array([p.z for p in points])


@pytest.mark.parametrize("aside", [0.0, 7.0])
def test_a_car_that_follows_the_road_comes_to_the_end(figure8: RoadMap, aside: float) -> None:
    journey = Journey(figure8, figure8.on_lane(1, -2, 20.0), 3000.0)  # more than one round
    way = progress_along(journey, *driven(figure8, 3010.0, aside))
    assert journey.is_done
    assert way[-1] == 3000.0
    assert (np.diff(way) >= 0.0).all()
    assert np.abs(way[:3000] - np.arange(3000)).max() < 20.0


def test_a_car_that_leaves_its_way_or_turns_back_keeps_what_it_had(figure8: RoadMap) -> None:
    journey = Journey(figure8, figure8.on_lane(1, -2, 20.0), 1000.0)
    x, y, z = driven(figure8, 300.0)
    had = progress_along(journey, x, y, z)[-1]
    assert had == pytest.approx(300.0, abs=5.0)
    assert progress_along(journey, x[::-1], y[::-1], z[::-1])[-1] == had
    assert progress_along(journey, x + 30.0, y + 30.0, z)[-1] == had
    assert journey.follow(x[-1], y[-1], z[-1] + 6.0) == had  # on a bridge over it
    assert not journey.is_done


def test_a_way_that_is_longer_than_the_road_is_refused() -> None:
    straight = load_map("straight")
    with pytest.raises(ConfigError, match="route-km must be at most .* on map straight"):
        Journey(straight, straight.on_lane(1, -1, 20.0), 900_000.0)
