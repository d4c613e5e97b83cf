"""Sessions of the page: found by their secret until they end."""

from datetime import UTC, datetime, timedelta

from sqlalchemy import text

from store.catalogue import Catalogue
from store.service.keys import KEPT, add_key, begin_page_session, end_page_session, key_of_page_session
from store.states import Scope

NOW = datetime(2026, 11, 23, 12, tzinfo=UTC)
HOUR = timedelta(hours=1)


def test_a_session_stands_for_its_key_until_it_ends(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        key, _ = add_key(session, "ann", [Scope.READ])
        secret = begin_page_session(session, key, NOW, HOUR)
        assert key_of_page_session(session, secret, NOW) == key
        assert key_of_page_session(session, secret, NOW + HOUR) is None
        assert key_of_page_session(session, secret + "x", NOW) is None
        assert key_of_page_session(session, "", NOW) is None


def test_a_session_that_is_logged_out_is_over_and_the_others_go_on(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        key, _ = add_key(session, "ann", [Scope.READ])
        first, second = (begin_page_session(session, key, NOW, HOUR) for _ in range(2))
        end_page_session(session, first, NOW)
        end_page_session(session, first, NOW + 3 * HOUR)
        assert key_of_page_session(session, first, NOW) is None
        assert key_of_page_session(session, second, NOW) == key


def test_the_secret_is_not_in_the_database_and_old_sessions_are_forgotten(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        key, _ = add_key(session, "ann", [Scope.READ])
        secret = begin_page_session(session, key, NOW, HOUR)
        assert secret not in repr(session.execute(text("SELECT * FROM page_sessions")).all())
        begin_page_session(session, key, NOW + HOUR + KEPT + HOUR, HOUR)
        assert session.scalar(text("SELECT count(*) FROM page_sessions")) == 1
