"""Rain drops on the lens."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.core.weather import Weather
from skidpad.sensors.pictures.overlay import OPACITY, droplet_layer, overlaid

RAIN = Weather(precipitation=60.0)


def picture() -> np.ndarray:
    rng = np.random.default_rng(0)
    return rng.integers(0, 256, (120, 160, 3), dtype=np.uint8)


@pytest.mark.req("B-160")
def test_without_rain_the_image_stays_as_it_is():
    image = picture()
    layer = droplet_layer(Weather(), 160, 120, 1, "front")
    assert not layer.any()
    assert overlaid(image, layer) is image


@pytest.mark.req("B-160")
def test_more_rain_means_more_drops_and_the_same_ones():
    layers = [
        droplet_layer(Weather(precipitation=p), 320, 240, 1, "front") for p in (20.0, 50.0, 100.0)
    ]
    covered = [float(layer.mean()) for layer in layers]
    assert covered[0] < covered[1] < covered[2]
    assert (layers[0] <= layers[2] + 1e-6).all()
    assert layers[2].max() <= OPACITY


@pytest.mark.req("B-160")
def test_drops_are_out_of_focus_and_hide_detail():
    layer = droplet_layer(RAIN, 160, 120, 1, "front")
    assert np.abs(np.diff(layer, axis=1)).max() < 0.5  # no sharp rim
    image, before = picture(), picture()
    out = overlaid(image, layer)
    assert (image == before).all()
    drop, free = layer > 0.7 * layer.max(), layer < 0.01
    detail = np.abs(np.diff(out.astype(float), axis=1)).mean(axis=2)
    assert detail[drop[:, 1:]].mean() < 0.6 * detail[free[:, 1:]].mean()
    assert (out[free & (layer == 0.0)] == image[free & (layer == 0.0)]).all()


@pytest.mark.req("B-160", "X-8")
def test_each_camera_and_seed_has_its_own_drops():
    a, b, c, d = (
        droplet_layer(RAIN, 160, 120, seed, camera)
        for seed, camera in ((1, "front"), (1, "front"), (1, "roof"), (2, "front"))
    )
    assert (a == b).all()
    assert (a != c).any()
    assert (a != d).any()
