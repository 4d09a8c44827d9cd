"""The types of a map's columns are read from their hints, whatever shape numpy gives these."""

import numpy as np
import pytest
from numpy.typing import NDArray
from typing_extensions import TypeAliasType, TypeVar

from skidpad.roads.checked import KINDS, element_type
from skidpad.roads.lanes import LaneSamples

T = TypeVar("T", bound=np.generic)
# how numpy 2.5 defines NDArray on Python 3.12: `type NDArray[T: generic] = ndarray[..., dtype[T]]`
ALIAS = TypeAliasType("ALIAS", np.ndarray[tuple[int, ...], np.dtype[T]], type_params=(T,))


@pytest.mark.parametrize("kind", [np.float64, np.int32, np.uint8, np.bool_])
def test_the_element_type_of_either_shape_of_hint(kind):
    for hint in (NDArray[kind], np.ndarray[tuple[int, ...], np.dtype[kind]], ALIAS[kind]):
        assert element_type(hint) is kind
    assert KINDS[LaneSamples]["x"] == np.float64
