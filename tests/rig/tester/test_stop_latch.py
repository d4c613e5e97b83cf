"""STOP is latched: what may move, who may reset, and that no motion command is written after a STOP."""

import struct
import sys
import threading
from collections.abc import Iterator
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from daq.errors import AcquisitionCancelledError
from jointlab.runs.carry_out import run_sequence
from rig.control import RunControl
from rig.errors import RunStoppedError
from rig.instruments import Instruments
from rig.operator import Operator
from rig.registers import COMMAND, CommandCode, State
from rig.sequences.sequence import Sequence
from rig.sequences.sweep_plan import SweepPlan
from rig.tester import driver as tester
from rig.tester.modbus import WRITE_HOLDING
from rig.tester.status import MotionHaltedError
from rig.tester.stop_latch import LONGEST_TEXT, LeaseLostError, StopLatch, StopNotResetError
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.laboratory import Laboratory
from simlab.tester_server import TesterServer as Server
from simlab.tester_server import start_tester_server
from store.catalogue import Catalogue
from tests.fault_proxy import FaultProxy, Impairment, Way
from tests.rig.person import Person
from tests.rig.sweeping import Run, recording, sweeping
from tests.waiting import until

MOTION = {CommandCode.HYDRAULICS_ON, CommandCode.PRESET, CommandCode.CYCLE}


class Latch(RuleBasedStateMachine):
    """The latch beside a model of it: the number of STOPs, which of them is in force, and who holds the lease."""

    def __init__(self) -> None:
        super().__init__()
        self.latch = StopLatch()
        self.epoch = self.asked_at = self.latch.epoch
        self.stopped = False
        self.lease: int | None = None

    @rule()
    def stop(self) -> None:
        self.epoch += 1
        self.stopped = True
        assert self.latch.stop("page", "STOP was pressed").epoch == self.epoch

    @rule(age=st.integers(0, 2), lease=st.none() | st.integers(1, 3))
    def reset(self, age: int, lease: int | None) -> None:
        try:
            self.latch.reset(self.epoch - age, lease)
        except StopNotResetError:
            assert age
        except LeaseLostError:
            assert lease is not None
            assert lease != self.lease
        else:
            assert not age
            assert lease in (None, self.lease)
            self.stopped = False

    @rule(lease=st.integers(1, 3))
    def take(self, lease: int) -> None:
        self.latch.let_drive(lease)
        self.lease = lease

    @rule(lease=st.none() | st.integers(1, 3))
    def move(self, lease: int | None) -> None:
        try:
            with self.latch.moving(lease):
                assert not self.stopped
                assert lease in (None, self.lease)
        except RunStoppedError:
            assert self.stopped
        except LeaseLostError:
            assert lease not in (None, self.lease)

    @rule()
    def ask(self) -> None:
        """For a motion that is carried out later."""
        self.asked_at = self.latch.epoch

    @rule()
    def move_as_asked(self) -> None:
        is_ended = self.stopped or self.epoch > self.asked_at
        try:
            with self.latch.moving(epoch=self.asked_at):
                assert not is_ended
        except RunStoppedError:
            assert is_ended

    @invariant()
    def agrees(self) -> None:
        assert (self.latch.in_force is not None) == self.stopped
        assert (self.latch.stop_since(self.asked_at) is not None) == (self.stopped or self.epoch > self.asked_at)


TestLatch = Latch.TestCase


def test_a_reset_of_another_stop_than_that_in_force_says_so() -> None:
    latch = StopLatch()
    first, last = latch.stop("page", "STOP was pressed").epoch, latch.stop("page", "STOP was pressed").epoch
    for epoch in (first, last + 1):
        with pytest.raises(StopNotResetError, match="another STOP is in force than the one that you have seen"):
            latch.reset(epoch)
    for _ in range(2):  # a repeat, as its answer may be lost
        latch.reset(last)
    for epoch in (first, last + 1):
        with pytest.raises(StopNotResetError, match="there is nothing to reset: no STOP is in force"):
            latch.reset(epoch)


@pytest.fixture
def eager_threads() -> Iterator[None]:
    """Let threads take turns as often as the interpreter can."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


@pytest.mark.usefixtures("eager_threads")
@settings(max_examples=30)
@given(st.lists(st.sampled_from(["stop", "reset"]), min_size=1, max_size=12), st.integers(1, 3))
def test_no_interleaving_writes_motion_between_a_stop_and_its_reset(orders: list[str], movers: int) -> None:
    latch, log, over = StopLatch(), list[str](), threading.Event()

    def move() -> None:
        while not over.is_set():
            try:
                with latch.moving():
                    log.append("moving")
                    log.append("moved")
            except RunStoppedError:
                log.append("refused")

    threads = [threading.Thread(target=move) for _ in range(movers)]
    for thread in threads:
        thread.start()
    for order in orders:
        known = len(log)
        if order == "stop":
            latch.stop("test", "to see whether it holds")
            log.append("stop")
        elif latch.in_force is not None:
            log.append("reset")
            latch.reset(latch.in_force.epoch)
        until(lambda known=known: len(log) > known + 2)  # type: ignore[misc]  # every mover had a turn, or one had some
    over.set()
    for thread in threads:
        thread.join()
    may_move, within = True, False
    for entry in log:
        if entry == "stop":
            assert not within, "STOP came between the check and the write"
            may_move = False
        elif entry == "reset":
            may_move = True
        elif entry in ("moving", "moved"):
            assert may_move, log
            within = entry == "moving"


def test_a_latch_keeps_no_more_than_the_latest_stop_however_long_its_words() -> None:
    latch = StopLatch()
    for _ in range(3):
        latch.stop("x" * 10_000, "y" * 10_000)
    assert latch.in_force is not None
    assert (len(latch.in_force.who), len(latch.in_force.why)) == (LONGEST_TEXT, LONGEST_TEXT)


@pytest.fixture
def server() -> Iterator[Server]:
    bench = ordinary_bench(11, Clock(speed=200.0))
    bench.mount("I", "shear")
    server = start_tester_server(bench)
    yield server
    server.stop()


def test_nothing_moves_a_tester_while_stop_is_in_force(server: Server) -> None:
    latch = StopLatch()
    with tester.connect(server.url, latch=latch) as driver:
        driver.start()
        driver.preset(5e-4)
        stop = latch.stop("page", "STOP was pressed")
        driver.halt()
        driver.release()  # of the halt; the latch stays
        for move in (driver.start, lambda: driver.preset(4e-4), lambda: driver.cycle(1e-4, 40.0)):
            with pytest.raises(RunStoppedError, match=r"STOP is in force \(page: STOP was pressed\)"):
                move()
        latch.reset(stop.epoch)
        with pytest.raises(
            RunStoppedError, match=r"STOP was pressed meanwhile \(page: STOP was pressed\), and reset since"
        ):
            driver.cycle(1e-4, 40.0)
    with tester.connect(server.url, latch=latch) as driver:
        driver.start()
        driver.preset(5e-4)
        driver.cycle(1e-4, 40.0)
    assert [code for code in server.device.applied if code in MOTION] == [
        CommandCode.HYDRAULICS_ON,
        CommandCode.PRESET,
        CommandCode.HYDRAULICS_ON,
        CommandCode.PRESET,
        CommandCode.CYCLE,
    ]


def test_a_motion_command_whose_reply_was_lost_is_not_sent_again_after_a_stop(server: Server) -> None:
    latch, proxy, errors = StopLatch(), FaultProxy(server.url.removeprefix("tcp://")), list[Exception]()

    def cycle() -> None:
        try:
            driver.cycle(1e-4, 40.0)
        except RunStoppedError as error:
            errors.append(error)

    try:
        with tester.connect(f"tcp://{proxy.address}", timeout=0.3, latch=latch) as driver:
            driver.start()
            driver.preset(5e-4)
            proxy.impair(Impairment(lost=Way.BOTH))
            waiting = threading.Thread(target=cycle)
            waiting.start()
            until(lambda: any(is_command(piece) for piece in tuple(proxy.lost)))  # only then it cannot arrive after all
            latch.stop("page", "STOP was pressed")
            proxy.repair()
            waiting.join()
            assert len(errors) == 1
        assert CommandCode.CYCLE not in server.device.applied
    finally:
        proxy.stop()


def is_command(frame: bytes) -> bool:
    """Whether this request on Modbus TCP writes the COMMAND block."""
    return frame[7:10] == struct.pack(">BH", WRITE_HOLDING, COMMAND.address)


def test_a_stop_before_a_run_begins_keeps_it_from_moving_however_late_it_begins(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person, whole_laboratory: Laboratory
) -> None:
    """A start that waits, for a locked database say, must not move the actuator after a STOP in the meantime."""
    before = len(whole_laboratory.tester.device.applied)
    instruments = replace(instruments, latch=StopLatch())
    with catalogue.writing():  # another writer: the start waits for it
        waiting = threading.Thread(target=lambda: started(sequence, instruments, catalogue, person))
        waiting.start()
        instruments.latch.stop("page", "STOP was pressed")
    waiting.join()
    assert not MOTION & set(whole_laboratory.tester.device.applied[before:])


def started(sequence: Sequence, instruments: Instruments, catalogue: Catalogue, operator: Operator) -> None:
    with pytest.raises(RunStoppedError, match="STOP is in force"):
        run_sequence(sequence, instruments, catalogue, operator)


def test_a_sweep_ends_as_stopped_when_the_latch_is_set_and_the_tester_halted() -> None:
    plan = SweepPlan(
        frequencies=(20.0,), amplitudes_pp=(1e-4,), configurations=("shear",), specimens=("I",), shortest_record=3.0
    )
    with sweeping(plan, 10.0) as laboratory:
        run = Run(laboratory.sweep, control := RunControl(laboratory.latch))
        until(lambda: recording(laboratory))
        laboratory.latch.stop("page", "STOP was pressed")
        control.stop()
        assert isinstance(run.ended(), RunStoppedError)
        assert laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF


def test_a_paused_run_is_resumed_by_the_present_holder_of_the_lease_only() -> None:
    latch = StopLatch()
    latch.let_drive(1)
    control = RunControl(latch, lease=1)
    control.begin()
    control.pause()
    latch.let_drive(2)
    with pytest.raises(LeaseLostError):
        control.resume(1)
    assert control.is_paused()
    control.resume(2)
    assert not control.is_interrupted()


@pytest.mark.parametrize("kind", [MotionHaltedError, AcquisitionCancelledError])
@pytest.mark.parametrize("by_person", [True, False])
def test_a_stop_ends_what_it_interrupted_as_stopped_also_where_it_is_reset_at_once(
    kind: type[Exception], by_person: bool
) -> None:
    latch = StopLatch()
    latch.reset(latch.stop("page", "before the run").epoch)
    control, steps = RunControl(latch), list[bool]()

    def step() -> None:
        latch.reset(latch.stop("page", "a hose leaks", by_person=by_person).epoch)
        steps.append(control.is_interrupted())
        raise kind("because of the STOP")

    with pytest.raises(RunStoppedError, match=r"STOP was pressed meanwhile \(page: a hose leaks\), and reset since"):
        control.carry_out(step, lambda _: None)
    assert steps == [True]  # and no second one
    assert control.stopped_by == ("page" if by_person else None)
    assert control.automatic_stop_reason == (None if by_person else "STOP by page: a hose leaks")
    for move in (control.begin, control.resume):
        with pytest.raises(RunStoppedError):
            move()
    RunControl(latch).begin()  # the next run is free


def test_a_start_that_waited_while_another_client_took_the_rig_does_not_begin() -> None:
    latch = StopLatch()
    latch.let_drive(1)
    control = RunControl(latch, lease=1)
    latch.let_drive(2)
    with pytest.raises(LeaseLostError, match="another client has taken the rig"):
        control.begin()
