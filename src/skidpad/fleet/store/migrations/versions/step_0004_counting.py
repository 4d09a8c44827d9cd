"""Hazards and drives are counted by vehicle from an index alone."""

from __future__ import annotations

from alembic import op

from skidpad.fleet.store.tables import drives, hazards

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    """Make the indexes; a store of this version has them already."""
    for table in (hazards, drives):
        for index in sorted(table.indexes, key=lambda one: str(one.name)):
            index.create(op.get_bind(), checkfirst=True)


def downgrade() -> None:
    """Facts are never removed."""
    raise NotImplementedError("facts of the fleet are only ever added")
