"""Quality draft: fewer effects in colours, and nothing else is another bit."""

from __future__ import annotations

import numpy as np
import pytest
from msgspec import structs

from skidpad.core.courses import Roads
from skidpad.core.geometry import Pose
from skidpad.core.run import AdasDriver, RunSpec, run_from_plain
from skidpad.core.specs import CameraSpec, Modality
from skidpad.core.vocabulary import Bodywork, Quality, RangeModel, Scenery
from skidpad.physics.presets import preset
from skidpad.roads.bundled import load_map
from skidpad.scenery.dressing import dress_map
from skidpad.sensors.bench import convoy
from skidpad.sensors.finish.extras import ALL_EXTRAS, NO_EXTRAS
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.sensors.suite import PixelSettings, PixelSuite

FRONT = Pose(0.5, 0.0, 1.4)
CAMERAS = tuple(
    CameraSpec(m.value, m, 320, 240, 80.0, FRONT)
    for m in (Modality.RGB, Modality.DEPTH, Modality.SEMANTIC, Modality.INSTANCE)
)


def suite(quality, weather, extras=ALL_EXTRAS, map_name="town"):
    map = dress_map(load_map(map_name), Scenery.FULL)
    settings = PixelSettings(
        quality=quality, extras=extras, seed=5, range_model=RangeModel.PHYSICAL,
        bodywork=Bodywork.SHAPED,
    )  # fmt: skip
    specs = (*CAMERAS, *(s for s in twelve_sensors() if not isinstance(s, CameraSpec)))
    return PixelSuite(map, convoy(load_map(map_name))[0], specs, preset(weather), settings)


@pytest.mark.parametrize("weather", ["clear-noon", "rain-night", "snow"])
@pytest.mark.parametrize("map_name", ["town", "figure8"])
def test_a_draft_has_the_same_depth_classes_instances_and_radar(weather, map_name):
    full, draft = (suite(q, weather, map_name=map_name) for q in Quality)
    for tick in range(2):
        states = convoy(load_map(map_name), 60.0 * tick)[1]
        a, b = (s.observe(tick, states, {}) for s in (full, draft))
        for column, other in zip(a.radar, b.radar, strict=True):
            assert np.array_equal(column, other)
        for name in ("inverse_depth", "labels", "instances"):
            (id,) = [c.id for c in CAMERAS if getattr(a.images[c.id], name) is not None]
            assert np.array_equal(getattr(a.images[id], name), getattr(b.images[id], name))
        one, two = a.images["rgb"].rgb, b.images["rgb"].rgb
        assert one.shape == two.shape
        assert not np.array_equal(one, two)


def test_a_draft_for_a_stack_differs_where_there_is_grain_and_nowhere_else():
    full, draft = (suite(q, "clear-noon", NO_EXTRAS) for q in Quality)
    states = convoy(load_map("town"))[1]
    a, b = (s.observe(0, states, {}).images for s in (full, draft))
    off = np.abs(a["rgb"].rgb.astype(int) - b["rgb"].rgb).max(axis=2)
    vehicles = a["instance"].instances > 0
    assert vehicles.sum() > 100
    assert not off[vehicles].any()  # grain is of the map, paint has none
    assert 0 < off.mean() < 25  # the same picture, but for what was left out


def test_runs_are_drawn_in_full_unless_asked_and_then_say_so():
    plain = RunSpec(driver=AdasDriver(), course=Roads())
    assert "quality" not in plain.to_plain()
    draft = structs.replace(plain, quality=Quality.DRAFT)
    assert draft.to_plain()["quality"] == "draft"
    assert run_from_plain(draft.to_plain(), "it") == draft
