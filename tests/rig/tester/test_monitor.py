"""The tester is monitored while a run drives it, and polled by a process that does not drive it."""

import threading
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from analysis.direct.sine import fit_sine
from rig.control import RunControl
from rig.errors import RigError
from rig.events import ActuatorShutDown, Event, InterlockTripped, RestUnknown, RunPaused
from rig.registers import COMMAND, HEARTBEAT, CommandCode, Interlock, State, Value
from rig.sequences.sweep_plan import SweepPlan
from rig.sweep import driven_sweep as sweep
from rig.sweep.driven_sweep import SinePoint
from rig.tester import monitor
from rig.tester.limits import MeasuredBeyondLimitError, TesterLimits
from rig.tester.modbus import ModbusLink
from rig.tester.monitor import poll_tester
from rig.tester.status import ImplausibleStatusError, TesterTrippedError
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.tester_device import DeviceLimits
from simlab.tester_server import TesterFault, start_tester_server
from simlab.tester_server import TesterServer as Server
from tests.rig.mapped import example_map, mapped_laboratory
from tests.rig.sweeping import Run, SweepLaboratory, recording, sweeping
from tests.waiting import LONG, until

PLAN = SweepPlan(frequencies=(20.0,), amplitudes_pp=(1e-4,), configurations=("shear",), specimens=("I",))
ENDLESS = replace(PLAN, shortest_record=600.0)  # for longer than any test waits
WIDE = DeviceLimits(error_limit=1e-2, upper_displacement_limit=5e-3, lower_displacement_limit=-5e-3)
SPEED = 10.0


@pytest.fixture
def laboratory() -> Iterator[SweepLaboratory]:
    """A record that does not end by itself, at a tester whose own limits are wide."""
    with sweeping(ENDLESS, SPEED, WIDE) as running:
        yield running


def run_away(laboratory: SweepLaboratory) -> None:
    """The servo moves by more than was commanded, and more than the rig allows."""
    laboratory.tester.actuator.cycle(6e-4, 20.0)


def is_unloaded(laboratory: SweepLaboratory) -> bool:
    return laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF


def test_a_record_during_which_the_actuator_exceeds_a_limit_of_the_rig_is_ended_and_not_kept(
    laboratory: SweepLaboratory,
) -> None:
    run = Run(laboratory.sweep, RunControl())
    until(lambda: recording(laboratory))
    run_away(laboratory)
    error = run.ended()
    assert isinstance(error, MeasuredBeyondLimitError)
    assert "beyond the rig's limit of 0.3 mm" in str(error)
    assert is_unloaded(laboratory)
    assert laboratory.points == []
    assert laboratory.daq.tasks == ()


def test_a_disk_that_takes_no_record_stops_an_actuator_that_cycles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweep, "STORE_TIME", 0.3)
    hangs, comes_back = threading.Event(), threading.Event()

    def add_sine(point: SinePoint) -> None:
        hangs.set()
        assert comes_back.wait(LONG)

    with sweeping(replace(PLAN, frequencies=(20.0, 30.0)), SPEED) as laboratory:
        monkeypatch.setattr(laboratory, "add_sine", add_sine)
        run = Run(laboratory.sweep, RunControl())
        assert hangs.wait(LONG)
        until(lambda: is_unloaded(laboratory))
        until(lambda: laboratory.seen(ActuatorShutDown) == 1)  # while the run still waits
        assert run.is_alive()
        comes_back.set()
        error = run.ended()
        assert isinstance(error, RigError)
        assert "a sine point was not stored within" in str(error)
        assert is_unloaded(laboratory)


def test_a_disk_that_takes_no_record_and_a_tester_that_obeys_nothing_are_told_while_the_run_waits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sweep, "STORE_TIME", 0.3)
    comes_back = threading.Event()
    with mapped_laboratory(example_map(watchdog=False), PLAN, speed=SPEED) as laboratory:

        def hang() -> None:
            laboratory.tester.faults.set("ignore")
            laboratory.tester.faults.set("dead_emergency_stop")
            assert comes_back.wait(LONG)

        laboratory.broken = hang
        run = Run(laboratory.sweep, RunControl())
        until(lambda: laboratory.seen(RestUnknown) == 1)
        assert run.is_alive()
        assert laboratory.moves()
        (told,) = [event for event in laboratory.events if isinstance(event, RestUnknown)]
        assert "press the red button" in told.reason
        assert "a sine point was not stored within" in told.reason
        assert laboratory.seen(ActuatorShutDown) == 0
        comes_back.set()
        assert isinstance(run.ended(), RigError)
        laboratory.tester.emergency_stop()


def test_the_force_is_watched_during_a_record_too(laboratory: SweepLaboratory) -> None:
    laboratory.limits = TesterLimits(amplitude_pp=3e-3, force=250.0)
    run = Run(laboratory.sweep, RunControl())
    until(lambda: recording(laboratory))
    laboratory.tester.actuator.cycle(2e-3, 20.0)
    error = run.ended()
    assert isinstance(error, MeasuredBeyondLimitError)
    assert "the force is" in str(error)
    assert is_unloaded(laboratory)


def test_a_trip_during_a_record_ends_it_and_is_reported_at_once(laboratory: SweepLaboratory) -> None:
    run = Run(laboratory.sweep, RunControl())
    until(lambda: recording(laboratory))
    laboratory.tester.emergency_stop()
    error = run.ended()
    assert isinstance(error, TesterTrippedError)
    assert error.interlocks is Interlock.EMERGENCY_STOP
    assert InterlockTripped(Interlock.EMERGENCY_STOP, stopped=True) in laboratory.events
    assert laboratory.points == []


def test_the_tester_is_shut_down_where_the_observer_of_a_trip_fails(laboratory: SweepLaboratory) -> None:
    class Deaf(list[Event]):
        """Events of a watcher who cannot take a trip."""

        def append(self, event: Event) -> None:
            super().append(event)
            if isinstance(event, InterlockTripped):
                raise ZeroDivisionError("an observer failed")

    laboratory.events = Deaf()
    run = Run(laboratory.sweep, RunControl())
    until(lambda: recording(laboratory))
    laboratory.tester.emergency_stop()
    assert isinstance(run.ended(), ZeroDivisionError)
    assert laboratory.tester.actuator.steady_pp() == 0.0
    assert CommandCode.HYDRAULICS_OFF in laboratory.tester.device.applied[-2:]


def test_a_tester_that_cannot_be_read_during_a_record_is_stopped(laboratory: SweepLaboratory) -> None:
    run = Run(laboratory.sweep, RunControl())
    until(lambda: recording(laboratory))
    laboratory.tester.faults.set("flipped_status")
    assert isinstance(run.ended(), RigError)
    assert laboratory.tester.actuator.steady_pp() == 0.0
    assert laboratory.points == []


def test_a_record_that_is_watched_has_every_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    with sweeping(replace(PLAN, fewest_cycles=60), speed=4.0) as laboratory:
        seen = list[int]()  # cycles of the record, at each poll
        status = laboratory.tester.device.status

        def counted() -> dict[str, Value]:
            found = status()
            if found["state"] == State.SETTLED:
                seen.append(int(str(found["cycles"])))
            return found

        monkeypatch.setattr(laboratory.tester.device, "status", counted)
        laboratory.sweep(RunControl())
    (point,) = laboratory.points
    assert sum(cycles > 30 for cycles in seen) >= 3
    assert point.block.samples == round(60 / 20.0 * point.block.sample_rate)
    fit = fit_sine(point.block.value("displacement"), point.block.sample_rate, 20.0, harmonics=3, refine=False)
    assert float(np.max(np.abs(fit.residual))) < 0.03 * point.reached_pp / 2  # a gap would leave the amplitude itself


def test_the_tester_is_monitored_while_a_point_is_stored_and_its_error_ends_the_sweep() -> None:
    with sweeping(PLAN, SPEED, WIDE) as laboratory:

        class Stuck(SweepLaboratory):
            """A store that takes as long as it takes the actuator to be stopped."""

            def add_sine(self, point: SinePoint) -> None:
                super().add_sine(point)
                run_away(laboratory)
                until(lambda: is_unloaded(laboratory))

        stuck = Stuck(**vars(laboratory))
        with pytest.raises(MeasuredBeyondLimitError, match="moves by"):
            stuck.sweep(RunControl())
        assert len(stuck.points) == 1


def test_a_paused_tester_is_watched_and_does_not_go_on_once_it_was_given_up(laboratory: SweepLaboratory) -> None:
    control = RunControl()
    run = Run(laboratory.sweep, control)
    until(lambda: recording(laboratory))
    control.pause()
    until(lambda: laboratory.seen(RunPaused) == 1)
    presets = laboratory.tester.device.applied.count(CommandCode.PRESET)
    laboratory.tester.actuator.move(3e-3)  # the valve leaks
    until(lambda: is_unloaded(laboratory))
    control.resume()
    error = run.ended()
    assert isinstance(error, MeasuredBeyondLimitError | ImplausibleStatusError)  # by its position or by its state
    assert laboratory.tester.device.applied.count(CommandCode.PRESET) == presets


def test_nothing_monitors_when_the_sweep_is_over() -> None:
    with sweeping(PLAN, speed=200.0) as laboratory:
        laboratory.sweep(RunControl())
        assert all(thread.name != "tester monitor" for thread in threading.enumerate())


@pytest.fixture
def mounting(monkeypatch: pytest.MonkeyPatch) -> Iterator[SweepLaboratory]:
    """A sweep whose tester is looked at often while its operator mounts."""
    monkeypatch.setattr(monitor, "LOOK_INTERVAL", 0.02)
    with sweeping(PLAN, SPEED) as laboratory:
        yield laboratory


def has_shut_down(laboratory: SweepLaboratory, times: int) -> bool:
    return laboratory.seen(ActuatorShutDown) >= times


class Mounting:
    """A sweep that waits for its operator, who mounts until `finish`."""

    def __init__(self, laboratory: SweepLaboratory, monkeypatch: pytest.MonkeyPatch) -> None:
        reaches_in, self._has_mounted = threading.Event(), threading.Event()

        def mount(specimen: str, configuration: str) -> None:
            reaches_in.set()
            assert self._has_mounted.wait(LONG)
            laboratory.bench.mount(specimen, configuration)

        monkeypatch.setattr(laboratory, "mount", mount)
        self._run = Run(laboratory.sweep, RunControl())
        assert reaches_in.wait(LONG)

    def finish(self) -> Exception | None:
        self._has_mounted.set()
        return self._run.ended()


def test_a_tester_that_falls_silent_while_the_operator_mounts_is_told_then_and_ends_the_run(
    mounting: SweepLaboratory, monkeypatch: pytest.MonkeyPatch
) -> None:
    operator = Mounting(mounting, monkeypatch)
    mounting.tester.faults.set(TesterFault.SILENT)
    until(lambda: mounting.seen(RestUnknown) == 1)
    mounting.tester.faults.clear()
    error = operator.finish()
    assert isinstance(error, RigError)
    assert "did not answer while the operator mounts" in str(error)
    assert CommandCode.HYDRAULICS_ON not in mounting.tester.device.applied


def test_hydraulics_that_another_client_switches_on_while_the_operator_mounts_are_switched_off_each_time(
    mounting: SweepLaboratory, monkeypatch: pytest.MonkeyPatch
) -> None:
    operator, device = Mounting(mounting, monkeypatch), mounting.tester.device
    for number in (100, 200):
        switch_on(mounting.tester, number)
        assert device.applied.count(CommandCode.HYDRAULICS_ON) == number / 100
        until(lambda: device.status()["state"] in (State.HYDRAULICS_OFF, State.TRIPPED))
        until(partial(has_shut_down, mounting, number // 100))
        command(mounting.tester, CommandCode.RESET, number + 50)
    error = operator.finish()
    assert isinstance(error, RigError)
    assert "hydraulics were switched on (idle) while the operator mounts" in str(error)


def test_a_sweep_whose_tester_stays_without_pressure_while_the_operator_mounts_goes_on(
    mounting: SweepLaboratory, monkeypatch: pytest.MonkeyPatch
) -> None:
    operator, polls = Mounting(mounting, monkeypatch), list[bool]()
    status = mounting.tester.device.status

    def counted() -> dict[str, Value]:
        polls.append(True)
        return status()

    monkeypatch.setattr(mounting.tester.device, "status", counted)
    until(lambda: len(polls) > 5)
    assert operator.finish() is None
    assert len(mounting.points) == 1


WATCHDOG_TIME = 0.4  # s


@pytest.fixture(params=[False, True], ids=["tcp", "rtu"])
def server(request: pytest.FixtureRequest) -> Iterator[Server]:
    server = start_tester_server(
        ordinary_bench(11, Clock(speed=200.0)), rtu=request.param, limits=DeviceLimits(watchdog_time=WATCHDOG_TIME)
    )
    yield server
    server.stop()


def switch_on(server: Server, sequence: int = 1) -> None:
    """Hydraulics on, by a client that then sends no heartbeat."""
    with closing(ModbusLink(server.url)) as link:
        link.write_holding(HEARTBEAT.address, HEARTBEAT.pack({"heartbeat": 7}))
    command(server, CommandCode.HYDRAULICS_ON, sequence)


def command(server: Server, code: CommandCode, sequence: int) -> None:
    """A command of another client, number `sequence`."""
    values: dict[str, Value] = {"preset": 0.0, "amplitude": 0.0, "frequency": 0.0, "limit": 0.0}
    values |= {"detector": 0, "action": 0, "command": code, "sequence": sequence}
    with closing(ModbusLink(server.url)) as link:
        link.write_holding(COMMAND.address, COMMAND.pack(values))


def test_a_poll_commands_nothing_and_gives_the_status(server: Server) -> None:
    found = poll_tester(server.url)
    assert (found.state, found.stopped_by) == (State.HYDRAULICS_OFF, Interlock(0))
    server.emergency_stop()
    assert poll_tester(server.url).stopped_by == Interlock.EMERGENCY_STOP
    assert not server.device.applied
    assert server.device.status()["sequence"] == server.device.status()["heartbeat"] == 0


def test_polling_does_not_keep_the_watchdog_from_acting(server: Server) -> None:
    switch_on(server)
    assert poll_tester(server.url).state is State.IDLE
    until = time.monotonic() + LONG
    while (found := poll_tester(server.url)).state is State.IDLE:
        assert time.monotonic() < until, "polling keeps the watchdog from acting"
    assert found.stopped_by == Interlock.WATCHDOG
    assert server.device.status()["heartbeat"] == 7
    assert server.device.applied == [CommandCode.HYDRAULICS_ON]


@pytest.mark.parametrize("fault", [TesterFault.SILENT, TesterFault.FLIPPED_STATUS])
def test_an_answer_that_does_not_come_or_makes_no_sense_is_an_error(server: Server, fault: TesterFault) -> None:
    server.faults.set(fault)
    with pytest.raises(RigError, match=r"no reply|checksum"):  # a serial frame with a flipped bit is none
        poll_tester(server.url)
