"""Changes, releases, evaluations."""

from __future__ import annotations

from alembic import op

from skidpad.fleet.store.appendonly import statements
from skidpad.fleet.store.loop import LOOP
from skidpad.fleet.store.tables import metadata

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    """Make the tables and protect them."""
    bind = op.get_bind()
    metadata.create_all(bind, tables=list(LOOP))
    for statement in statements(bind.dialect.name, [table.name for table in LOOP]):
        op.execute(statement)


def downgrade() -> None:
    """Facts are never removed."""
    raise NotImplementedError("facts of the fleet are only ever added")
