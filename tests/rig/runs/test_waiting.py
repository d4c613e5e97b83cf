"""Waiting for a time and for the temperature; both end when a stop is asked for."""

import threading
import time
from collections.abc import Callable, Iterator
from typing import Any, cast

import pytest
from sqlalchemy import text

from jointlab.runs.carry_out import run_sequence
from rig.control import RunControl
from rig.errors import RunStoppedError
from rig.events import Event, RunPaused, SoakEnded, SoakStarted, WaitStarted, ignore_event
from rig.instruments import Instruments
from rig.operator import Operator
from rig.runs.waiting import SoakError, soak, wait
from rig.sequences.sequence import SequenceError, SoakStep, sequence_from
from rig.thermometer import Thermometer
from simlab.laboratory import Laboratory
from store.catalogue import Catalogue

Room = Callable[..., Thermometer]


@pytest.fixture
def room() -> Room:
    """A room that is as warm as each reading says, and stays as the last one."""

    def with_readings(*readings: float) -> Thermometer:
        class Script:
            left = iter(readings)

            def celsius(self) -> float:
                return next(self.left, readings[-1])

        return cast(Thermometer, Script())

    return with_readings


@pytest.fixture
def stopping() -> Iterator[Callable[[RunControl, float], None]]:
    timers = list[threading.Timer]()

    def stop(control: RunControl, after: float) -> None:
        timers.append(threading.Timer(after, control.stop))
        timers[-1].start()

    yield stop
    for timer in timers:
        timer.join()


def within(band: float, seconds: float, limit: float, celsius: float | None = None) -> SoakStep:
    return SoakStep(step="soak", band_celsius=band, seconds=seconds, limit_seconds=limit, celsius=celsius)


def test_a_wait_lasts_as_long_as_asked_for_and_is_reported() -> None:
    events = list[Event]()
    began = time.monotonic()
    wait(0.12, events.append, RunControl())
    assert time.monotonic() - began >= 0.12
    assert events == [WaitStarted(0.12)]


def test_a_stop_ends_a_wait(stopping: Callable[[RunControl, float], None]) -> None:
    control = RunControl()
    stopping(control, 0.05)
    with pytest.raises(RunStoppedError):
        wait(3600.0, ignore_event, control)


def test_a_wait_that_is_paused_goes_on_when_it_is_resumed() -> None:
    control, events = RunControl(), list[Event]()
    control.pause()
    timer = threading.Timer(0.1, control.resume)
    timer.start()
    wait(0.15, events.append, control)
    timer.join()
    assert any(isinstance(event, RunPaused) for event in events)


def test_a_soak_ends_when_readings_have_stayed_within_the_band_for_the_time(room: Room) -> None:
    events = list[Event]()
    soak(within(0.5, 0.2, 10.0), room(20.0, 21.0, 22.0, 22.6, 22.9), events.append, RunControl())
    started, ended = events
    assert started == SoakStarted(0.5, 0.2, 10.0)
    assert isinstance(ended, SoakEnded)
    assert ended.celsius == 22.9
    assert ended.waited >= 0.2 + 3 * 0.01  # the first three readings do not fit into the band of the last


def test_a_pause_counts_for_nothing_in_a_soak(room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rig.runs.waiting.LATE", 0.2)
    control, events = RunControl(), list[Event]()
    pause, resume = threading.Timer(0.1, control.pause), threading.Timer(0.8, control.resume)
    pause.start()
    resume.start()
    soak(within(0.5, 0.5, 10.0), room(23.0), events.append, control)
    for timer in (pause, resume):
        timer.join()
    ended = events[-1]
    assert isinstance(ended, SoakEnded)
    assert ended.waited >= 0.8 + 0.5


def test_a_soak_about_a_temperature_begins_when_it_is_reached(room: Room) -> None:
    events = list[Event]()
    soak(within(1.0, 0.1, 10.0, 23.0), room(21.0, 21.0, 21.0, 22.6, 23.4), events.append, RunControl())
    ended = events[-1]
    assert isinstance(ended, SoakEnded)
    assert ended.celsius == 23.4


def test_a_temperature_that_does_not_settle_is_said_with_its_figures(room: Room) -> None:
    words = (
        r"within a band of 0\.5 K about 23 C for 0\.1 s in 0\.3 s; it is 21\.00 C and has been within the band for 0 s"
    )
    with pytest.raises(SoakError, match=words):
        soak(within(0.5, 0.1, 0.3, 23.0), room(21.0), ignore_event, RunControl())
    restless = room(*(20.0 + step % 2 for step in range(1000)))
    with pytest.raises(SoakError, match=r"within a band of 0\.5 K for 0\.1 s in 0\.3 s; it is 2[01]\.00 C"):
        soak(within(0.5, 0.1, 0.3), restless, ignore_event, RunControl())


def test_a_stop_ends_a_soak(room: Room, stopping: Callable[[RunControl, float], None]) -> None:
    control = RunControl()
    stopping(control, 0.05)
    with pytest.raises(RunStoppedError):
        soak(within(0.5, 3600.0, 7200.0), room(23.0), ignore_event, control)


def test_a_sequence_waits_and_soaks_on_the_thermometers_wire(
    document: dict[str, Any], instruments: Instruments, catalogue: Catalogue, whole_laboratory: Laboratory
) -> None:
    class Hand(Operator):
        def strike(self, point: Any, blow: int) -> None:
            whole_laboratory.bench.strike(point.node, point.direction.value, what="clean")

        def mount(self, specimen: str, configuration: str) -> None:
            raise AssertionError("nothing is mounted")

    document["steps"] = [
        {"step": "wait", "seconds": 0.05},
        {"step": "soak", "seconds": 0.1, "band_celsius": 2.0, "celsius": 23.0, "limit_seconds": 5.0},
        document["steps"][0] | {"points": ["5y"]},
    ]
    events = list[Event]()
    run_sequence(sequence_from(document), instruments, catalogue, Hand(), events.append)
    kinds = [type(event) for event in events]
    assert kinds.index(WaitStarted) < kinds.index(SoakStarted) < kinds.index(SoakEnded)
    with catalogue.reading() as session:
        assert session.execute(text("SELECT state, blows_accepted FROM v_runs")).one() == ("finished", 2)


@pytest.mark.parametrize(
    ("step", "words"),
    [
        ({"step": "wait"}, r"steps\.0\.wait\.seconds: is missing"),
        ({"step": "wait", "seconds": 0}, r"steps\.0\.wait\.seconds: is 0; it has to be more than 0"),
        ({"step": "soak", "band_celsius": 0}, r"steps\.0\.soak\.band_celsius"),
        ({"step": "soak", "seconds": 60, "limit_seconds": 30}, "limit_seconds 30 are over before seconds 60 are"),
    ],
)
def test_a_wait_that_cannot_end_well_is_refused(step: dict[str, Any], words: str, document: dict[str, Any]) -> None:
    document["steps"].insert(0, step)
    with pytest.raises(SequenceError, match=words):
        sequence_from(document)
