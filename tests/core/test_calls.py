"""Machine code is found by the types that numba gives to arguments, which are told apart as numba does."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from skidpad.core.kernels.calls import describe_type
from skidpad.core.kernels.jit import kernel


class One(NamedTuple):
    x: float


class Other(NamedTuple):
    y: float


@kernel
def first(x: float) -> float:
    return x


PLAIN = np.zeros((4, 4))
FROZEN = PLAIN.copy()
FROZEN.flags.writeable = False


@pytest.mark.parametrize(
    ("some", "others"),
    [
        (PLAIN.T, PLAIN[::2, ::2]),
        (PLAIN, PLAIN.T),
        (PLAIN, FROZEN),
        (PLAIN, PLAIN.astype(np.float32)),
        (PLAIN[0], PLAIN),
        (One(1.0), Other(1.0)),
        (One(1.0), (1.0,)),
        (1, 1.0),
    ],
)
def test_what_numba_tells_apart_has_machine_code_of_its_own(some: object, others: object) -> None:
    typeof = first.typeof_pyval  # type: ignore[attr-defined]
    assert typeof(some) != typeof(others)
    assert describe_type(some) != describe_type(others)
