"""Limit detectors and their actions: set in the instrument, tightened from the rig, reported, and reset on request."""

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.events import Event, InterlockReset, InterlockTripped, RestSeen
from rig.instruments import Instruments
from rig.registers import DETECTED, Action, CommandCode, Interlock, Refusal, State
from rig.sequences.sequence import Sequence
from rig.sequences.steps import check_instruments
from rig.tester import driver as tester
from rig.tester import limits as tester_limits
from rig.tester import status as tester_status
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.detectors import Detectors, SimulatedDetector
from simlab.tester_device import DeviceLimits
from simlab.tester_server import TesterServer as Server
from simlab.tester_server import start_tester_server
from tests.waiting import LONG

UPPER, LOWER, FORCE, ERROR, UNDERPEAK = DETECTED
PRESET = 5e-4


@contextmanager
def serving(speed: float = 200.0, **limits: Any) -> Iterator[Server]:
    bench = ordinary_bench(11, Clock(speed))
    bench.mount("I", "shear")
    server = start_tester_server(bench, limits=replace(DeviceLimits(), **limits))
    try:
        yield server
    finally:
        server.stop()


@contextmanager
def driving(server: Server, events: list[Event] | None = None) -> Iterator[tester.Tester]:
    reported = events if events is not None else []
    with tester.connect(server.url, timeout=0.3, observer=reported.append) as driver:
        yield driver


def cycle_until_stopped(driver: tester.Tester) -> Interlock:
    """Cycle with a servo that overshoots, until an interlock stops it; which."""
    driver.start()
    driver.preset(PRESET)
    driver.cycle(1e-4, 50.0)
    with pytest.raises(tester_status.TesterTrippedError) as stopped:
        driver.wait(lambda _: False, "be stopped", timeout=LONG)
    return stopped.value.interlocks


@pytest.mark.parametrize(
    ("action", "state", "preset", "locked"),
    [
        (Action.HOLD, State.HELD, PRESET, False),
        (Action.STOP, State.IDLE, 0.0, False),
        (Action.PROGRAM_INTERLOCK, State.TRIPPED, 0.0, True),
        (Action.HYDRAULIC_INTERLOCK, State.TRIPPED, 0.0, True),
    ],
)
def test_each_action_stops_the_actuator_as_far_as_it_says(
    action: Action, state: State, preset: float, locked: bool
) -> None:
    with serving(error_action=action) as server, driving(server) as driver:
        server.faults.set("runaway_servo")
        assert cycle_until_stopped(driver) is Interlock.ERROR
        while (status := driver.status()).state is State.RAMPING:
            time.sleep(0.001)
        assert status.state is state
        assert status.preset == pytest.approx(preset)
        assert (status.interlocks, status.stopped_by) == (Interlock.ERROR, Interlock.ERROR)
        assert server.actuator.steady_pp() == 0.0
        server.faults.clear()
        if locked:
            with pytest.raises(tester_status.TesterTrippedError, match="error"):
                driver.preset(PRESET)
        driver.reset()
        assert driver.status().state is {
            Action.PROGRAM_INTERLOCK: State.IDLE,
            Action.HYDRAULIC_INTERLOCK: State.HYDRAULICS_OFF,
        }.get(action, state)


def test_after_a_hold_and_its_reset_cycling_goes_on_from_the_preset() -> None:
    with serving(error_action=Action.HOLD) as server, driving(server) as driver:
        server.faults.set("runaway_servo")
        cycle_until_stopped(driver)
        with pytest.raises(tester_status.TesterTrippedError, match="error"):
            driver.measured()  # the rig goes on only after a reset, whatever the instrument would do
        server.faults.clear()
        driver.reset()
        driver.cycle(1e-4, 50.0)
        driver.wait(lambda status: status.state is State.SETTLED, "settle")
    assert server.device.applied.count(CommandCode.PRESET) == 1


def test_a_run_does_not_begin_with_a_tester_that_a_detector_holds(sequence: Sequence, instruments: Instruments) -> None:
    with serving(error_action=Action.HOLD) as server:
        with driving(server) as driver:
            server.faults.set("runaway_servo")
            cycle_until_stopped(driver)
        server.faults.clear()
        with pytest.raises(
            tester_status.TesterTrippedError, match=r"is stopped by error limit \(overshoot\); remove the cause"
        ):
            check_instruments(sequence, replace(instruments, tester_url=server.url))


def test_a_detector_that_holds_holds_each_time_it_fires() -> None:
    with serving(error_action=Action.HOLD) as server, driving(server) as driver:
        server.faults.set("runaway_servo")
        for _ in range(2):
            assert cycle_until_stopped(driver) is Interlock.ERROR
            driver.reset()


def test_a_detector_that_indicates_is_reported_once_and_stops_nothing() -> None:
    events: list[Event] = []
    with serving() as server, driving(server, events) as driver:
        server.faults.set("weak_servo")
        driver.start()
        driver.preset(PRESET)
        driver.cycle(1e-4, 50.0)
        driver.wait(lambda status: Interlock.UNDERPEAK in status.interlocks, "show the underpeak")
        driver.measured()
        assert events == [InterlockTripped(Interlock.UNDERPEAK, stopped=False)]


def test_underpeak_can_be_made_to_hold() -> None:
    with serving() as server, driving(server) as driver:
        driver.set_detector(Interlock.UNDERPEAK, 0.9, Action.HOLD)
        server.faults.set("weak_servo")
        assert cycle_until_stopped(driver) is Interlock.UNDERPEAK


def test_trips_and_resets_are_reported_and_logged(caplog: pytest.LogCaptureFixture) -> None:
    events: list[Event] = []
    with serving() as server, driving(server, events) as driver:
        server.faults.set("runaway_servo")
        cycle_until_stopped(driver)
        server.faults.clear()
        with caplog.at_level(logging.WARNING, logger="rig.tester.driver"):
            driver.reset()
    assert events == [InterlockTripped(Interlock.ERROR, stopped=True), InterlockReset(Interlock.ERROR), RestSeen()]
    assert "interlocks of SIM-ET-0001 reset: error" in caplog.text


def test_nothing_resets_by_itself() -> None:
    with serving(error_action=Action.STOP) as server:
        server.faults.set("runaway_servo")
        with driving(server) as driver:
            cycle_until_stopped(driver)
        server.faults.clear()
        with driving(server) as driver:
            assert driver.status().stopped_by is Interlock.ERROR
            driver.start()
            with pytest.raises(tester_status.TesterTrippedError, match="stopped by error limit"):
                driver.preset(PRESET)
            assert driver.status().stopped_by is Interlock.ERROR


@pytest.mark.parametrize(
    ("interlock", "limit"), [(UPPER, 4.5e-4), (FORCE, 100.0)], ids=lambda value: getattr(value, "name", value)
)
def test_a_tightened_detector_stops_the_ramp_and_the_way_out_is_to_unload(interlock: Interlock, limit: float) -> None:
    with serving() as server, driving(server) as driver:
        driver.set_detector(FORCE, 5e3, Action.HYDRAULIC_INTERLOCK)
        driver.set_detector(interlock, limit, Action.PROGRAM_INTERLOCK)
        assert driver.detectors()[interlock].limit == pytest.approx(limit)
        driver.start()
        position = 4.4e-4 if interlock is UPPER else PRESET
        if interlock is FORCE:
            with pytest.raises(tester_status.TesterTrippedError, match="force"):
                driver.preset(position)
            with pytest.raises(tester_status.TesterRefusedError, match="cause still present"):
                driver.reset()
            driver.shut_down()
            time.sleep(0.05)  # 10 s on the bench: the specimen has pushed the actuator back
            driver.reset()
        else:
            with pytest.raises(tester_status.TesterRefusedError, match="preset limit"):
                driver.preset(PRESET)
            driver.preset(position)


@pytest.mark.parametrize(
    ("interlock", "limit", "action"),
    [
        (UPPER, 1.6e-3, Action.PROGRAM_INTERLOCK),
        (LOWER, -0.6e-3, Action.PROGRAM_INTERLOCK),
        (FORCE, 5001.0, Action.PROGRAM_INTERLOCK),
        (FORCE, 4000.0, Action.STOP),
        (ERROR, 6e-5, Action.HYDRAULIC_INTERLOCK),
        (UNDERPEAK, 0.4, Action.HOLD),
        (FORCE, float("nan"), Action.PROGRAM_INTERLOCK),
        (Interlock.WATCHDOG, 100.0, Action.INDICATE),
    ],
    ids=lambda value: getattr(value, "name", value),
)
def test_the_network_cannot_loosen_a_detector(interlock: Interlock, limit: float, action: Action) -> None:
    with serving() as server, driving(server) as driver:
        before = driver.detectors()
        with pytest.raises(tester_status.TesterRefusedError, match="refused detector: detector limit") as refused:
            driver.set_detector(interlock, limit, action)
        assert refused.value.refusal is Refusal.DETECTOR_LIMIT
        assert driver.detectors() == before


@given(st.sampled_from(DETECTED), st.floats(-1e-2, 1e4, allow_nan=False), st.sampled_from(Action))
def test_a_detector_is_never_looser_than_at_the_instrument(interlock: Interlock, limit: float, action: Action) -> None:
    widest = {one: DeviceLimits().detector(one) for one in DETECTED}
    detectors = Detectors(widest)
    if not detectors.may_be(interlock, limit, action):
        return
    assert action >= widest[interlock].action
    nearer = limit - widest[interlock].limit
    assert (nearer if interlock in (LOWER, UNDERPEAK) else -nearer) >= -2e-6 * abs(widest[interlock].limit)
    detectors.tighten(interlock, SimulatedDetector(limit, action))
    assert detectors.may_be(
        interlock, widest[interlock].limit, widest[interlock].action
    )  # back to the instrument's own


@pytest.mark.parametrize("name", ["upper_displacement", "lower_displacement", "force", "error"])
def test_a_tester_whose_detectors_stop_nothing_is_not_driven(name: str) -> None:
    with (
        serving(**{f"{name}_action": Action.INDICATE}) as server,
        pytest.raises(tester_status.TesterMismatchError, match=f"only indicates {name}"),
        driving(server),
    ):
        pytest.fail("connected")


def test_the_identity_has_the_detectors_as_they_were_in_force() -> None:
    with serving(force_limit=4e3) as server, driving(server) as driver:
        assert driver.identity.detectors[FORCE] == tester_status.Detector(4e3, Action.PROGRAM_INTERLOCK)
        assert driver.identity.limits["force_limit"] == 4e3
        assert driver.identity.limits["velocity_limit"] == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        (tester_limits.TesterLimits(force=100.0), "force is .* beyond the rig's limit of 100 N"),
        (tester_limits.TesterLimits(amplitude_pp=1e-4), "moves by .* beyond the rig's limit of 0.1 mm"),
    ],
)
def test_the_rig_has_limits_of_its_own_on_measured_values(limits: tester_limits.TesterLimits, words: str) -> None:
    with serving(error_limit=1e-2, upper_displacement_limit=5e-3) as server:

        def work() -> None:
            with tester.connect(server.url, limits, timeout=0.3) as driver:
                driver.start()
                driver.preset(PRESET)
                server.faults.set("runaway_servo")
                driver.cycle(1e-4, 20.0)
                if limits.force > 1e3:
                    driver.wait(lambda status: False, "go too far", timeout=LONG)

        with pytest.raises(tester_limits.MeasuredBeyondLimitError, match=words):
            work()
        assert server.actuator.steady_pp() == 0.0


def test_how_far_out_mean_and_amplitude_lie_together_is_limited_too() -> None:
    limits = tester_limits.TesterLimits(highest_preset=5e-4, amplitude_pp=1e-4)
    with serving() as server, driving(server) as driver:
        status = replace(driver.status(), displacement_mean=5.6e-4, displacement_pp=(9e-5,))
    with pytest.raises(tester_limits.MeasuredBeyondLimitError, match="outside the rig's limits"):
        limits.check_measured(status)
    limits.check_measured(replace(status, displacement_mean=5.5e-4))


def test_going_down_to_a_smaller_amplitude_is_no_overshoot() -> None:
    with serving(speed=1.0) as server, driving(server) as driver:
        driver.start()
        driver.preset(1e-4)
        driver.cycle(1.5e-4, 100.0)
        driver.wait(lambda status: status.state is State.SETTLED, "settle")
        driver.cycle(1e-5, 100.0)
        driver.wait(lambda status: status.state is State.SETTLED, "settle")
        assert driver.status().interlocks == Interlock(0)
