"""CARLA's depth code against the published formula."""

import numpy as np
import pytest

from skidpad.core.kernels.depthcode import bgra_from_inverse_depth, inverse_depth_from_bgra

STEP = 1000.0 / 16777215  # m


def coded(metres):
    with np.errstate(divide="ignore"):
        inverse = np.float32(1.0) / np.array([metres], dtype=np.float32)
    out = np.zeros((*inverse.shape, 4), dtype=np.uint8)
    bgra_from_inverse_depth(inverse, out)
    return out


@pytest.mark.req("A-033")
def test_depth_survives_its_code_to_half_a_step():
    metres = np.geomspace(0.05, 999.0, 5000)
    back = np.zeros((1, metres.size), dtype=np.float32)
    inverse_depth_from_bgra(coded(metres), back)
    rounded = 3e-7 * metres  # by single precision, there and back
    assert (np.abs(1.0 / back[0] - metres) <= 0.5 * STEP + rounded).all()


@pytest.mark.req("A-033")
def test_low_byte_is_red_and_nothing_is_a_thousand_metres():
    (pixels,) = coded([np.inf, 300 * STEP])
    assert pixels[0].tolist() == [255, 255, 255, 255]
    assert pixels[1].tolist() == [0, 1, 300 - 256, 255]


@pytest.mark.req("A-033")
def test_depth_is_what_the_published_formula_says():
    bgra = np.random.default_rng(3).integers(0, 256, (6, 8, 4)).astype(np.uint8)
    b, g, r = (bgra[..., k].astype(np.float64) for k in range(3))
    out = np.zeros((6, 8), dtype=np.float32)
    inverse_depth_from_bgra(bgra, out)
    assert 1.0 / out == pytest.approx(1000.0 * (r + 256.0 * g + 65536.0 * b) / 16777215, rel=1e-6)
    inverse_depth_from_bgra(np.full((6, 8, 4), 255, np.uint8), out)
    assert (out == 0.0).all()
