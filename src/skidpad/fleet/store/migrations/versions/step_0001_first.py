"""All tables of the first version. Later versions add steps; this one then names its tables."""

from __future__ import annotations

from alembic import op

from skidpad.fleet.store.appendonly import statements
from skidpad.fleet.store.tables import metadata

revision = "0001"
down_revision = None


def upgrade() -> None:
    """Makes the tables and the triggers that protect them."""
    bind = op.get_bind()
    metadata.create_all(bind)
    for statement in statements(bind.dialect.name, metadata.tables):
        op.execute(statement)


def downgrade() -> None:
    """Raises NotImplementedError, as facts are never removed."""
    raise NotImplementedError("facts of the fleet are only ever added")
