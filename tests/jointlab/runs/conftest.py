"""An empty catalogue on both databases."""

from tests.store.conftest import (
    catalogue,
    database_kind,
    database_url,
    distant_url,
    postgresql,
    proxy,
    sqlite_template,
)

__all__ = [
    "catalogue",
    "database_kind",
    "database_url",
    "distant_url",
    "postgresql",
    "proxy",
    "sqlite_template",
]
