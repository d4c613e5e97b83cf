"""An empty catalogue on both databases, and a whole simulated laboratory with a small sequence."""

from tests.rig.conftest import (
    channel_table,
    document,
    instruments,
    person,
    repair,
    running_laboratory,
    sequence,
    whole_laboratory,
)
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
    "channel_table",
    "database_kind",
    "database_url",
    "distant_url",
    "document",
    "instruments",
    "person",
    "postgresql",
    "proxy",
    "repair",
    "running_laboratory",
    "sequence",
    "sqlite_template",
    "whole_laboratory",
]
