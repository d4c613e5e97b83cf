"""Keys that were looked up a moment ago are known to reads, and to nothing that acts."""

from collections.abc import Iterator

import httpx
import pytest
from sqlalchemy import event
from sqlalchemy.orm import Session

from api.service.application import create_app
from api.service.context import Services
from api.service.recent_keys import MOST, READS_FOR, RecentKeys
from store.catalogue import Catalogue
from store.service.keys import find_key, revoke_key
from store.states import Scope
from tests.api.service.conftest import Acting, MakeKey, served
from tests.clock import Clock


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def client(catalogue: Catalogue, clock: Clock) -> Iterator[httpx.Client]:
    with served(create_app(Services(catalogue, recent_keys=RecentKeys(clock)))) as client:
        yield client


@pytest.fixture
def lookups(catalogue: Catalogue) -> Iterator[list[str]]:
    """The statements that have read keys."""
    seen: list[str] = []

    def note(_connection: object, _cursor: object, statement: str, *_rest: object) -> None:
        if "FROM api_keys" in statement:
            seen.append(statement)

    with catalogue.reading() as session:
        engine = session.connection().engine
    event.listen(engine, "before_cursor_execute", note)
    yield seen
    event.remove(engine, "before_cursor_execute", note)


def revoked_elsewhere(session: Session, secret: str) -> None:
    found = find_key(session, secret)
    assert found is not None
    revoke_key(session, found.id)


def test_reads_within_a_moment_look_their_key_up_once(
    client: httpx.Client, clock: Clock, make_key: MakeKey, lookups: list[str]
) -> None:
    bearer = {"Authorization": f"Bearer {make_key(Scope.READ)}"}
    for _ in range(5):
        assert client.get("/api/runs", headers=bearer).status_code == 200
    assert len(lookups) == 1
    clock.now += READS_FOR + 0.1
    client.get("/api/runs", headers=bearer)
    assert len(lookups) == 2


def test_a_key_that_another_program_revoked_acts_no_more_and_reads_for_a_moment(
    client: httpx.Client, clock: Clock, make_key: MakeKey, catalogue: Catalogue, acting: Acting
) -> None:
    make_key(Scope.ADMIN)
    secret = make_key(Scope.ADMIN, Scope.READ)
    bearer = {"Authorization": f"Bearer {secret}"}
    assert client.get("/api/runs", headers=bearer).status_code == 200
    with catalogue.writing() as session:
        revoked_elsewhere(session, secret)
    body = {"name": "another", "scopes": ["admin"]}
    assert client.post("/api/keys", json=body, headers=acting(secret)).status_code == 401
    clock.now += READS_FOR + 0.1
    assert client.get("/api/runs", headers=bearer).status_code == 401


def test_a_key_that_ends_reads_no_more_although_it_was_just_looked_up(catalogue: Catalogue, make_key: MakeKey) -> None:
    services = Services(catalogue, recent_keys=RecentKeys(Clock()))
    secret = make_key(Scope.READ)
    with served(create_app(services)) as client:
        bearer = {"Authorization": f"Bearer {secret}"}
        assert client.get("/api/runs", headers=bearer).status_code == 200
    key = services.recent_keys.get(secret)
    assert key is not None
    end = key.expires_at
    assert end is not None
    late = Services(catalogue, recent_keys=services.recent_keys, now=lambda: end)
    with served(create_app(late)) as client:
        assert client.get("/api/runs", headers=bearer).status_code == 401


def test_few_keys_are_kept(catalogue: Catalogue, make_key: MakeKey) -> None:
    secret = make_key(Scope.READ)
    with catalogue.reading() as session:
        key = find_key(session, secret)
    assert key is not None
    recent = RecentKeys(Clock())
    for number in range(MOST + 1):
        recent.add(str(number), key)
    assert [recent.get(str(number)) for number in (0, MOST - 1, MOST)] == [None, None, key]
