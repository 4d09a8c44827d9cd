"""Opening the store: SQLite in a folder, or PostgreSQL by address; its tables by Alembic."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sqlalchemy import Engine, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError, SQLAlchemyError

from skidpad.core.errors import ConfigError

BUSY_MS = 30_000  # another process may hold the file that long
SCRIPTS = str(Path(__file__).parent / "migrations")
DRIVERS = {"sqlite": "sqlite", "postgresql": "postgresql+psycopg"}


def open_engine(url: str) -> Engine:
    """Returns an engine whose commits are durable; ConfigError for an address of another kind."""
    try:
        parsed = make_url(url)
    except ArgumentError as error:
        raise ConfigError("--database must be sqlite:///FILE or postgresql://...") from error
    backend = parsed.get_backend_name()
    if backend not in DRIVERS:
        raise ConfigError(f"--database must be sqlite:/// or postgresql://, got {backend}://")
    engine = create_engine(parsed.set(drivername=DRIVERS[backend]), pool_pre_ping=True)
    if backend == "sqlite":
        event.listen(engine, "connect", _durable)
    return engine


def sqlite_url(folder: Path) -> str:
    """Returns the address of the SQLite database in a data folder."""
    return f"sqlite:///{(folder / 'fleet.sqlite').absolute()}"


def migrate(engine: Engine) -> None:
    """Brings the tables to this version; ConfigError when the database cannot be used."""
    from alembic import command
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", SCRIPTS.replace("%", "%%"))
    try:
        with engine.connect() as connection:
            config.attributes["connection"] = connection
            command.upgrade(config, "head")
            connection.commit()
    except SQLAlchemyError as error:
        raise ConfigError(f"the database cannot be used: {str(error).splitlines()[0]}") from error


def _durable(connection: Any, record: Any) -> None:
    """Sets SQLite up for durable commits on a new connection."""
    del record
    cursor = connection.cursor()
    for pragma in (
        "journal_mode=WAL",
        "synchronous=FULL",
        "foreign_keys=ON",
        f"busy_timeout={BUSY_MS}",
    ):
        cursor.execute(f"PRAGMA {pragma}")
    cursor.close()
