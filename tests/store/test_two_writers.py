"""Two writers who do the same at the same time on a server: each gets what is stored, and nothing is stored twice."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, date, datetime, timedelta
from typing import Any

import pytest
from sqlalchemy.orm import Session

from store.catalogue import Catalogue
from store.errors import StoreError
from store.instrument import Instrument
from store.measurements.blows import list_blows, withdraw_blow
from store.measurements.instruments import calibration_id
from store.measurements.runs import Run, begin_run, finish_run, get_run, list_run_events, reopen_run, start_run
from store.measurements.specimens import specimen_id
from store.measurements.spools import advance_spool, last_stored
from store.service.alarms import NewAlarm, add_alarm, claim_delivery
from store.service.requests import Answered, begin_request
from store.states import AlarmKind, RunState
from tests.databases import is_waiting
from tests.postgresql_server import Server
from tests.waiting import until

NOW = datetime(2026, 11, 23, 2, tzinfo=UTC)
SENSOR = Instrument("accelerometer", "352C33", "1234", date(2026, 1, 16), 0.0102, "V/(m/s^2)")
ALARM = NewAlarm(AlarmKind.RUN_ENDED, "rig", "run 1 has failed", "run 1 ended")

pytestmark = pytest.mark.parametrize("database_kind", ["postgresql"])  # SQLite has one writer at a time


def both(catalogue: Catalogue, server: Server, work: Callable[[Session], Any]) -> tuple[Any, Any]:
    """The results of two transactions, of which the second one begins before the first one ends."""

    def do() -> Any:
        with catalogue.writing() as session:
            return work(session)

    with ThreadPoolExecutor(1) as other:
        with catalogue.writing() as session:
            first = work(session)
            second = other.submit(do)
            until(lambda: second.done() or is_waiting(server))
        return first, second.result()


@pytest.mark.parametrize(
    "number_of",
    [lambda session: specimen_id(session, "beam 3", "I"), lambda session: calibration_id(session, SENSOR)],
    ids=["specimen", "instrument"],
)
def test_a_new_row_that_two_need_is_stored_once(
    catalogue: Catalogue, postgresql: Server, number_of: Callable[[Session], int]
) -> None:
    first, second = both(catalogue, postgresql, number_of)
    assert first == second


def test_a_cause_raises_one_alarm(catalogue: Catalogue, postgresql: Server) -> None:
    first, second = both(catalogue, postgresql, lambda session: add_alarm(session, ALARM))
    assert first is not None
    assert second is None


def test_a_message_is_sent_by_one(catalogue: Catalogue, postgresql: Server) -> None:
    with catalogue.writing() as session:
        add_alarm(session, ALARM)

    def claim(session: Session) -> object:
        return claim_delivery(session, "rig", "webhook", NOW, timedelta(seconds=20), lambda alarm: alarm.text)

    first, second = both(catalogue, postgresql, claim)
    assert first is not None
    assert second is None


def test_a_request_that_is_sent_again_at_once_is_known(catalogue: Catalogue, postgresql: Server) -> None:
    first, second = both(catalogue, postgresql, lambda session: begin_request(session, "ann", "key", "print"))
    assert first is None
    assert second == Answered("print", None, None)


def test_of_two_who_begin_a_spool_the_second_is_told_how_far_it_is_stored(
    catalogue: Catalogue, postgresql: Server
) -> None:
    with pytest.raises(StoreError, match=r"^spool new: another process has stored its records up to 5$"):
        both(catalogue, postgresql, lambda session: advance_spool(session, "new", 0, 5))
    with catalogue.reading() as session:
        assert last_stored(session, "new") == 5


def test_a_run_ends_once(catalogue: Catalogue, postgresql: Server) -> None:
    with catalogue.writing() as session:
        run = start_run(session, kind="sequence", title="t", article="beam 3", setup={})

    ends = iter([RunState.FINISHED, RunState.FAILED])
    with pytest.raises(StoreError, match=f"run {run.id} is finished already"):
        both(catalogue, postgresql, lambda session: finish_run(session, run.id, next(ends), "cut off"))
    with catalogue.reading() as session:
        assert get_run(session, run.id).state is RunState.FINISHED
        assert [event.state for event in list_run_events(session, run.id)] == [RunState.RUNNING, RunState.FINISHED]


def test_a_run_begins_once(catalogue: Catalogue, postgresql: Server) -> None:
    with catalogue.writing() as session:
        run = start_run(session, kind="sequence", title="t", article="beam 3", setup={}, state=RunState.CREATED)
    with pytest.raises(StoreError, match=f"run {run.id} was begun before"):
        both(catalogue, postgresql, lambda session: begin_run(session, run.id, sequence={}))


def test_a_run_that_is_finished_meanwhile_is_not_reopened(catalogue: Catalogue, postgresql: Server) -> None:
    with catalogue.writing() as session:
        run = start_run(session, kind="sequence", title="t", article="beam 3", setup={})
    does: Iterator[Callable[[Session], Run]] = iter(
        [lambda s: finish_run(s, run.id, RunState.FINISHED), lambda s: reopen_run(s, run.id, "interrupted")]
    )
    with pytest.raises(StoreError, match=f"run {run.id} is finished; nothing of it is left to do"):
        both(catalogue, postgresql, lambda session: next(does)(session))


def test_of_two_who_withdraw_a_blow_the_second_is_told_that_it_does_not_count(
    catalogue: Catalogue, filled: int, postgresql: Server
) -> None:
    with catalogue.reading() as session:
        blow = next(each for each in list_blows(session, filled) if each.accepted)
    assert blow.id is not None
    number, who = blow.id, iter(["ann", "bob"])
    with pytest.raises(StoreError, match=f"blow {number} does not count already: withdrawn: by ann"):
        both(catalogue, postgresql, lambda session: withdraw_blow(session, number, f"by {(name := next(who))}", name))
