"""Update of a database to this version's schema with Alembic; the revisions are in `store/migrations`."""

from functools import cache
from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, inspect

from store.database.connection import AdvisoryLock, lock_until_end
from store.errors import StoreError

DEFAULT_RIG = "rig"


def configuration(connection: Connection | None = None, rig: str = DEFAULT_RIG) -> Config:
    """Alembic's configuration for the packaged revisions, on a connection that is in a transaction.

    Runs from before rigs had names become those of `rig`.
    """
    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent / "migrations").replace("%", "%%"))
    config.attributes.update(connection=connection, rig=rig)
    return config


def upgrade(connection: Connection, rig: str = DEFAULT_RIG) -> None:
    """Create the tables of an empty database, or update an older one, in the caller's transaction; `rig` as above.

    Raises StoreError if the database is of a newer or unknown revision, or holds other tables.
    """
    lock_until_end(connection, AdvisoryLock.MIGRATION)
    known = known_revisions()
    present = set(MigrationContext.configure(connection).get_current_heads())
    if present == {known[0]}:
        return
    if present - set(known):
        raise StoreError(
            f"the database is of schema revision {', '.join(sorted(present))}, which this version of jointlab does not "
            f"know (newest known: {known[0]}); update jointlab or open another database"
        )
    if not present and (tables := inspect(connection).get_table_names()):
        raise StoreError(
            f"the database holds tables that are not jointlab's ({', '.join(sorted(tables)[:5])}); "
            "give an empty database"
        )
    command.upgrade(configuration(connection, rig), "head")


def current_revision(connection: Connection) -> str | None:
    """The revision of the schema, None where there is none."""
    return MigrationContext.configure(connection).get_current_revision()


@cache
def known_revisions() -> tuple[str, ...]:
    """The revisions of this version, newest first."""
    return tuple(revision.revision for revision in ScriptDirectory.from_config(configuration()).walk_revisions())
