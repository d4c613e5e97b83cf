"""A connection that is lost anywhere in a transaction: tried once more, nothing stored twice, nothing lost."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from sqlalchemy import Connection, select, text
from sqlalchemy.orm import Session

from store.catalogue import Catalogue
from store.database.time_limits import TimeLimits
from store.dof import StoredDof
from store.errors import ConnectionLostError
from store.measurements.blows import Point, add_blow, add_point, list_blows
from store.measurements.runs import Run, count_runs, start_run
from tests.fault_proxy import FaultProxy, Impairment, Way
from tests.store.statements import COMMIT, before

STATEMENTS = 8  # more than a blow with its point needs


@pytest.fixture
def distant(distant_url: str, tmp_path: Path) -> Iterator[Catalogue]:
    with Catalogue.open(distant_url, tmp_path / "waveforms", TimeLimits(answer=5.0)) as opened:
        yield opened


@pytest.fixture
def run(distant: Catalogue) -> Run:
    with distant.writing() as session:
        return start_run(session, kind="hammer", title="t", article="a", setup={})


def _strike(session: Session, run: Run) -> Point:
    point = add_point(session, run.id, StoredDof(1, "y"))
    add_blow(session, point, 1, accepted=True, peak_force=100.0)
    return point


def _cut(connection: Connection) -> None:
    """Lose the connection, as a server does that is restarted."""
    lost = connection.connection.driver_connection
    assert lost is not None
    if connection.dialect.name == "postgresql":
        with connection.engine.connect() as other:
            other.execute(text(f"SELECT pg_terminate_backend({lost.info.backend_pid}, 5000)"))
    else:
        lost.close()


@pytest.mark.parametrize("number", range(1, STATEMENTS))
def test_a_transaction_whose_connection_is_lost_is_carried_out_once_more(
    distant: Catalogue, run: Run, number: int
) -> None:
    with before(lambda seen: len(seen) == number, _cut) as seen:
        stored = distant.write(lambda session: _strike(session, run))
    assert len(seen) > STATEMENTS
    with distant.reading() as session:
        (blow,) = list_blows(session, run.id)
    assert (blow.peak_force, blow.point) == (100.0, stored.dof)


def test_a_connection_that_is_lost_twice_is_an_error_and_nothing_is_stored(distant: Catalogue, run: Run) -> None:
    def strike_and_lose(session: Session) -> None:
        _strike(session, run)
        _cut(session.connection())
        session.execute(select(1))

    with pytest.raises(ConnectionLostError):
        distant.write(strike_and_lose)
    with distant.reading() as session:
        assert list_blows(session, run.id) == []


def test_an_error_of_the_work_itself_is_not_tried_again(distant: Catalogue) -> None:
    calls = []

    def fail(session: Session) -> None:
        calls.append(start_run(session, kind="hammer", title="t", article="a", setup={}))
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        distant.write(fail)
    assert len(calls) == 1
    with distant.reading() as session:
        assert count_runs(session) == 0


@pytest.mark.parametrize("database_kind", ["postgresql"])
@pytest.mark.parametrize("way", [Way.REQUESTS, Way.REPLIES], ids=["commit lost", "answer to the commit lost"])
@pytest.mark.parametrize("call", ["write", "writing"])
def test_a_commit_whose_line_breaks_is_looked_up_and_never_carried_out_twice(
    distant: Catalogue, proxy: FaultProxy, run: Run, way: Way, call: str
) -> None:
    def breaks(_connection: Connection) -> None:
        proxy.impair(Impairment(reset=way, pieces=1))

    calls: list[Point] = []

    def work(session: Session) -> None:
        calls.append(_strike(session, run))

    is_lost = way is Way.REQUESTS
    with before(lambda seen: seen[-1] == COMMIT, breaks):
        if call == "write":
            distant.write(work)
        else:
            _expect(is_lost, lambda: _written(distant, work))
    assert len(calls) == (2 if is_lost and call == "write" else 1)
    with distant.reading() as session:
        assert len(list_blows(session, run.id)) == (0 if is_lost and call == "writing" else 1)


def _written(distant: Catalogue, work: Callable[[Session], None]) -> None:
    with distant.writing() as session:
        work(session)


def _expect(is_lost: bool, do: Callable[[], None]) -> None:
    if is_lost:
        with pytest.raises(ConnectionLostError, match="nothing was stored"):
            do()
    else:
        do()


@pytest.mark.parametrize("database_kind", ["postgresql"])
def test_a_transaction_that_still_waits_for_its_lost_client_is_ended_before_it_is_tried_again(
    distant: Catalogue, proxy: FaultProxy, run: Run
) -> None:
    """The commit is swallowed and the line stays up at the server's end: without an end it would hold its locks."""

    def swallow(connection: Connection) -> None:
        proxy.impair(Impairment(lost=Way.REQUESTS, pieces=1))
        connection.connection.driver_connection.answer = -0.9  # type: ignore[union-attr]  # ends its wait after 0.1 s

    with before(lambda seen: seen[-1] == COMMIT, swallow):
        distant.write(lambda session: _strike(session, run))
    with distant.reading() as session:
        assert len(list_blows(session, run.id)) == 1


@pytest.mark.parametrize("database_kind", ["postgresql"])
def test_connections_that_were_lost_while_nobody_used_them_are_replaced(distant: Catalogue, proxy: FaultProxy) -> None:
    with distant.reading() as one, distant.reading() as other:
        assert count_runs(one) == count_runs(other) == 0
    proxy.cut()
    proxy.repair()
    with distant.writing() as session:
        start_run(session, kind="hammer", title="t", article="a", setup={})
