"""A real PostgreSQL server on a Unix socket in a temporary folder, for tests and benchmarks."""

import os
import pwd
import shutil
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import mkdtemp
from urllib.parse import quote

import psycopg
from psycopg import sql


class NotInstalledError(Exception):
    """The programs of PostgreSQL are not on this machine."""


class Server:
    """A running server; `url` is for one of its databases."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def url(self, database: str) -> str:
        return f"postgresql://postgres@/{database}?host={quote(str(self.folder))}"

    def connect(self, database: str = "postgres") -> psycopg.Connection[tuple[object, ...]]:
        return psycopg.connect(host=str(self.folder), user="postgres", dbname=database, autocommit=True)

    def send(self, number: signal.Signals) -> None:
        """Send a signal to every process of the server; SIGSTOP makes a database that accepts and answers nothing."""
        first = int((self.folder / "data" / "postmaster.pid").read_text().splitlines()[0])
        for process in (first, *map(int, Path(f"/proc/{first}/task/{first}/children").read_text().split())):
            with suppress(ProcessLookupError):  # one that ends once the first goes on
                os.kill(process, number)

    def execute(self, statement: str, *names: str) -> None:
        with self.connect() as connection:
            connection.execute(sql.SQL(statement).format(*map(sql.Identifier, names)))


@contextmanager
def running_server(*, durable: bool = False) -> Iterator[Server]:
    """Start a server without synchronisation, and stop and remove it at the end.

    A `durable` one loses no commit where its processes are killed; other ones may.

    It refuses to run as root, so root hands it to an ordinary user.

    Raises:
        NotInstalledError: there is no PostgreSQL here.
    """
    initdb, pg_ctl = _program("initdb"), _program("pg_ctl")
    folder = Path(mkdtemp(prefix="jl-pg-"))
    as_user: tuple[str, ...] = ()
    if os.geteuid() == 0:
        names = {entry.pw_name: entry for entry in pwd.getpwall()}
        entry = names.get("postgres") or names["nobody"]
        os.chown(folder, entry.pw_uid, entry.pw_gid)
        # A program changes the user, as Python would fork for it, and gRPC's threads of a test do not survive a fork.
        as_user = ("setpriv", f"--reuid={entry.pw_uid}", f"--regid={entry.pw_gid}", "--clear-groups")

    def run(*command: str) -> None:
        done = subprocess.run(
            (*as_user, *command),
            cwd=folder,
            env={**os.environ, "HOME": str(folder), "LC_ALL": "C"},
            check=False,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stdout + done.stderr

    commit = "on" if durable else "off"
    options = f"-k {folder} -c listen_addresses= -c fsync=off -c synchronous_commit={commit} -c full_page_writes=off"
    try:
        run(initdb, "-D", str(folder / "data"), "-A", "trust", "-U", "postgres", "-E", "UTF8", "--no-sync")
        run(pg_ctl, "-D", str(folder / "data"), "-w", "-l", str(folder / "log"), "-o", options, "start")
        try:
            yield Server(folder)
        finally:
            run(pg_ctl, "-D", str(folder / "data"), "-m", "fast", "stop")
    finally:
        shutil.rmtree(folder)


def _program(name: str) -> str:
    versions = sorted(Path("/usr/lib/postgresql").glob(f"*/bin/{name}"), key=lambda path: float(path.parts[-3]))
    found = shutil.which(name) or (str(versions[-1]) if versions else None)
    if found is None:
        raise NotInstalledError(f"PostgreSQL's {name} is neither on PATH nor in /usr/lib/postgresql")
    return found
