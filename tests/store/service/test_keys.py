"""API keys are found by their secret only; the secret is not stored."""

from datetime import UTC, datetime, timedelta

import pytest
from sqlalchemy import text

from store.catalogue import Catalogue
from store.errors import NotFoundError, StoreError
from store.service.keys import add_key, count_keys, find_key, list_keys, revoke_key
from store.states import Scope


def test_a_key_is_found_by_its_secret_and_by_nothing_else(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        made, secret = add_key(session, "bench", [Scope.READ, Scope.CONTROL])
    with catalogue.reading() as session:
        assert find_key(session, secret) == made
        assert find_key(session, secret + "x") is None
        assert find_key(session, "") is None
        assert made.scopes == {Scope.READ, Scope.CONTROL}


def test_the_secret_is_not_in_the_database(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        _, secret = add_key(session, "bench", [Scope.READ])
    with catalogue.reading() as session:
        assert secret.removeprefix("jl_") not in repr(session.execute(text("SELECT * FROM api_keys")).all())


def test_two_keys_differ_though_they_have_one_name(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        assert add_key(session, "bench", [Scope.READ])[1] != add_key(session, "bench", [Scope.READ])[1]
        assert count_keys(session) == 2


def test_a_key_opens_nothing_once_it_has_ended_or_is_revoked(catalogue: Catalogue) -> None:
    now = datetime.now(UTC)
    with catalogue.writing() as session:
        ending, _ = add_key(session, "ends", [Scope.READ], now + timedelta(hours=1))
        revoked = revoke_key(session, add_key(session, "revoked", [Scope.READ])[0].id)
        assert revoke_key(session, revoked.id) == revoked
    assert ending.is_valid(now)
    assert not ending.is_valid(now + timedelta(hours=2))
    assert not revoked.is_valid(now)
    with catalogue.reading() as session:
        assert [key.name for key in list_keys(session)] == ["revoked", "ends"]
        assert [key.name for key in list_keys(session, before=revoked.id)] == ["ends"]


@pytest.mark.parametrize(
    ("name", "scopes", "hours"), [(" ", [Scope.READ], 1), ("bench", [], 1), ("b", [Scope.READ], -1)]
)
def test_a_key_that_could_open_nothing_is_refused(
    catalogue: Catalogue, name: str, scopes: list[Scope], hours: int
) -> None:
    with pytest.raises(StoreError, match="key"), catalogue.writing() as session:
        add_key(session, name, scopes, datetime.now(UTC) + timedelta(hours=hours))


def test_a_key_that_is_not_there_cannot_be_revoked(catalogue: Catalogue) -> None:
    with pytest.raises(NotFoundError, match="no key 7"), catalogue.writing() as session:
        revoke_key(session, 7)
