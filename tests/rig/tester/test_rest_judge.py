"""A stop is judged by what the machine does: rest, a visible ramp down, or the emergency stop within half a second."""

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest

from rig.events import Event, InterlockTripped, RestSeen, RestUnknown, TesterLineLost
from rig.registers import CommandCode, Interlock, Refusal, State, float32
from rig.tester import driver as tester
from rig.tester import status as tester_status
from rig.tester.monitor import monitored
from rig.tester.rest_judge import ESCALATE, LONGEST_RAMP, RestJudge, StopProgress, motion_shown, shows_rest
from rig.tester.status import ActuatorNotAtRestError, LineLostError, state_text
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.tester_device import DeviceLimits
from tests.mutated_tester import AnsweringProxy, MutatedDevice, Mutation, echo, late, mutated_tester, never
from tests.waiting import until

# -- judging statuses, without a wire

CYCLING = tester_status.TesterStatus(
    state=State.SETTLED,
    interlocks=Interlock(0),
    stopped_by=Interlock(0),
    refusal=Refusal.NONE,
    heartbeat=1,
    sequence=3,
    command=CommandCode.HOLD,
    preset=5e-4,
    amplitude_pp=float32(1e-4),
    frequency=50.0,
    cycles=100,
    displacement_mean=5e-4,
    force_mean=100.0,
    force_pp=50.0,
    displacement_pp=(1e-4,) * 16,
)
RAMPING = replace(CYCLING, state=State.RAMPING, amplitude_pp=0.0, frequency=0.0)
HELD = replace(RAMPING, state=State.HELD, displacement_pp=())


def judged(statuses: Callable[[float], tester_status.TesterStatus], every: float = 0.02) -> tuple[StopProgress, float]:
    """The first verdict but that it is stopping, and when; statuses are given from the stop at 0 s on."""
    judge, now = RestJudge(0.0), 0.0
    while (progress := judge.judge(statuses(now), now)) is StopProgress.STOPPING:
        now += every
    return progress, now


@pytest.mark.parametrize("state", [State.SETTLED, State.CYCLING, State.RAMPING])
def test_a_machine_that_goes_on_is_found_out_in_time_for_an_emergency_stop_within_half_a_second(state: State) -> None:
    progress, when = judged(lambda _: replace(CYCLING, state=state))
    assert progress is StopProgress.MOVES
    assert when <= ESCALATE + 0.03


def test_rest_is_believed_at_the_second_look() -> None:
    assert judged(lambda _: HELD) == (StopProgress.RESTS, 0.02)


@pytest.mark.parametrize("duration", [0.1, 1.0, 2.5])
def test_a_ramp_down_that_is_seen_to_fall_is_given_its_time(duration: float) -> None:
    def status(now: float) -> tester_status.TesterStatus:
        falling = replace(RAMPING, cycles=int(50 * now), displacement_pp=(1e-4 * (1 - now / duration),))
        return falling if now < duration else HELD

    progress, when = judged(status)
    assert progress is StopProgress.RESTS
    assert duration <= when < duration + 0.05


def test_a_ramp_down_that_never_ends_or_stands_still_is_cut_off() -> None:
    def forever(now: float) -> tester_status.TesterStatus:
        return replace(RAMPING, displacement_pp=(1e-4 * 0.5**now,))

    def sticking(now: float) -> tester_status.TesterStatus:
        return replace(RAMPING, displacement_pp=(max(1e-4 * (1 - now), 5e-5),))

    assert judged(forever)[0] is StopProgress.MOVES
    assert judged(forever)[1] <= LONGEST_RAMP + 0.03
    progress, when = judged(sticking)
    assert progress is StopProgress.MOVES
    assert when == pytest.approx(0.5 + ESCALATE, abs=0.08)


def test_what_says_that_it_rests_and_measures_motion_is_not_believed() -> None:
    def cycles_on(now: float) -> tester_status.TesterStatus:
        return replace(HELD, cycles=100 + int(50 * now), displacement_pp=(1e-4,))

    def drifts(now: float) -> tester_status.TesterStatus:
        return replace(HELD, displacement_mean=5e-4 + 1e-3 * now)

    for status in (cycles_on, drifts):
        progress, when = judged(status)
        assert progress is StopProgress.MOVES
        assert when <= ESCALATE + 0.03


def test_amplitudes_from_before_the_stop_do_not_speak_against_rest() -> None:
    progress, when = judged(lambda _: replace(HELD, displacement_pp=(1e-4,) * 16))
    assert progress is StopProgress.RESTS
    assert when <= 0.15


@pytest.mark.parametrize("state", [State.SETTLED, State.CYCLING, State.RAMPING])
def test_what_nobody_drives_shows_motion_by_its_state(state: State) -> None:
    assert motion_shown(replace(HELD, state=state), None) == f"the tester reports that it is {state_text(state)}"


def test_what_says_that_it_rests_shows_motion_where_it_counts_cycles() -> None:
    before = replace(HELD, cycles=100, displacement_pp=(1e-4,))
    assert (
        motion_shown(replace(before, cycles=200), before) == "the actuator cycles (the tester reports that it is held)"
    )
    assert motion_shown(replace(before, cycles=200, displacement_pp=(1e-7,)), before) is None
    assert motion_shown(before, before) is None


def test_two_statuses_show_rest_where_neither_cycles_and_the_mean_is_held() -> None:
    off = replace(HELD, state=State.HYDRAULICS_OFF)
    assert shows_rest(HELD, HELD)
    assert not shows_rest(HELD, None)
    assert not shows_rest(HELD, CYCLING)
    assert not shows_rest(replace(HELD, displacement_mean=6e-4), HELD)
    assert shows_rest(replace(off, displacement_mean=0.0), off)  # the specimen pushes it back


# -- a tester that disobeys, on its wire


@pytest.fixture
def wrong() -> Iterator[tuple[MutatedDevice, AnsweringProxy]]:
    bench = ordinary_bench(3, Clock(1.0))
    bench.mount("I", "shear")
    with mutated_tester(bench, DeviceLimits(watchdog_time=2.0)) as both:
        yield both


def set_cycling(driver: tester.Tester) -> None:
    driver.start()
    driver.preset(1e-4)
    driver.cycle(1e-4, 50.0)
    driver.wait(lambda status: status.state is State.SETTLED, "settle")


def time_to_rest(device: MutatedDevice, stop: Callable[[], None]) -> float:
    """Time in s from calling `stop` to rest by the physics."""
    began = time.monotonic()
    stopping = threading.Thread(target=stop)
    stopping.start()
    until(device.rests)
    took = time.monotonic() - began
    stopping.join()
    return took


@pytest.mark.parametrize("how", ["halt", "stop", "shut_down"])
@pytest.mark.parametrize("pretends", [False, True], ids=["openly", "pretending"])
def test_a_hold_that_is_acknowledged_and_not_obeyed_becomes_an_emergency_stop(
    wrong: tuple[MutatedDevice, AnsweringProxy], how: str, pretends: bool
) -> None:
    device, line = wrong
    with tester.connect(line.url) as driver:
        set_cycling(driver)
        device.mutate(Mutation(disobeys=frozenset({CommandCode.HOLD}), pretends=pretends))
        getattr(driver, how)()
        until(device.rests)
        assert device.status()["interlocks"] == Interlock.EMERGENCY_STOP


def test_hydraulics_that_stay_on_against_the_command_are_taken_away_by_the_emergency_stop(
    wrong: tuple[MutatedDevice, AnsweringProxy],
) -> None:
    device, line = wrong
    with tester.connect(line.url) as driver:
        set_cycling(driver)
        device.mutate(Mutation(disobeys=frozenset({CommandCode.HYDRAULICS_OFF})))
    assert device.status()["interlocks"] == Interlock.EMERGENCY_STOP


def test_a_hold_that_makes_the_mean_travel_becomes_an_emergency_stop(
    wrong: tuple[MutatedDevice, AnsweringProxy],
) -> None:
    device, line = wrong
    with tester.connect(line.url) as driver:
        set_cycling(driver)
        device.mutate(Mutation(runs_away=True))
        driver.halt()
        until(device.rests)
        assert device.status()["interlocks"] == Interlock.EMERGENCY_STOP  # not the watchdog


def test_a_slow_ramp_down_that_is_seen_to_fall_is_not_cut_off(wrong: tuple[MutatedDevice, AnsweringProxy]) -> None:
    device, line = wrong
    with tester.connect(line.url) as driver:
        set_cycling(driver)
        device.mutate(Mutation(stopping_time=0.2))  # 1.4 s down to rest
        assert time_to_rest(device, driver.halt) > 1.0
        assert device.status()["state"] == State.HELD


@pytest.mark.parametrize("answer", [never, echo, late(0.6)], ids=["silent", "echo", "late"])
def test_a_line_without_usable_replies_still_carries_the_stop_and_rest_is_not_claimed(
    wrong: tuple[MutatedDevice, AnsweringProxy], answer: Callable[..., Iterator[bytes]]
) -> None:
    device, line = wrong

    def work() -> None:
        with tester.connect(line.url) as driver:
            set_cycling(driver)
            line.answer = answer
            assert time_to_rest(device, lambda: unconfirmed(driver)) < 1.5  # the watchdog takes two seconds
            began = time.monotonic()
            unconfirmed(driver)
            assert time.monotonic() - began < 3.0

    words = r"not confirmed at rest.*press the red button; the watchdog of the tester should stop it within 2 s"
    with pytest.raises(ActuatorNotAtRestError, match=words):
        work()


def unconfirmed(driver: tester.Tester) -> None:
    with pytest.raises(ActuatorNotAtRestError):
        driver.shut_down()


def test_an_emergency_stop_that_does_nothing_is_left_to_the_watchdog(
    wrong: tuple[MutatedDevice, AnsweringProxy],
) -> None:
    device, line = wrong
    with tester.connect(line.url) as driver:
        set_cycling(driver)
        device.mutate(Mutation(disobeys=frozenset({CommandCode.HOLD}), coil_is_dead=True))
        unconfirmed(driver)
        until(device.rests)
        assert device.status()["interlocks"] == Interlock.WATCHDOG


def test_a_stop_overtakes_a_command_that_waits_for_its_reply(wrong: tuple[MutatedDevice, AnsweringProxy]) -> None:
    device, line = wrong
    overtaken = list[Exception]()
    slow = threading.Event()

    def first_is_slow(request: bytes, reply: bytes) -> Iterator[bytes]:
        if not slow.is_set():
            slow.set()
            time.sleep(2.0)
        yield reply

    def cycle() -> None:
        try:
            driver.cycle(1e-4, 40.0)
        except tester_status.MotionHaltedError as error:
            overtaken.append(error)

    with tester.connect(line.url, timeout=3.0) as driver:
        set_cycling(driver)
        driver._heartbeat.stop()
        driver._heartbeat.join()
        line.answer = first_is_slow
        waiting = threading.Thread(target=cycle)
        waiting.start()
        slow.wait()
        assert time_to_rest(device, driver.halt) < 1.5  # the reply takes two seconds
        waiting.join()
        assert len(overtaken) == 1
        assert device.applied[-2:] != [CommandCode.HOLD, CommandCode.CYCLE]


# -- a lost line


def test_a_lost_line_is_said_at_once_and_the_run_ends_within_three_seconds(
    wrong: tuple[MutatedDevice, AnsweringProxy],
) -> None:
    device, line = wrong
    events, told = list[Event](), list[float]()

    def observe(event: Event) -> None:
        events.append(event)
        if isinstance(event, TesterLineLost):
            told.append(time.monotonic())

    def work() -> None:
        with tester.connect(line.url, observer=observe) as driver, monitored(driver):
            set_cycling(driver)
            line.answer = never
            told.append(time.monotonic())
            driver.wait(lambda _: False, "lose its line", timeout=30.0)

    with pytest.raises(LineLostError, match=r"line lost .*the watchdog of the tester should stop it within 2 s"):
        work()
    lost, said = told
    assert said - lost < 1.5
    assert time.monotonic() - lost < 3.0
    first, unknown = (event for event in events if not isinstance(event, InterlockTripped))
    assert first == TesterLineLost(2.0)
    assert isinstance(unknown, RestUnknown)
    assert "the actuator was not confirmed at rest" in unknown.reason
    until(device.rests)


def test_rest_is_said_again_once_it_is_read(wrong: tuple[MutatedDevice, AnsweringProxy]) -> None:
    device, line = wrong
    events = list[Event]()
    with tester.connect(line.url, observer=events.append) as driver:
        set_cycling(driver)
        line.answer = never
        unconfirmed(driver)
        answers, line.answer = line.answer, lambda _request, reply: iter([reply])
        until(device.rests)
        driver.shut_down()  # it is read by now
        assert answers is never
    assert [type(event) for event in events if not isinstance(event, InterlockTripped)] == [RestUnknown, RestSeen]
