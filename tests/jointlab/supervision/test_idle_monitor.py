"""What happens to the tester while nothing is carried out is known, and whoever drives is never in its way."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from jointlab.supervision.events import TesterAnswers, TesterSilent
from jointlab.supervision.idle_monitor import MISSES, IdleWatch, Seen, news
from jointlab.supervision.manager import RunManager
from jointlab.supervision.phase import Phase
from jointlab.supervision.state import RigState, after
from rig.errors import RigError
from rig.events import Event, InterlockReset, InterlockTripped
from rig.registers import CommandCode, Interlock, Refusal, State
from rig.tester_status import TesterStatus
from simlab.laboratory import Laboratory
from simlab.tester_server import TesterFault
from tests.waiting import LONG, until

AT_REST = TesterStatus(
    State.HYDRAULICS_OFF, Interlock(0), Interlock(0), Refusal.NONE, 0, CommandCode.NONE, 0, 0, 0, 0, 0, 0, 0, ()
)
SILENCE = RigError("no reply")


def stopped_by(interlocks: Interlock) -> TesterStatus:
    return replace(AT_REST, interlocks=interlocks, stopped_by=interlocks)


class Tester:
    """Answers as it is told, and lets a look be held up."""

    def __init__(self) -> None:
        self.answer: Seen = AT_REST
        self.looks = 0
        self.may_answer = threading.Event()
        self.may_answer.set()

    def __call__(self) -> TesterStatus:
        self.looks += 1
        self.may_answer.wait(LONG)
        if isinstance(self.answer, RigError):
            raise self.answer
        return self.answer


class Known:
    """What the rig is known to be at, and every event that changed it."""

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
def watch(tester: Tester, known: Known) -> Iterator[IdleWatch]:
    watch = IdleWatch(tester, lambda: known.state, known, interval=0.005)
    yield watch
    tester.may_answer.set()
    watch.close()


def test_a_trip_and_its_reset_by_somebody_else_are_told_once(watch: IdleWatch, tester: Tester, known: Known) -> None:
    tester.answer = stopped_by(Interlock.FORCE)
    until(lambda: known.state.interlocks == ("force",))
    looks = tester.looks
    until(lambda: tester.looks > looks + 3)
    tester.answer = AT_REST
    until(lambda: not known.state.interlocks)
    assert known.events == [InterlockTripped(("force",), stopped=True), InterlockReset(("force",))]


def test_one_answer_that_stays_away_is_not_told_and_a_silence_is(
    watch: IdleWatch, tester: Tester, known: Known
) -> None:
    tester.answer = SILENCE
    until(lambda: known.state.tester_silent is not None)
    assert tester.looks >= MISSES
    tester.answer = AT_REST
    until(lambda: known.state.tester_silent is None)
    assert known.events == [TesterSilent("no reply"), TesterAnswers()]


def test_nobody_looks_while_somebody_drives_and_a_look_on_its_way_is_waited_for(
    watch: IdleWatch, tester: Tester, known: Known
) -> None:
    tester.may_answer.clear()
    looks = tester.looks
    until(lambda: tester.looks > looks)
    driving, over = threading.Event(), threading.Event()

    def drive() -> None:
        with watch.kept_off():
            driving.set()
            over.wait(LONG)

    driver = threading.Thread(target=drive)
    driver.start()
    assert not driving.wait(0.05)  # the look has the line
    tester.answer = stopped_by(Interlock.FORCE)
    tester.may_answer.set()
    assert driving.wait(LONG)
    looks = tester.looks
    time.sleep(0.05)  # ten intervals
    assert tester.looks == looks
    assert not known.events  # what the driver sees counts
    over.set()
    driver.join()
    until(lambda: known.state.interlocks == ("force",))


@given(
    told=st.sampled_from(Phase),
    interlocks=st.integers(0, 127).map(Interlock),
    seen=st.one_of(st.just(SILENCE), st.integers(0, 127).map(Interlock).map(stopped_by)),
)
def test_a_look_that_was_told_is_no_news(told: Phase, interlocks: Interlock, seen: Seen) -> None:
    state = RigState(phase=Phase.IDLE)
    for event in (*news(state, stopped_by(interlocks)), *news(state, seen)):
        state = after(state, event)
    for event in news(state, seen):
        state = after(state, event)
    assert news(state, seen) == ()
    assert (state.tester_silent is not None) == isinstance(seen, RigError)
    assert after(replace(state, phase=told), TesterSilent("late")).tester_silent == (
        "late" if told is Phase.IDLE else state.tester_silent  # a run finds out by itself
    )


def test_a_rig_at_rest_knows_of_a_pressed_button_before_any_run(rig: RunManager, laboratory: Laboratory) -> None:
    commands = list(laboratory.tester.device.applied)
    laboratory.tester.emergency_stop()
    until(lambda: rig.state.interlocks == ("emergency_stop",))
    assert laboratory.tester.device.applied == commands
    laboratory.tester.release_emergency_stop()
    assert rig.acknowledge_interlocks() == ("emergency stop",)
    assert not rig.state.interlocks


def test_a_rig_at_rest_knows_that_the_tester_does_not_answer(rig: RunManager, laboratory: Laboratory) -> None:
    laboratory.tester.faults.set(TesterFault.SILENT)
    until(lambda: rig.state.tester_silent is not None)
    laboratory.tester.faults.clear()
    until(lambda: rig.state.tester_silent is None)


def test_a_stop_is_confirmed_while_the_rig_is_looked_at(rig: RunManager, laboratory: Laboratory) -> None:
    for _ in range(20):
        assert rig.stop() is None
    assert laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF
