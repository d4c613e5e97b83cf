"""The service in front of an empty catalogue, of the demo's, and of a simulated rig; keys for it."""

import shutil
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from datetime import UTC, datetime, timedelta
from itertools import count
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from sqlalchemy import update

from api.service import deadlines
from api.service.application import create_app
from api.service.context import Services
from api.service.server import make_server
from jointlab.drive.phase import Phase
from jointlab.drive.process import driving
from jointlab.settings import DriveSettings, Settings
from jointlab.supervision.automatic_operator import AutomaticOperator
from jointlab.supervision.manager import RunManager
from jointlab.trials.simulated_laboratory import simulated_settings
from jointlab.trials.simulated_operator import SimulatedOperator
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from store.catalogue import Catalogue
from store.database.time_limits import TimeLimits
from store.models.service import ApiKeyRow
from store.service.keys import add_key, revoke_key
from store.states import Scope
from tests.waiting import LONG

deadlines.LONGEST_LOOKUP = LONG  # a busy machine has more patience than people
PROBLEM = "application/problem+json"
MakeKey = Callable[..., str]
Acting = Callable[..., dict[str, Any]]


@contextmanager
def served(app: FastAPI, **options: Any) -> Iterator[httpx.Client]:
    """A client of the application on a real server with these options, in a thread."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        server = make_server(app, grace=1, **options)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        scheme = "https" if options.get("tls") else "http"
        address = f"{scheme}://127.0.0.1:{listener.getsockname()[1]}"
        try:
            with httpx.Client(base_url=address, timeout=LONG) as client:
                yield client
        finally:
            server.should_exit = True
            thread.join()


@pytest.fixture
def impatient() -> None:
    """Writers wait for each other for 0.05 s instead of ten."""


@pytest.fixture
def catalogue(sqlite_template: Path, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Catalogue]:
    if not (tmp_path / "jointlab.db").exists():  # as where a test has the demo's
        shutil.copy(sqlite_template, tmp_path / "jointlab.db")
    limits = TimeLimits(lock=0.05) if "impatient" in request.fixturenames else TimeLimits()
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}", limits=limits) as opened:
        yield opened


@pytest.fixture
def client(catalogue: Catalogue) -> Iterator[httpx.Client]:
    """A service that drives no rig, open to everybody at the computer."""
    with served(create_app(Services(catalogue))) as client:
        yield client


@pytest.fixture
def rig_settings(laboratory: Laboratory, tmp_path: Path) -> Settings:
    """Settings of a rig on simulated instruments."""
    return simulated_settings(laboratory.addresses, drive=DriveSettings(folder=tmp_path / "drive", stop_port=0))


@contextmanager
def managing(
    catalogue: Catalogue, settings: Settings, operator: AutomaticOperator | None = None
) -> Iterator[RunManager]:
    """A run manager, and all that a drive process has, in this process, which is quicker to start."""
    with driving(settings), closing(RunManager(catalogue, settings, operator, starts=False)) as manager:
        yield manager
        if manager.state.phase is not Phase.IDLE:
            manager.stop()


@pytest.fixture
def rig(catalogue: Catalogue, laboratory: Laboratory, rig_settings: Settings) -> Iterator[RunManager]:
    """A run manager on simulated instruments."""
    with (
        closing(OperatorClient(laboratory.addresses.operator)) as hand,
        managing(catalogue, rig_settings, SimulatedOperator(hand)) as manager,
    ):
        yield manager


@pytest.fixture
def rig_client(catalogue: Catalogue, rig: RunManager) -> Iterator[httpx.Client]:
    """A service that drives a simulated rig."""
    with served(create_app(Services(catalogue, rig))) as client:
        yield client


def make_key_in(catalogue: Catalogue) -> MakeKey:
    """Make keys with these scopes; each may have ended or be revoked."""

    def make(*scopes: Scope, ended: bool = False, revoked: bool = False) -> str:
        with catalogue.writing() as session:
            key, secret = add_key(session, "test", scopes, datetime.now(UTC) + timedelta(hours=1))
            if revoked:
                revoke_key(session, key.id)
            if ended:
                past = datetime.now(UTC) - timedelta(seconds=1)
                session.execute(update(ApiKeyRow).where(ApiKeyRow.id == key.id).values(expires_at=past))
        return secret

    return make


@pytest.fixture
def make_key(catalogue: Catalogue) -> MakeKey:
    return make_key_in(catalogue)


@pytest.fixture
def acting() -> Acting:
    """Headers of a request that acts: a new idempotency key, and what else is given."""
    numbers = count(1)

    def headers(secret: str | None = None, lease: str | None = None) -> dict[str, Any]:
        given = {"Idempotency-Key": f"test-{next(numbers)}"}
        given |= {} if secret is None else {"Authorization": f"Bearer {secret}"}
        return given | ({} if lease is None else {"Control-Lease": lease})

    return headers
