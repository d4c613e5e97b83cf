"""PostgreSQL's own programs for copying a database: pg_dump and pg_restore."""

import os
import shutil
import subprocess
from pathlib import Path

from sqlalchemy import URL, Connection, text

from store.errors import StoreError

_INSTALLED = Path("/usr/lib/postgresql")


def dump(connection: Connection, target: Path) -> None:
    """Write the state that the transaction sees to a file, in pg_dump's custom format; StoreError if that fails."""
    snapshot = connection.scalar(text("SELECT pg_export_snapshot()"))
    _run(connection, "pg_dump", "--format=custom", f"--snapshot={snapshot}", f"--file={target}")


def load(connection: Connection, source: Path) -> None:
    """Read a file of `dump` into the connection's empty database, all or nothing; StoreError if that fails."""
    options = ("--single-transaction", "--exit-on-error", "--no-owner", "--no-privileges")
    _run(connection, "pg_restore", *options, str(source))


def _run(connection: Connection, name: str, *arguments: str) -> None:
    url = connection.engine.url
    # Without its password, which other users could read in the list of processes.
    address = URL.create("postgresql", url.username, None, url.host, url.port, url.database, url.query)
    command = [_program(name), f"--dbname={address.render_as_string()}", "--no-password", *arguments]
    environment = {**os.environ, "LC_ALL": "C", **({"PGPASSWORD": url.password} if url.password else {})}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        said = " ".join(done.stderr.split())
        raise StoreError(f"{name} failed ({said}); its version must not be older than the server's")


def _program(name: str) -> str:
    on_path = shutil.which(name)
    if on_path is not None:
        return on_path
    installed = sorted(_INSTALLED.glob(f"*/bin/{name}"), key=lambda path: float(path.parts[-3]))
    if not installed:
        raise StoreError(
            f"{name} is neither on PATH nor in {_INSTALLED}; install PostgreSQL's client programs "
            "(Debian: apt-get install postgresql-client) and try again"
        )
    return str(installed[-1])
