"""Motion blur and bloom of pictures: ways and sums by hand."""

import numpy as np
import pytest

from skidpad.sensors.pictures.bloom import STAGES, add_bloom
from skidpad.sensors.pictures.motion_blur import smear

WHITE, BLACK = 0xFFFFFFFF, 0xFF000000


def grey(picture):
    """Linear light of a packed picture without colour, 1 being white."""
    return (picture.view(np.uint8).reshape(*picture.shape, 4)[..., 0] / 255.0) ** 2


def smeared(picture, right, up, share=1.0, longest=1e9):
    """A picture that moved so many pixels right and up since the last."""
    height, width = picture.shape
    flow = np.zeros((height, width, 2), dtype=np.float32)
    flow[..., 0], flow[..., 1] = right / (0.5 * width), up / (0.5 * height)
    out = np.empty_like(picture)
    smear(flow, share, longest, picture, out)
    return out


def edge(height=40, width=200):
    picture = np.full((height, width), BLACK, dtype=np.uint32)
    picture[:, width // 2 :] = WHITE
    return picture


@pytest.mark.parametrize("way", [5.0, 12.0, -20.0])
def test_an_edge_is_as_wide_as_the_way(way):
    """Light rises evenly over the way, and its middle stays where the edge is."""
    light = grey(smeared(edge(), way, 0.0))[20]
    mixed = (light > 0.02) & (light < 0.98)
    assert abs(mixed.sum() - abs(way)) <= 2.5
    assert light.sum() == pytest.approx(100.0, abs=0.6)
    assert (np.diff(light) > -1e-6).all()


def test_a_way_upwards_blurs_rows_only():
    assert np.array_equal(smeared(edge(), 0.0, 9.0), edge())
    lying = np.ascontiguousarray(edge(200, 200).T)
    light = grey(smeared(lying, 0.0, 9.0))[:, 20]
    assert abs(((light > 0.02) & (light < 0.98)).sum() - 9) <= 2.5


def test_share_and_limit_shorten_the_way():
    for shown in (smeared(edge(), 20.0, 0.0, 0.4), smeared(edge(), 50.0, 0.0, 1.0, 8.0)):
        light = grey(shown)[20]
        assert abs(((light > 0.02) & (light < 0.98)).sum() - 8) <= 2.5


def test_what_stands_stays_as_it_is():
    rng = np.random.default_rng(1)
    picture = rng.integers(0, 2**32, (40, 60), dtype=np.uint32) | np.uint32(BLACK)
    assert np.array_equal(smeared(picture, 0.4, -0.4), picture)


def test_bloom_of_an_even_picture_is_its_sum_of_tints():
    picture = np.full((60, 80), 0xFF808080, dtype=np.uint32)
    before = grey(picture).mean()
    add_bloom(2.0, picture)
    more = 2.0 * sum(tint for tint, _ in STAGES) / len(STAGES)
    assert grey(picture).mean() == pytest.approx(before * (1.0 + more), rel=0.02)
    assert np.ptp(grey(picture)) < 0.01


def test_bloom_shines_beside_a_lamp_and_falls_off():
    picture = np.full((120, 160), BLACK, dtype=np.uint32)
    picture[55:65, 75:85] = WHITE
    plain = picture.copy()
    add_bloom(5.0, picture)
    light = grey(picture)[60]
    assert light[86] > light[95] > light[120] > 0.0
    assert np.array_equal(grey(picture)[55:65, 75:85], grey(plain)[55:65, 75:85])
    assert np.allclose(light[:80], light[80:][::-1], atol=0.02)
