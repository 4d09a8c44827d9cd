"""Triggers by which the database itself refuses to change or remove a fact."""

from __future__ import annotations

from collections.abc import Iterable

REFUSE = "facts of the fleet are only ever added"
POSTGRESQL = f"""
CREATE OR REPLACE FUNCTION fleet_refuse() RETURNS trigger AS $$
BEGIN RAISE EXCEPTION '{REFUSE}'; END;
$$ LANGUAGE plpgsql
"""


def statements(dialect: str, tables: Iterable[str]) -> list[str]:
    """Returns the SQL that forbids change and removal of rows of `tables`, for "sqlite" or PostgreSQL."""
    if dialect == "sqlite":
        return [
            f"CREATE TRIGGER {table}_no_{verb.lower()} BEFORE {verb} ON {table} "
            f"BEGIN SELECT RAISE(ABORT, '{REFUSE}'); END"
            for table in tables
            for verb in ("UPDATE", "DELETE")
        ]
    return [POSTGRESQL] + [
        f"CREATE TRIGGER {table}_only_added BEFORE UPDATE OR DELETE OR TRUNCATE ON {table} "
        "FOR EACH STATEMENT EXECUTE FUNCTION fleet_refuse()"
        for table in tables
    ]
