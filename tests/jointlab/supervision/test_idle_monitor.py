"""Changes of the tester while no run is carried out are noticed, and polling never delays a client that drives."""

import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st

from jointlab.drive.events import TesterAnswers, TesterSilent, UnaskedMotion
from jointlab.drive.idle_monitor import IdleMonitor, PollResult, events_of
from jointlab.drive.phase import Phase
from jointlab.drive.state import RigState, after
from jointlab.supervision.manager import RunManager
from rig.errors import UNEXPECTED, RigError
from rig.events import Event, InterlockReset, InterlockTripped, RestSeen
from rig.registers import NO_INTERLOCK, CommandCode, Interlock, Refusal, State
from rig.tester.monitor import MISSES
from rig.tester.status import TesterStatus
from simlab.laboratory import Laboratory
from simlab.tester_server import TesterFault
from tests.waiting import LONG, until

AT_REST = TesterStatus(
    State.HYDRAULICS_OFF, Interlock(0), Interlock(0), Refusal.NONE, 0, 0, CommandCode.NONE, 0, 0, 0, 0, 0, 0, 0, ()
)
SILENCE = RigError("no reply")


def stopped_by(interlocks: Interlock) -> TesterStatus:
    return replace(AT_REST, interlocks=interlocks, stopped_by=interlocks)


class Tester:
    """Answers as it is told, and can delay an answer."""

    def __init__(self) -> None:
        self.answer: TesterStatus | Exception = AT_REST
        self.polls = 0
        self.may_answer = threading.Event()
        self.may_answer.set()

    def __call__(self) -> TesterStatus:
        self.polls += 1
        self.may_answer.wait(LONG)
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer


class Known:
    """The known state of the rig, and every event that changed it."""

    def __init__(self) -> None:
        self.state = RigState()
        self.events = list[Event]()

    def __call__(self, event: Event) -> None:
        self.state = after(self.state, event)
        self.events.append(event)


@pytest.fixture
def tester() -> Tester:
    return Tester()


@pytest.fixture
def known() -> Known:
    return Known()


@pytest.fixture
def monitor(tester: Tester, known: Known) -> Iterator[IdleMonitor]:
    monitor = IdleMonitor(tester, lambda: known.state, known, interval=0.005)
    yield monitor
    tester.may_answer.set()
    monitor.close()


def test_a_trip_and_its_reset_by_another_client_are_reported_once(
    monitor: IdleMonitor, tester: Tester, known: Known
) -> None:
    tester.answer = stopped_by(Interlock.FORCE)
    until(lambda: known.state.interlocks == Interlock.FORCE)
    polls = tester.polls
    until(lambda: tester.polls > polls + 3)
    tester.answer = AT_REST
    until(lambda: not known.state.interlocks)
    assert known.events == [InterlockTripped(Interlock.FORCE, stopped=True), InterlockReset(Interlock.FORCE)]


def test_a_trip_whose_cause_is_not_named_and_its_reset_are_reported_once(
    monitor: IdleMonitor, tester: Tester, known: Known
) -> None:
    tester.answer = replace(AT_REST, state=State.TRIPPED)
    until(lambda: known.state.is_tripped)
    polls = tester.polls
    until(lambda: tester.polls > polls + 3)
    tester.answer = AT_REST
    until(lambda: not known.state.is_tripped)
    assert known.events == [InterlockTripped(NO_INTERLOCK, stopped=True), InterlockReset(NO_INTERLOCK)]


def test_one_missing_answer_is_not_reported_and_two_are(monitor: IdleMonitor, tester: Tester, known: Known) -> None:
    tester.answer = SILENCE
    until(lambda: known.state.tester_silent is not None)
    assert tester.polls >= MISSES
    tester.answer = AT_REST
    until(lambda: known.state.tester_silent is None)
    assert known.events == [TesterSilent("no reply"), TesterAnswers()]


def test_an_unexpected_error_of_a_poll_is_told_as_silence_and_polling_goes_on(
    monitor: IdleMonitor, tester: Tester, known: Known
) -> None:
    tester.answer = ZeroDivisionError("an error in the program")
    until(lambda: known.state.tester_silent == UNEXPECTED)
    tester.answer = AT_REST
    until(lambda: known.state.tester_silent is None)


def test_motion_that_no_run_drives_is_told_until_rest_is_read_twice(
    monitor: IdleMonitor, tester: Tester, known: Known
) -> None:
    tester.answer = replace(AT_REST, state=State.CYCLING, amplitude_pp=1e-4)
    until(lambda: known.state.rest_unknown == "the tester reports that it is cycling, although no run is in progress")
    polls = tester.polls
    until(lambda: tester.polls > polls + 3)
    tester.answer = replace(AT_REST, state=State.HELD)
    until(lambda: known.state.rest_unknown is None)
    assert known.events == [
        UnaskedMotion("the tester reports that it is cycling, although no run is in progress"),
        RestSeen(),
    ]


def has_polled(tester: Tester, times: int) -> bool:
    return tester.polls >= times


def test_a_tester_that_says_that_it_rests_and_cycles_is_not_told_as_at_rest(
    monitor: IdleMonitor, tester: Tester, known: Known
) -> None:
    cycling = replace(AT_REST, state=State.HELD, displacement_pp=(1e-4,))
    for cycles in range(1, 4):
        tester.answer = replace(cycling, cycles=100 * cycles)
        until(partial(has_polled, tester, tester.polls + 2))
    assert known.events[:1] == [
        UnaskedMotion("the actuator cycles (the tester reports that it is held), although no run is in progress")
    ]


def test_nothing_is_polled_while_a_client_drives_and_a_poll_under_way_is_waited_for(
    monitor: IdleMonitor, tester: Tester, known: Known
) -> None:
    tester.may_answer.clear()
    polls = tester.polls
    until(lambda: tester.polls > polls)
    driving, over = threading.Event(), threading.Event()

    def drive() -> None:
        with monitor.suspended():
            driving.set()
            over.wait(LONG)

    driver = threading.Thread(target=drive)
    driver.start()
    assert not driving.wait(0.05)  # the poll has the line
    tester.answer = stopped_by(Interlock.FORCE)
    tester.may_answer.set()
    assert driving.wait(LONG)
    polls = tester.polls
    time.sleep(0.05)  # ten intervals
    assert tester.polls == polls
    assert not known.events  # what the driver sees counts
    over.set()
    driver.join()
    until(lambda: known.state.interlocks == Interlock.FORCE)


def test_a_run_that_only_waits_lets_the_tester_be_polled(monitor: IdleMonitor, tester: Tester, known: Known) -> None:
    with monitor.suspended():
        tester.answer = SILENCE
        with monitor.resumed():
            until(lambda: known.state.tester_silent is not None)
            tester.may_answer.clear()
            polls = tester.polls
            until(lambda: tester.polls > polls)  # one is under way as the wait ends
            threading.Timer(0.05, tester.may_answer.set).start()
        assert tester.may_answer.is_set()  # it was waited for
        polls = tester.polls
        time.sleep(0.05)  # ten intervals
        assert tester.polls == polls
    tester.answer = AT_REST
    until(lambda: known.state.tester_silent is None)


@given(
    reported=st.sampled_from(Phase),
    interlocks=st.integers(0, 127).map(Interlock),
    result=st.one_of(st.just(SILENCE), st.integers(0, 127).map(Interlock).map(stopped_by)),
)
def test_a_poll_that_was_reported_brings_no_event(reported: Phase, interlocks: Interlock, result: PollResult) -> None:
    state = RigState(phase=Phase.IDLE)
    for event in (*events_of(state, stopped_by(interlocks)), *events_of(state, result)):
        state = after(state, event)
    for event in events_of(state, result):
        state = after(state, event)
    assert events_of(state, result) == ()
    assert (state.tester_silent is not None) == isinstance(result, RigError)
    assert after(replace(state, phase=reported), TesterSilent("late")).tester_silent == "late"


def test_an_idle_rig_notices_a_pressed_emergency_stop_before_any_run(rig: RunManager, laboratory: Laboratory) -> None:
    commands = list(laboratory.tester.device.applied)
    laboratory.tester.emergency_stop()
    until(lambda: rig.state.interlocks == Interlock.EMERGENCY_STOP)
    assert laboratory.tester.device.applied == commands
    laboratory.tester.release_emergency_stop()
    assert rig.acknowledge_interlocks() == Interlock.EMERGENCY_STOP
    assert not rig.state.interlocks


def test_an_idle_rig_notices_that_the_tester_does_not_answer(rig: RunManager, laboratory: Laboratory) -> None:
    laboratory.tester.faults.set(TesterFault.SILENT)
    until(lambda: rig.state.tester_silent is not None)
    laboratory.tester.faults.clear()
    until(lambda: rig.state.tester_silent is None)


def test_a_stop_is_confirmed_while_the_tester_is_polled(rig: RunManager, laboratory: Laboratory) -> None:
    for _ in range(20):
        assert rig.stop() is None
    assert laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF
