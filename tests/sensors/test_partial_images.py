"""Some rows of an image drawn alone are the rows of the whole image."""

import numpy as np
import pytest

from skidpad.core.errors import BackendError
from skidpad.core.frames import CameraImage, image_rows
from skidpad.core.vocabulary import RangeModel
from skidpad.physics.presets import preset
from skidpad.roads.bundled import load_map
from skidpad.sensors.bench import convoy
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.sensors.suite import PixelSettings, PixelSuite

IDS = ("depth_roof", "semantic_roof", "depth_bumper", "rgb_front", "rgb_rear")


def pixels(image: CameraImage):
    shown = [image.inverse_depth, image.labels, image.rgb, image.packed]
    return [field for field in shown if field is not None]


@pytest.fixture(scope="module", params=["clear-noon", "rain-night"])
def suites(request):
    map = load_map("figure8")
    table, _ = convoy(map)
    return [
        PixelSuite(
            map, table, twelve_sensors(), preset(request.param),
            PixelSettings(range_model=RangeModel.PHYSICAL, seed=3, poison_old=poison),
        )
        for poison in (False, True)
    ]  # fmt: skip


@pytest.mark.req("A-225")
@pytest.mark.parametrize("id", IDS)
@pytest.mark.parametrize("share", [(0.0, 0.6), (0.25, 0.75), (0.5, 0.51), (0.4, 1.0)])
def test_rows_drawn_alone_equal_those_of_the_whole(suites, id, share):
    whole, part = suites
    height = whole.cameras[id].height
    rows = tuple(round(height * s) for s in share)
    for tick, travelled in enumerate((0.0, 70.0, 400.0)):
        _, states = convoy(load_map("figure8"), travelled)
        expected = whole.observe(tick, states, {}).images[id]
        images = part.observe(tick, states, {}).images
        few = image_rows(images, id, rows)
        for a, b in zip(pixels(expected), pixels(few), strict=True):
            assert np.array_equal(a[slice(*rows)], b[slice(*rows)])
        shifted = image_rows(images, id, (rows[0] // 2, rows[0]))
        for a, b in zip(pixels(expected), pixels(shifted), strict=True):
            assert np.array_equal(a[rows[0] // 2 : rows[0]], b[rows[0] // 2 : rows[0]])
        for a, b in zip(pixels(expected), pixels(images[id]), strict=True):
            assert np.array_equal(a, b)


def test_rows_of_a_frame_that_has_passed_are_an_error(suites):
    _, states = convoy(load_map("figure8"))
    old = suites[0].observe(0, states, {}).images
    suites[0].observe(1, states, {})
    with pytest.raises(BackendError, match="valid until the next step"):
        image_rows(old, "rgb_front", (0, 10))


def test_a_backend_that_draws_whole_images_is_asked_for_those():
    image = CameraImage(labels=np.ones((4, 4), np.uint8))
    assert image_rows({"a": image}, "a", (0, 2)) is image
    assert image_rows({"a": image}, "b", (0, 2)) is None
