"""Pausing, resuming and stopping a sweep and a hammer session while they run, from another thread."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field

import pytest

from analysis.dof import Dof
from daq import device
from daq.errors import AcquisitionCancelledError
from rig.control import RunControl
from rig.errors import RunStoppedError
from rig.events import Event, RunPaused, RunResumed, SinePointMeasured
from rig.hammer.session import BlowSink, run_hammer_session
from rig.operator import Operator
from rig.registers import CommandCode, Interlock, State
from rig.sequences.sequence import HammerStep
from rig.sequences.sweep_plan import SweepPlan
from rig.tester import driver as tester
from rig.tester.status import MotionHaltedError, StopDisobeyedError, TesterRefusedError
from rig.tester.stop_latch import StopLatch
from simlab.bench import SimulatedBench, ordinary_bench
from simlab.clock import Clock
from simlab.daq_server import start_daq_server
from simlab.ordinary import BenchConditions
from simlab.tester_device import DeviceLimits
from simlab.tester_server import TesterServer as Server
from simlab.tester_server import start_tester_server
from tests.channels import HAMMER_CHANNELS
from tests.rig.sweeping import Run, SweepLaboratory, ramping, recording, sweeping
from tests.waiting import until

# 3 s of record at 10 times the wall's speed: long enough to be interrupted
PLAN = SweepPlan(
    frequencies=(20.0, 25.0), amplitudes_pp=(1e-4,), configurations=("shear",), specimens=("I",), shortest_record=3.0
)
SPEED = 10.0


@pytest.fixture
def laboratory() -> Iterator[SweepLaboratory]:
    with sweeping(PLAN, SPEED) as running:
        yield running


@pytest.mark.parametrize("moment", [recording, ramping])
def test_a_paused_sweep_holds_the_actuator_with_its_preset_and_goes_on_as_if_nothing_had_been(
    laboratory: SweepLaboratory, moment: Callable[[SweepLaboratory], bool]
) -> None:
    control = RunControl()
    run = Run(laboratory.sweep, control)
    until(lambda: moment(laboratory))
    control.pause()
    assert laboratory.at_rest()
    until(lambda: RunPaused(pressure=True) in laboratory.events)
    status = laboratory.tester.device.status()
    assert status["state"] == State.HELD  # hydraulics are on
    assert status["preset"] == pytest.approx(PLAN.preset)
    applied = len(laboratory.tester.device.applied)
    time.sleep(0.2)
    assert len(laboratory.tester.device.applied) == applied
    assert laboratory.points == []
    control.resume()
    assert run.ended() is None
    assert [point.frequency for point in laboratory.points] == [20.0, 25.0]
    assert all(point.within_tolerance for point in laboratory.points)
    (resumed,) = [event for event in laboratory.events if isinstance(event, RunResumed)]
    assert resumed.paused > 0.15


@pytest.mark.parametrize("moment", [recording, ramping])
def test_a_stopped_sweep_keeps_what_was_measured_and_leaves_hydraulics_off(
    laboratory: SweepLaboratory, moment: Callable[[SweepLaboratory], bool]
) -> None:
    control = RunControl()
    run = Run(laboratory.sweep, control)
    until(lambda: moment(laboratory))
    control.stop()
    assert laboratory.at_rest()
    error = run.ended()
    assert isinstance(error, RunStoppedError)
    assert "stopped as asked" in str(error)
    assert laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF
    assert len(laboratory.points) == laboratory.seen(SinePointMeasured)


def test_a_paused_sweep_can_be_stopped(laboratory: SweepLaboratory) -> None:
    control = RunControl()
    run = Run(laboratory.sweep, control)
    until(lambda: recording(laboratory))
    control.pause()
    control.stop()
    assert isinstance(run.ended(), RunStoppedError)
    assert laboratory.seen(RunResumed) == 0
    control.resume()
    assert control.is_interrupted()  # what was stopped does not go on


def test_a_run_that_is_paused_or_stopped_before_it_begins_moves_nothing(laboratory: SweepLaboratory) -> None:
    control = RunControl()
    control.stop()
    with pytest.raises(RunStoppedError):
        laboratory.sweep(control)
    assert CommandCode.PRESET not in laboratory.tester.device.applied


def test_even_the_shortest_pause_discards_the_record(laboratory: SweepLaboratory) -> None:
    control = RunControl()
    run = Run(laboratory.sweep, control)
    until(lambda: recording(laboratory))
    control.pause()
    control.resume()
    assert run.ended() is None
    cycles = laboratory.tester.device.applied.count(CommandCode.CYCLE)
    assert laboratory.tester.device.applied.count(CommandCode.PRESET) == 2
    assert cycles >= 3
    assert all(point.within_tolerance for point in laboratory.points)


def test_an_interlock_during_a_record_is_noticed_and_the_record_is_not_kept(laboratory: SweepLaboratory) -> None:
    run = Run(laboratory.sweep, RunControl())
    until(lambda: recording(laboratory))
    laboratory.tester.emergency_stop()
    assert "emergency stop" in str(run.ended())
    assert laboratory.points == []


@pytest.fixture
def cycling() -> Iterator[tuple[Server, tester.Tester]]:
    server = start_tester_server(ordinary_bench(3, Clock(200.0)), limits=DeviceLimits(watchdog_time=1.0))
    with ExitStack() as stack:
        stack.callback(server.stop)
        driver = stack.enter_context(tester.connect(server.url, timeout=0.3))
        driver.start()
        driver.preset(5e-4)
        driver.cycle(1e-4, 50.0)
        yield server, driver


def test_a_halted_tester_moves_only_after_its_release(cycling: tuple[Server, tester.Tester]) -> None:
    server, driver = cycling
    driver.halt()
    assert driver.status().state is State.HELD
    for move in (driver.start, lambda: driver.preset(4e-4), lambda: driver.cycle(1e-4, 40.0)):
        with pytest.raises(MotionHaltedError, match="halted"):
            move()
    driver.release()
    with pytest.raises(MotionHaltedError):
        driver.measured()  # what was commanded before the halt is no more
    driver.cycle(1e-4, 40.0)
    assert driver.measured().frequency == 40.0
    assert server.device.applied.count(CommandCode.CYCLE) == 2


def test_a_halt_that_the_tester_refuses_is_an_emergency_stop(cycling: tuple[Server, tester.Tester]) -> None:
    server, driver = cycling
    server.faults.set("refuse")
    driver.halt()
    assert driver.status().interlocks is Interlock.EMERGENCY_STOP
    with pytest.raises(StopDisobeyedError) as said:
        driver.check_obeys()
    assert isinstance(said.value.__cause__, TesterRefusedError)  # and not the silence of a last hurried attempt
    assert server.actuator.steady_pp() == 0.0
    server.faults.clear()


@pytest.mark.parametrize("kind", [MotionHaltedError, AcquisitionCancelledError])
def test_an_interruption_without_a_request_is_an_error(kind: type[Exception]) -> None:
    def step() -> None:
        raise kind("by another cause")

    with pytest.raises(kind, match="another cause"):
        RunControl().carry_out(step, lambda _: None)


def test_a_pause_between_the_wait_and_the_step_is_no_error_of_the_step() -> None:
    class PausingLatch(StopLatch):
        checks = 0

        def check(self, lease: int | None = None, epoch: int | None = None) -> None:
            super().check(lease, epoch)
            self.checks += 1
            if self.checks == 1:  # the wait is over, and the step has not begun
                control.pause()

    def step() -> str:
        if control.is_interrupted():
            raise MotionHaltedError("halted by the pause")
        return "done"

    def resume(event: Event) -> None:
        if isinstance(event, RunPaused):
            control.resume()

    control = RunControl(PausingLatch())
    assert control.carry_out(step, resume) == "done"


# -- hammer


@dataclass
class Session(Operator, BlowSink):
    """A hammer session whose hand strikes while `struck` is set."""

    bench: SimulatedBench
    struck: threading.Event = field(default_factory=threading.Event)
    asked: list[int] = field(default_factory=list)
    blows: list[int] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)

    def strike(self, point: Dof, blow: int) -> None:
        self.asked.append(blow)
        if self.struck.is_set():
            self.bench.strike(point.node, str(point.direction))

    def mount(self, specimen: str, configuration: str) -> None:
        raise AssertionError("a hammer session mounts nothing")

    def add_blow(self, point: Dof, number: int, block: object, verdict: object) -> None:
        self.blows.append(number)


@pytest.fixture
def hammer() -> Iterator[tuple[Session, Callable[[RunControl], None]]]:
    bench = ordinary_bench(7, Clock(100.0), BenchConditions(double_hits=0.0))
    server = start_daq_server(bench)
    session = Session(bench)

    def run(control: RunControl) -> None:
        step = HammerStep(step="hammer", points=("5y",), blows=2, block_seconds=0.5, trigger_level=5.0)
        with device.connect(server.address) as chassis:
            run_hammer_session(chassis, HAMMER_CHANNELS, step, session, session, session.events.append, control)

    yield session, run
    server.stop()


def test_a_paused_hammer_session_asks_for_the_same_blow_again(
    hammer: tuple[Session, Callable[[RunControl], None]],
) -> None:
    session, session_run = hammer
    control = RunControl()
    run = Run(session_run, control)
    until(lambda: session.asked == [1])
    control.pause()
    until(lambda: any(isinstance(event, RunPaused) for event in session.events))
    session.struck.set()
    control.resume()
    assert run.ended() is None
    assert session.asked == [1, 1, 2]
    assert session.blows == [1, 2]


def test_a_stopped_hammer_session_does_not_wait_for_the_blow(
    hammer: tuple[Session, Callable[[RunControl], None]],
) -> None:
    session, session_run = hammer
    control = RunControl()
    run = Run(session_run, control)
    until(lambda: session.asked == [1])
    began = time.monotonic()
    control.stop()
    assert isinstance(run.ended(), RunStoppedError)
    assert time.monotonic() - began < 30.0  # of the 60 s that the hand has
    assert session.blows == []
