"""Views for other programs: CARLA's depth code and CityScapes colours."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis.strategies import floats

from skidpad.core.vocabulary import SemanticClass
from skidpad.sensors.encodings import (
    cityscapes_colours,
    decode_carla_depth,
    encode_carla_depth,
    vehicle_mask,
)

STEP = 1000.0 / (256**3 - 1)


@pytest.mark.req("A-033")
@given(floats(0.05, 999.0))
def test_depth_survives_its_code_to_half_a_step(metres):
    inverse = np.array([[1.0 / metres]], dtype=np.float32)
    exact = 1.0 / float(inverse[0, 0])
    assert decode_carla_depth(encode_carla_depth(inverse))[0, 0] == pytest.approx(exact, abs=STEP)


@pytest.mark.req("A-033")
def test_low_byte_is_red_and_nothing_is_a_thousand_metres():
    code = encode_carla_depth(np.array([[0.0, 1.0 / (300 * STEP)]], dtype=np.float32))
    assert code[0, 0].tolist() == [255, 255, 255]
    assert code[0, 1].tolist() == [300 - 256, 1, 0]


@pytest.mark.req("A-034", "A-035")
def test_vehicle_colours_are_as_published_and_the_only_ones_in_the_mask():
    labels = np.arange(29, dtype=np.uint8)[None]
    colours = cityscapes_colours(labels)[0]
    assert colours[SemanticClass.CAR].tolist() == [0, 0, 142]
    assert colours[SemanticClass.TRUCK].tolist() == [0, 0, 70]
    assert colours[SemanticClass.BUS].tolist() == [0, 60, 100]
    assert len({tuple(c) for c in colours}) == 29
    seen = {SemanticClass(int(i)) for i in np.flatnonzero(vehicle_mask(colours))}
    assert seen == {SemanticClass.CAR, SemanticClass.TRUCK, SemanticClass.BUS}
