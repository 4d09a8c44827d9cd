"""Shared fixtures and options."""

from __future__ import annotations

from pathlib import Path

import pytest

TOWNS = Path(__file__).resolve().parents[2] / "shared" / "maps"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--rewrite-references", action="store_true", help="write reference recordings anew"
    )


@pytest.fixture(scope="session")
def towns() -> Path:
    """The folder with CARLA's towns as OpenDRIVE; tests that need it skip when it is absent."""
    if not TOWNS.is_dir():
        pytest.skip("CARLA's towns are not here")
    return TOWNS
