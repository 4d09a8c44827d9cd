"""Views of the cockpit drawn in threads beside each other: the same bytes as one after the other."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest

from skidpad.cockpit.studio import Studio, View, plane
from skidpad.core.inputs import Outside
from skidpad.core.kernels import threads
from skidpad.core.vocabulary import GripModel, RangeModel
from skidpad.physics.presets import preset
from skidpad.roads.bundled import load_map
from skidpad.sensors.bench import convoy


@pytest.mark.parametrize("weather", ["clear-noon", "rain-night"])
def test_threads_change_no_pixel(monkeypatch, weather):
    pool = ThreadPoolExecutor(4)
    monkeypatch.setattr(threads, "count_processors", lambda: 4)
    monkeypatch.setattr(threads, "_pool", lambda: pool)
    map = load_map("town")
    table, _ = convoy(map)
    outside = Outside(
        weather=preset(weather), grip=GripModel.PHYSICAL, range_model=RangeModel.PHYSICAL
    )
    alone, beside = (Studio(map, table, outside, 3) for _ in range(2))
    for tick in range(4):
        commands = np.zeros((len(table), 3))
        commands[::2, 1] = tick % 2  # every other one brakes
        states = convoy(map, 20.0 * tick)[1]
        truth = SimpleNamespace(tick=tick, states=states, lights={}, commands=commands)
        images = alone.look(truth)
        drawn = beside.draw(beside.look(truth), list(View))
        assert list(drawn) == list(View)
        for view in View:
            assert np.array_equal(drawn[view], plane(images[view.value])), (tick, view)
    pool.shutdown()
