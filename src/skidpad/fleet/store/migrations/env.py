"""What Alembic runs: the connection is handed in by `store.engine.migrate`."""

from __future__ import annotations

from alembic import context

from skidpad.fleet.store.tables import metadata

context.configure(connection=context.config.attributes["connection"], target_metadata=metadata)
with context.begin_transaction():
    context.run_migrations()
