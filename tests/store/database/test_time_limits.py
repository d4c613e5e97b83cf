"""Every call of a database that is silent, slow or locked ends in time with an error in words."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from pydantic import ValidationError
from sqlalchemy import text

from store.catalogue import Catalogue
from store.database.time_limits import TimeLimits, deadline, seconds_left
from store.errors import StoreError, UnknownOutcomeError
from store.measurements.runs import Run, count_runs, start_run
from tests.fault_proxy import FaultProxy, Impairment, Way
from tests.store.statements import COMMIT, before

SILENT = Impairment(lost=Way.BOTH)
LIMITS = TimeLimits(connect=1.0, answer=0.4, lock=0.2, pool=0.3)
ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) FROM n"

LOCKS = {"sqlite": "DELETE FROM jobs", "postgresql": "LOCK TABLE runs IN ACCESS EXCLUSIVE MODE"}


@pytest.fixture
def distant(distant_url: str, tmp_path: Path) -> Iterator[Catalogue]:
    with Catalogue.open(distant_url, tmp_path / "waveforms", LIMITS) as opened:
        yield opened


def _start(opened: Catalogue) -> Run:
    with opened.writing() as session:
        return start_run(session, kind="hammer", title="t", article="a", setup={})


def _count(opened: Catalogue) -> int:
    with opened.reading() as session:
        return count_runs(session)


@contextmanager
def _ends_within(seconds: float, said: str, kind: type[StoreError] = StoreError) -> Iterator[None]:
    began = time.monotonic()
    with pytest.raises(kind, match=said):
        yield
    took = time.monotonic() - began
    assert took < seconds + 1.0, f"it took {took:.1f} s"  # one second for a busy machine


# the wait for an answer, with its second of grace, and then that for a new connection, which is 2 s at least
ANSWER = LIMITS.answer + 1.0
CONNECT = 2.0


@pytest.mark.parametrize("database_kind", ["postgresql"])
@pytest.mark.parametrize("call", [_start, _count], ids=["write", "read"])
def test_a_call_ends_where_the_line_has_gone_silent(
    distant: Catalogue, proxy: FaultProxy, call: Callable[[Catalogue], object]
) -> None:
    call(distant)
    proxy.impair(SILENT)
    with _ends_within(ANSWER + CONNECT, "timeout|has not answered"):
        call(distant)
    proxy.repair()
    call(distant)


@pytest.mark.parametrize("database_kind", ["postgresql"])
def test_a_transaction_ends_where_the_line_goes_silent_in_its_middle(distant: Catalogue, proxy: FaultProxy) -> None:
    said = r"has not answered for 1\.\d s; look whether its server runs"
    with _ends_within(ANSWER, said), distant.writing() as session:
        start_run(session, kind="hammer", title="t", article="a", setup={})
        proxy.impair(SILENT)
        start_run(session, kind="hammer", title="t", article="a", setup={})
    proxy.repair()
    assert _count(distant) == 0


@pytest.mark.parametrize("database_kind", ["postgresql"])
def test_a_commit_without_an_answer_is_not_taken_for_one_that_failed(distant: Catalogue, proxy: FaultProxy) -> None:
    said = "look whether they are stored"
    with (
        before(lambda seen: seen[-1] == COMMIT, lambda _: proxy.impair(SILENT)),
        _ends_within(ANSWER + CONNECT + LIMITS.answer, said, UnknownOutcomeError),
        distant.writing() as session,
    ):
        start_run(session, kind="hammer", title="t", article="a", setup={})
    proxy.repair()
    assert _count(distant) == 0


@pytest.mark.parametrize("database_kind", ["postgresql"])
def test_an_opening_ends_where_the_server_accepts_and_says_nothing(
    distant_url: str, proxy: FaultProxy, tmp_path: Path
) -> None:
    proxy.impair(SILENT)
    with _ends_within(CONNECT, "has not answered"):
        Catalogue.open(distant_url, tmp_path, LIMITS)


@pytest.mark.parametrize("database_kind", ["postgresql"])
def test_a_deadline_is_kept_where_the_line_goes_silent(distant: Catalogue, proxy: FaultProxy) -> None:
    with _ends_within(0.2, "has not answered"), deadline(0.2), distant.reading() as session:
        count_runs(session)
        proxy.impair(SILENT)
        count_runs(session)


def test_a_statement_that_takes_too_long_ends_and_the_next_one_is_answered(distant: Catalogue) -> None:
    with _ends_within(ANSWER, "longer than it may"), distant.reading() as session:
        session.execute(text(ENDLESS))
    assert _start(distant).id == 1
    with _ends_within(0.1, "longer than it may|has not answered"), deadline(0.1), distant.reading() as session:
        session.execute(text(ENDLESS))
    assert _count(distant) == 1


def test_long_work_may_take_longer_and_the_next_transaction_may_not(distant: Catalogue) -> None:
    longer = ENDLESS.replace("FROM n)", "FROM n WHERE i < 3000000)")
    with distant.reading(long=True) as session:
        assert session.scalar(text(longer)) == 3_000_000
    with _ends_within(ANSWER, "longer than it may"), distant.reading() as session:
        session.execute(text(ENDLESS))


def test_a_writer_that_waits_for_another_ends_in_time_and_earlier_by_a_deadline(distant: Catalogue) -> None:
    with distant.writing() as other:
        other.execute(text(LOCKS[other.get_bind().dialect.name]))
        with _ends_within(LIMITS.lock, "another program is writing"):
            _start(distant)
        with _ends_within(0.05, "another program is writing|has not answered"), deadline(0.05):
            _start(distant)
    assert _start(distant).id > 0


def test_a_thread_waits_no_longer_than_it_may_for_a_connection(distant: Catalogue) -> None:
    held = [distant.reading() for _ in range(15)]
    try:
        for each in held:
            count_runs(each.__enter__())
        with _ends_within(LIMITS.pool, "all connections are in use"):
            _count(distant)
    finally:
        for each in held:
            each.__exit__(None, None, None)
    assert _count(distant) == 0


@pytest.mark.parametrize("database_kind", ["postgresql"])
def test_a_server_ends_the_transaction_of_a_program_that_says_nothing(distant_url: str, tmp_path: Path) -> None:
    with Catalogue.open(distant_url, tmp_path, TimeLimits(idle=0.1)) as distant:
        with _ends_within(0.4, "idle"), distant.writing() as session:
            start_run(session, kind="hammer", title="t", article="a", setup={})
            time.sleep(0.4)  # the server's clock decides
            count_runs(session)
        assert _count(distant) == 0


def test_an_earlier_deadline_stays() -> None:
    with deadline(0.1), deadline(5.0):
        assert seconds_left(9.0) <= 0.1
    assert seconds_left(9.0) == 9.0


def test_a_limit_that_is_none_is_refused() -> None:
    with pytest.raises(ValidationError, match="greater than 0"):
        TimeLimits(answer=0.0)
