"""A fleet on each store, and people of two operators and two makers."""

from __future__ import annotations

import pytest

pytest.importorskip("fastapi", reason="skidpad[fleet] is not installed")

from support.fleet_world import World, make_world, postgresql_server


@pytest.fixture(scope="session")
def postgresql(tmp_path_factory):
    """Address of a PostgreSQL of our own, run by an unprivileged user and reached by a socket."""
    yield from postgresql_server()


@pytest.fixture(params=["sqlite", "postgresql"])
def database(request, tmp_path):
    """Address of an empty database; None for the file in the data folder."""
    if request.param == "sqlite":
        return None
    server = request.getfixturevalue("postgresql")
    return server.fresh()


@pytest.fixture
def world(database, tmp_path) -> World:
    """A fleet on each store."""
    one = make_world(tmp_path / "data", database)
    yield one
    one.close()


@pytest.fixture
def lite(tmp_path) -> World:
    """A fleet on SQLite, for what no store changes."""
    one = make_world(tmp_path / "data", None)
    yield one
    one.close()
