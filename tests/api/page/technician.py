"""What a technician has in front of them: the service, and a tab of a browser that shows it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit

import httpx
from playwright.sync_api import Page, Request

from jointlab.client import Client
from store.catalogue import Catalogue
from store.service.keys import add_key
from store.states import Scope
from tests.drive_holder import end_drive_process
from tests.ports import free_port
from tests.waiting import LONG, until

ROOT = Path(__file__).resolve().parents[3]
SERVE = "from api.cli import main; from api.service import deadlines; deadlines.LONGEST_LOOKUP = {}; main()"


@dataclass
class Service:
    """`jointlab serve` on one port, that can be killed and started again.

    Attributes:
        folder: where the configuration is, and the database where `database` is empty.
        key: opens everything.
        patience: seconds that a request waits for the lookup of its key; people wait 5 s, a busy machine needs more.
    """

    folder: Path
    port: int = 0
    key: str = ""
    database: str = ""
    patience: float = LONG
    _process: subprocess.Popen[bytes] | None = None

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def __post_init__(self) -> None:
        self.database = self.database or f"sqlite:///{self.folder / 'jointlab.db'}"

    @property
    def waveforms(self) -> Path:
        return self.folder / "jointlab-waveforms"

    def start(self) -> None:
        """Start it; returns when it answers."""
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("JOINTLAB_", "PYTEST"))}
        where = {
            "JOINTLAB_DATABASE_URL": self.database,
            "JOINTLAB_WAVEFORM_FOLDER": str(self.waveforms),
            "JOINTLAB_CONFIG": str(self.folder / "jointlab.toml"),
        }
        self._process = process = subprocess.Popen(
            [sys.executable, "-c", SERVE.format(self.patience), "serve", f"--port={self.port}"],
            env=kept | where,
            stdout=subprocess.DEVNULL,
            cwd=ROOT,
        )
        until = time.monotonic() + LONG
        while time.monotonic() < until:
            assert process.poll() is None, "the service ended by itself"
            try:
                httpx.get(f"{self.address}/api/health", timeout=LONG)
            except httpx.TransportError:
                time.sleep(0.1)
                continue
            return
        raise AssertionError(f"the service does not answer within {LONG:g} s")

    def leave(self) -> None:
        """Stop the present run, and free the lease for the next test."""
        with Client(self.address, self.key) as lab:
            lab.stop()
            with lab.driving("end of the test", by_force=True) as driver:
                driver.reset_stop()

    @contextmanager
    def browser(self, key: str = "") -> Iterator[httpx.Client]:
        """A browser without scripts that is logged in, with the service's own key where none is given."""
        with httpx.Client(base_url=self.address, timeout=LONG) as client:
            # after a flood from this address, it has to wait for a token
            until(lambda: client.post("/page/log-in", data={"key": key or self.key}).status_code == 303)
            yield client

    def kill(self) -> None:
        """End it as a power cut would."""
        assert self._process is not None
        self._process.kill()
        self._process.wait()

    def stop(self) -> None:
        """End it in order."""
        assert self._process is not None
        self._process.terminate()
        self._process.wait(LONG)


@contextmanager
def serving(folder: Path, database: str = "", patience: float = LONG) -> Iterator[Service]:
    """A service on the database and configuration of `folder`, with a key."""
    service = Service(folder, free_port(), database=database, patience=patience)
    with Catalogue.open(service.database, service.waveforms) as catalogue, catalogue.writing() as session:
        service.key = add_key(session, "technician", Scope)[1]
    try:
        service.start()
        yield service
    finally:
        service.stop()
        end_drive_process(folder)


@dataclass
class Tab:
    """One tab of the browser, and every request that it made.

    Attributes:
        page: Playwright's.
        hosts: that were asked for anything.
        errors: that the page's scripts had.
    """

    page: Page
    service: Service
    hosts: set[str] = field(default_factory=set)
    errors: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.page.on("request", self._note)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))

    def _note(self, request: Request) -> None:
        parts = urlsplit(request.url)
        if parts.scheme not in ("data", "blob"):
            self.hosts.add(parts.hostname or "")

    def beside(self) -> Tab:
        """Another tab of the same browser."""
        return Tab(self.page.context.new_page(), self.service)

    def go(self, path: str) -> Page:
        """Open a path of the page."""
        self.page.goto(f"{self.service.address}{path}")
        return self.page

    def get(self, path: str) -> httpx.Response:
        """Ask the service for something with the technician's key."""
        return httpx.get(f"{self.service.address}{path}", headers=self._key(), timeout=LONG)

    def put(self, path: str, document: object) -> None:
        """Keep a document at the service."""
        headers = self._key() | {"Idempotency-Key": path}
        httpx.put(f"{self.service.address}{path}", json=document, headers=headers, timeout=LONG).raise_for_status()

    def _key(self) -> dict[str, str]:
        return {"Authorization": f"Bearer {self.service.key}"}

    def log_in(self) -> Page:
        """Log in with the key, as a person does."""
        page = self.go("/page/")
        page.get_by_label("Key").fill(self.service.key)
        page.get_by_role("button", name="Log in").click()
        page.get_by_role("heading", name="Dashboard").wait_for()
        return page
