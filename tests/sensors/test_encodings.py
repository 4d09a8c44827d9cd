"""Views for other programs: CityScapes colours."""

import numpy as np
import pytest

from skidpad.core.vocabulary import SemanticClass
from skidpad.sensors.pictures.encodings import (
    cityscapes_colours,
    vehicle_mask,
)


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
