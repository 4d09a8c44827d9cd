"""A hazard is remembered to belong to a recurring one, so that its triage outlives its first alarm."""

from __future__ import annotations

from alembic import op
from sqlalchemy import inspect

from skidpad.fleet.store.appendonly import statements
from skidpad.fleet.store.later import recurrences
from skidpad.fleet.store.tables import metadata

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    """Make the table and protect it; a store of this version has it already."""
    bind = op.get_bind()
    if inspect(bind).has_table(recurrences.name):
        return
    metadata.create_all(bind, tables=[recurrences])
    for statement in statements(bind.dialect.name, [recurrences.name]):
        op.execute(statement)


def downgrade() -> None:
    """Refuses, as facts are never removed."""
    raise NotImplementedError("facts of the fleet are only ever added")
