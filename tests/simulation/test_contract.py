"""The contract holds for the embedded simulator; tests/simulation/carla_client asks the same of CARLA."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from skidpad.simulation.embedded.engine import EmbeddedBackend
from support.backend_contract import CHECKS, Make


@pytest.mark.req("L-4")
@pytest.mark.parametrize("check", CHECKS, ids=lambda c: c.__name__)
def test_embedded(check: Callable[[Make], None]) -> None:
    check(EmbeddedBackend)
