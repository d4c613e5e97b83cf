"""Alembic's environment: revisions run on the connection and in the transaction that the caller gives."""

from alembic import context

from store.models.base import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    render_as_batch=True,
    transactional_ddl=True,
)
context.run_migrations()
