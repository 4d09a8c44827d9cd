"""Maps that several test modules use."""

from __future__ import annotations

import pytest

from skidpad.roads.bundled import load_map
from skidpad.roads.queries import RoadMap


@pytest.fixture(scope="session")
def figure8() -> RoadMap:
    return load_map("figure8")
