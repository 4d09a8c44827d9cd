"""Decision M-12 for pixels and radar: a car 8 m above or below is no target."""

import numpy as np
import pytest

from skidpad.core.vocabulary import ActorKind, SemanticClass
from skidpad.core.weather import Weather
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.sensors.suite import PixelSettings, PixelSuite
from support.sensors.worlds import World, lanes_along, states_at, table_of


def crossing(rise=8.0):
    """A road along x at height 0 and one along y at `rise` above it, crossing at x = 200."""
    x = np.arange(401, dtype=float)
    zero = np.zeros_like(x)
    low, below = lanes_along(x, zero + 7.0, zero, zero)
    high, above = lanes_along(zero + 200.0, x - 200.0, zero + rise, zero + np.pi / 2, road=2)
    shift = len(below.road)
    samples = low._make(
        np.concatenate([a, b + shift if n == "lane" else b])
        for n, a, b in zip(low._fields, low, high, strict=True)
    )
    joined = {n: np.concatenate([getattr(below, n), getattr(above, n)]) for n in below._fields}
    joined["first"] = np.concatenate([below.first, above.first + len(low.x)]).astype(np.int32)
    return World(samples, below._replace(**joined))


@pytest.mark.parametrize("ego_height", [0.0, 8.0])
def test_a_car_on_the_other_level_is_neither_in_the_corridor_nor_on_radar(ego_height):
    world = crossing()
    table = table_of([ActorKind.CAR, ActorKind.TRUCK])
    if ego_height:
        ego, others = (203.5, -40.0, 8.0, np.pi / 2), [(203.5, 0, 0, 0), (206, 8, 0, 0)]
    else:
        ego, others = (160.0, 0.0, 0.0, 0.0), [(200, 0, 8.0, 1.57), (203, 3, 8.0, 1.57)]
    suite = PixelSuite(world, table, twelve_sensors(), Weather(), PixelSettings(seed=2))
    with_cars = states_at([ego, *others], [20.0, 10.0, 10.0])
    without = with_cars.copy()
    without.present[1:] = False
    for tick in range(20):
        busy = suite.observe(tick, with_cars, {})
        band = busy.images["semantic_roof"].labels[150:450, 300:500].copy()
        returns = [column.copy() for column in busy.radar]
        empty = suite.observe(tick, without, {}).radar
        near_axis = (returns[2] > -0.05) & (returns[2] < 0.08)
        free_axis = (empty.altitude > -0.05) & (empty.altitude < 0.08)
        assert np.array_equal(returns[0][near_axis], empty.range[free_axis])
    if ego_height:
        assert not np.isin(band, [SemanticClass.CAR, SemanticClass.TRUCK]).any()
