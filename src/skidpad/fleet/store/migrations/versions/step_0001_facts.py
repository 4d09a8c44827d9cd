"""Tenants, vehicles, people, credentials, batches, hazards, drives, events."""

from __future__ import annotations

from alembic import op

from skidpad.fleet.store.appendonly import statements
from skidpad.fleet.store.tables import FACTS, metadata

revision = "0001"
down_revision = None


def upgrade() -> None:
    """Make the tables and protect them."""
    bind = op.get_bind()
    metadata.create_all(bind, tables=list(FACTS))
    for statement in statements(bind.dialect.name, [table.name for table in FACTS]):
        op.execute(statement)


def downgrade() -> None:
    """Facts are never removed."""
    raise NotImplementedError("facts of the fleet are only ever added")
