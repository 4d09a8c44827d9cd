"""An analysis belongs to a role of its tenant, and an order to one request."""

from __future__ import annotations

from alembic import op
from sqlalchemy import Column, inspect

from skidpad.fleet.store.later import analyses, orders
from skidpad.fleet.store.tables import NAME

revision = "0005"
down_revision = "0004"


def upgrade() -> None:
    """Add the columns; a store of this version has them already."""
    bind = op.get_bind()
    for table, name in ((analyses, "role"), (orders, "key")):
        if name not in {column["name"] for column in inspect(bind).get_columns(table.name)}:
            op.add_column(table.name, Column(name, NAME, nullable=True))
    for index in orders.indexes:
        index.create(bind, checkfirst=True)


def downgrade() -> None:
    """Facts are never removed."""
    raise NotImplementedError("facts of the fleet are only ever added")
