"""A look at a release is kept once."""

from __future__ import annotations

from alembic import op
from sqlalchemy import inspect

from skidpad.fleet.store.appendonly import statements
from skidpad.fleet.store.loop import looks
from skidpad.fleet.store.tables import metadata

revision = "0006"
down_revision = "0005"


def upgrade() -> None:
    """Make the table and protect it; a store of this version has it already."""
    bind = op.get_bind()
    if inspect(bind).has_table(looks.name):
        return
    metadata.create_all(bind, tables=[looks])
    for statement in statements(bind.dialect.name, [looks.name]):
        op.execute(statement)


def downgrade() -> None:
    """Facts are never removed."""
    raise NotImplementedError("facts of the fleet are only ever added")
