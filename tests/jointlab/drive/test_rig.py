"""Driving a rig over its socket: STOP is latched, and a lease is compared at the moment of driving."""

import threading
import tracemalloc
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress

import httpx
import pytest

from jointlab.drive import server
from jointlab.drive.endpoint import UnansweredError, connect
from jointlab.drive.phase import Phase
from jointlab.drive.process import Drive
from jointlab.drive.protocol import AnswerPrompt, Ask, AskOutcome, Begin, End, Follow, Pause, ResetStop, Resume, StopNow
from jointlab.errors import ConflictError
from jointlab.settings import Settings
from jointlab.supervision.drive_link import DriveLink
from rig.errors import RigError, RunStoppedError
from rig.registers import Interlock, Refusal, State
from rig.runs.records import BlowRecord, EndRecord, RunOrder
from rig.sequences.sequence import sequence_from
from rig.tester import driver as tester
from rig.tester.actuator_stop import REST_UNKNOWN
from rig.tester.limits import TesterLimits
from rig.tester.stop_latch import LeaseLostError, StopNotResetError
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from simlab.tester_server import TesterFault
from simlab.thermometer_server import ThermometerFault
from store.states import RunState
from tests.api.conftest import paper
from tests.jointlab.drive.conftest import SWEEP, Heard, Kept, begin, is_at_rest
from tests.waiting import LONG, until


def test_a_run_tells_what_happens_and_ends_when_it_is_asked_to(
    link: DriveLink, heard: Heard, order: RunOrder, hand: OperatorClient, laboratory: Laboratory, kept: Kept
) -> None:
    lease = link.take_lease("test")
    begin(link, heard, order, lease)
    pause = link.ask(Pause(run_id=1)).value
    assert is_at_rest(laboratory)
    until(lambda: heard.now.state.phase is Phase.PAUSED)
    measured = heard.now.state.sines
    link.ask(Resume(run_id=1, lease=lease, pause=pause))
    until(lambda: heard.now.state.sines > measured)
    link.ask(End(run_id=1))
    assert is_at_rest(laboratory)
    assert heard.end() is RunState.STOPPED
    assert kept.sines == list(range(1, heard.now.state.sines + 1))
    assert next(name for name in heard.names if name != "TesterAnswers") == "LeaseChanged"  # it was read at first
    assert heard.names.count("SinePointMeasured") == heard.now.state.sines
    assert heard.now.stop is None


def test_a_stop_from_the_listener_is_latched_until_the_holder_of_the_lease_resets_it(
    drive: Drive, link: DriveLink, heard: Heard, order: RunOrder, hand: OperatorClient, laboratory: Laboratory
) -> None:
    lease = link.take_lease("test")
    begin(link, heard, order, lease)
    address = f"http://127.0.0.1:{drive.listener.port}"
    assert httpx.post(f"{address}/stop").json()["at_rest"] is True
    assert is_at_rest(laboratory)
    assert heard.end() is RunState.STOPPED
    first = heard.now.stop
    assert first is not None
    with pytest.raises(RunStoppedError, match="STOP is in force"):
        link.ask(Begin(order=order, limits=TesterLimits(), lease=lease))
    httpx.post(f"{address}/stop")
    with pytest.raises(StopNotResetError):
        link.ask(ResetStop(epoch=first.epoch, lease=lease))
    epoch = httpx.get(f"{address}/state").json()["stop"]["epoch"]
    with pytest.raises(LeaseLostError):
        link.ask(ResetStop(epoch=epoch, lease=lease - 1))
    link.ask(ResetStop(epoch=epoch, lease=lease))
    until(lambda: heard.now.stop is None)
    begin(link, heard, order, lease)


def test_a_run_that_fails_where_neither_hold_nor_emergency_stop_helps_is_told_as_not_confirmed_at_rest(
    link: DriveLink, heard: Heard, order: RunOrder, hand: OperatorClient, laboratory: Laboratory, kept: Kept
) -> None:
    begin(link, heard, order, link.take_lease("test"))
    laboratory.tester.script.set("HOLD", Refusal.FAULT)
    laboratory.tester.script.set("HYDRAULICS_OFF", Refusal.FAULT)
    laboratory.tester.faults.set(TesterFault.DEAD_EMERGENCY_STOP)
    laboratory.thermometer.faults.set(ThermometerFault.SILENT)
    try:
        assert heard.end() is RunState.FAILED
    finally:
        laboratory.tester.script.clear()
    (end,) = (record for record in kept.records if isinstance(record, EndRecord))
    with pytest.raises(RigError) as told:
        link.ask(AskOutcome())
    for said in (heard.now.state.reason, end.reason, str(told.value)):
        assert said is not None
        assert said.startswith("thermometer at")
        assert said.count(REST_UNKNOWN) == 1


def test_a_run_that_is_still_being_stopped_is_not_resumed_also_where_its_stop_was_reset(
    drive: Drive, link: DriveLink, heard: Heard, order: RunOrder, hand: OperatorClient, kept: Kept,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    lease, may_halt = link.take_lease("test"), threading.Event()
    begin(link, heard, order, lease)
    halt = drive.rig.halter._halt

    def halt_later() -> None:
        may_halt.wait(LONG)
        halt()

    monkeypatch.setattr(drive.rig.halter, "_halt", halt_later)
    drive.rig.halter.press("test")
    until(lambda: heard.now.stop is not None)
    assert heard.now.stop is not None
    with pytest.raises(RunStoppedError, match="STOP is in force"):
        link.ask(Resume(run_id=1, lease=lease, pause=1))
    link.ask(ResetStop(epoch=heard.now.stop.epoch, lease=lease))
    with pytest.raises(ConflictError, match="run 1 is still being stopped; resume it when it has ended"):
        link.ask(Resume(run_id=1, lease=lease, pause=1))
    may_halt.set()
    assert heard.end() is RunState.STOPPED


@pytest.fixture
def striking(link: DriveLink, heard: Heard) -> None:
    """A run that waits for a blow, and does not drive the tester meanwhile."""
    document = paper()
    hammer = document["steps"][0] | {"points": ["1y", "3y"]}
    sequence = sequence_from(document | {"steps": [hammer, SWEEP]}).with_seed()
    link.ask(Begin(order=RunOrder(1, "run-1", sequence, "test"), limits=TesterLimits(), lease=link.take_lease("test")))
    until(lambda: heard.now.prompt is not None)


def test_no_blow_is_asked_for_once_the_last_one_was_taken(
    link: DriveLink, heard: Heard, hand: OperatorClient, kept: Kept
) -> None:
    document, lease = paper(), link.take_lease("test")
    hammer = document["steps"][0] | {"points": ["5y"], "blows": 2, "block_seconds": 1.0}
    sequence = sequence_from(document | {"steps": [hammer, {"step": "wait", "seconds": 3600}]}).with_seed()
    link.ask(Begin(order=RunOrder(1, "run-1", sequence, "test"), limits=TesterLimits(), lease=lease))
    obeyed = list[int]()

    def obey_until_it_waits() -> bool:
        prompt = heard.now.prompt
        if prompt is not None and prompt.number not in obeyed:
            obeyed.append(prompt.number)
            if prompt.waits:
                link.ask(AnswerPrompt(run_id=1, prompt=prompt.number, lease=lease))
            else:
                hand.do("strike", node=5, direction="y")
        return "WaitStarted" in heard.names

    until(obey_until_it_waits)
    assert sum(isinstance(record, BlowRecord) for record in kept.records) >= 2
    assert heard.now.prompt is None
    link.ask(End(run_id=1))


@pytest.mark.usefixtures("striking")
def test_stop_waits_for_no_answer_that_itself_waits_for_the_state_of_the_rig(drive: Drive, heard: Heard) -> None:
    """A takeover of the rig holds the state while it changes the lease; an answer needs the state."""
    rig, prompt = drive.rig, heard.now.prompt
    assert prompt is not None

    def answer() -> None:
        with suppress(RunStoppedError):  # on a slow computer STOP is there before the answer
            rig.answer(1, prompt.number, rig.lease)

    stop = threading.Thread(target=drive.rig.halter.press, args=("test", "in between"), daemon=True)
    answering = threading.Thread(target=answer, daemon=True)
    with rig._state_lock:
        answering.start()
        answering.join(0.3)
        stop.start()
        until(lambda: rig._latch.in_force is not None)
    answering.join(LONG)
    stop.join(LONG)
    assert not answering.is_alive()
    assert not stop.is_alive()


@pytest.mark.usefixtures("striking")
def test_a_tester_that_does_not_answer_while_the_hammer_strikes_is_not_told_as_at_rest(
    drive: Drive, heard: Heard, laboratory: Laboratory
) -> None:
    address = f"http://127.0.0.1:{drive.listener.port}/stop"
    laboratory.tester.faults.set(TesterFault.SILENT)
    answer = httpx.post(address, timeout=LONG)
    assert (answer.status_code, answer.json()["at_rest"]) == (502, False)
    assert heard.end() is RunState.STOPPED
    laboratory.tester.faults.clear()
    assert httpx.post(address, timeout=LONG).json()["at_rest"] is True


def test_a_stop_at_a_tester_that_does_not_answer_is_told_as_not_confirmed_with_its_answer_until_rest_is_read(
    drive: Drive, laboratory: Laboratory
) -> None:
    laboratory.tester.faults.set(TesterFault.SILENT)
    answer = httpx.post(f"http://127.0.0.1:{drive.listener.port}/stop", timeout=LONG).json()
    state = httpx.get(f"http://127.0.0.1:{drive.listener.port}/state", timeout=LONG).json()
    assert answer["at_rest"] is False
    assert state["rest_unknown"] == answer["detail"]
    laboratory.tester.faults.clear()
    until(lambda: drive.rig.snapshot().state.rest_unknown is None)


@pytest.mark.usefixtures("striking")
def test_a_tester_at_rest_is_looked_at_and_not_commanded_while_the_hammer_strikes(
    drive: Drive, laboratory: Laboratory
) -> None:
    before = len(laboratory.tester.device.applied)
    answer = httpx.post(f"http://127.0.0.1:{drive.listener.port}/stop", timeout=LONG)
    assert answer.json() == {"latched": True, "at_rest": True, "detail": "the actuator is at rest"}
    assert len(laboratory.tester.device.applied) == before


@pytest.mark.usefixtures("striking")
def test_a_tester_that_another_client_moves_while_the_hammer_strikes_is_halted(
    drive: Drive, laboratory: Laboratory
) -> None:
    with suppress(RigError), tester.connect(laboratory.addresses.tester) as other:  # which is disturbed, as it is told
        other.start()
        other.preset(5e-4)
        other.cycle(1e-4, 20.0)
        answer = httpx.post(f"http://127.0.0.1:{drive.listener.port}/stop", timeout=LONG)
        assert answer.json()["at_rest"] is True
        assert is_at_rest(laboratory)


@pytest.mark.parametrize("fault", [TesterFault.NO_WATCHDOG, TesterFault.MILD_DETECTOR])
def test_a_tester_that_may_not_be_driven_and_that_another_client_moves_is_halted(
    drive: Drive, laboratory: Laboratory, fault: TesterFault
) -> None:
    with suppress(RigError), tester.connect(laboratory.addresses.tester) as other:  # which is disturbed, as it is told
        other.start()
        other.preset(5e-4)
        other.cycle(1e-4, 20.0)
        laboratory.tester.faults.set(fault)
        answer = httpx.post(f"http://127.0.0.1:{drive.listener.port}/stop", timeout=LONG)
        assert answer.json()["at_rest"] is True
        assert is_at_rest(laboratory)


@contextmanager
def refused_start(
    link: DriveLink, heard: Heard, kept: Kept, order: RunOrder, lease: int, error: type[Exception]
) -> Iterator[None]:
    """Begin a run, whose records are opened only when the context is left; it is then refused with this error."""
    refused = list[Exception]()

    def start() -> None:
        try:
            link.ask(Begin(order=order, limits=TesterLimits(), lease=lease))
        except error as expected:
            refused.append(expected)

    kept.may_open.clear()
    starting = threading.Thread(target=start)
    starting.start()
    until(lambda: heard.now.state.phase is Phase.STARTING)  # its lease is checked
    yield
    kept.may_open.set()
    starting.join()
    assert refused


def test_a_start_that_waits_while_stop_is_pressed_does_not_move(
    link: DriveLink, heard: Heard, order: RunOrder, laboratory: Laboratory, kept: Kept
) -> None:
    with refused_start(link, heard, kept, order, link.take_lease("test"), RunStoppedError):
        link.ask(StopNow(who="test", why="it was pressed"))
    assert not kept.records
    assert is_at_rest(laboratory)


def test_a_run_whose_program_has_stopped_waiting_for_it_does_not_begin(
    link: DriveLink, heard: Heard, order: RunOrder, laboratory: Laboratory, kept: Kept
) -> None:
    kept.may_open.clear()
    with pytest.raises(UnansweredError):
        link.ask(Begin(order=order, limits=TesterLimits(), lease=link.take_lease("test")), timeout=0.2)
    until(lambda: "RunStopping" in heard.names)  # it is seen at the next look that nobody waits
    kept.may_open.set()
    assert heard.end() is RunState.CREATED  # it may be started again
    assert heard.now.state.reason is not None
    assert heard.now.state.reason.startswith("the program that began it did not wait")
    assert not kept.records
    assert is_at_rest(laboratory)


def test_a_lease_that_is_taken_by_force_ends_what_was_asked_for_before(
    link: DriveLink, order: RunOrder, heard: Heard, kept: Kept, laboratory: Laboratory
) -> None:
    former = link.take_lease("one")
    with refused_start(link, heard, kept, order, former, LeaseLostError):
        link.take_lease("another")
    until(lambda: heard.now.state.phase is Phase.IDLE)
    assert laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF
    with pytest.raises(LeaseLostError, match="another client has taken the rig"):
        link.ask(Begin(order=order, limits=TesterLimits(), lease=former))
    assert heard.now.holder == "another"


def test_another_program_drives_only_by_force_or_when_the_first_has_gone(
    drive_settings: Settings, link: DriveLink, heard: Heard
) -> None:
    link.take_lease("one")
    other = DriveLink(drive_settings, "other", lambda news: None, lambda why: None, lambda welcome: None, starts=False)
    with pytest.raises(ConflictError, match="one drives the rig from another program"):
        other.take_lease("two")
    other.take_lease("two", by_force=True)
    until(lambda: heard.now.holder == "two")
    other.close()
    until(lambda: heard.now.holder is None)
    link.take_lease("one")


def test_a_follower_goes_on_after_the_last_event_it_knows(drive: Drive, link: DriveLink, heard: Heard) -> None:
    for number in range(1000):
        link.take_lease(str(number))
    until(lambda: heard.names.count("LeaseChanged") == 1000)
    numbers = [entry.number for news in heard.news for entry in news.entries]
    assert numbers == list(range(1, len(numbers) + 1))


def test_a_large_request_is_not_looked_at_while_the_rig_works(
    link: DriveLink, heard: Heard, order: RunOrder, hand: OperatorClient
) -> None:
    def answer(line: bytes) -> str:
        with closing(connect(link.folder, LONG)) as connection:
            connection.sendall(line)
            return connection.makefile("rb").readline().decode()

    large = b'{"do": "begin", "order": [' + server.SHORT * b"[]," + b"[]]}\n"
    assert "does not understand" in answer(large)
    begin(link, heard, order, link.take_lease("test"))
    assert f"a request of {len(large)} bytes is not looked at" in answer(large)
    assert '"holder":"test"' in answer(Ask().model_dump_json().encode() + b"\n")


def test_a_large_request_is_not_kept_in_memory_while_the_rig_works(
    link: DriveLink, heard: Heard, order: RunOrder, hand: OperatorClient
) -> None:
    begin(link, heard, order, link.take_lease("test"))
    piece = server.SHORT * b"x"
    tracemalloc.start()
    try:
        with closing(connect(link.folder, LONG)) as connection:
            for _ in range(400):  # 25 MB
                connection.sendall(piece)
            connection.sendall(b"\n")
            answer = connection.makefile("rb").readline().decode()
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert f"a request of {400 * server.SHORT + 1} bytes is not looked at" in answer
    assert most < 200 * server.SHORT  # the run's own records are in it


def test_a_program_that_does_not_read_delays_nobody(
    drive: Drive, link: DriveLink, heard: Heard, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "SEND_TIMEOUT", 10 * LONG)  # none is dropped: what waits for one has no answer in time
    silent = [connect(link.folder, LONG) for _ in range(10)]
    for each in silent:
        each.sendall(Follow(epoch=None, after=0).model_dump_json().encode() + b"\n")
    for number in range(3000):
        drive.rig.take_lease(str(number))
    for _ in range(20):
        link.ask(Ask())
        stopped = httpx.post(f"http://127.0.0.1:{drive.listener.port}/stop", timeout=LONG)
        assert stopped.json()["at_rest"] is True
    for each in silent:
        each.close()


@pytest.mark.parametrize("by_person", [False, True])
def test_the_end_of_a_run_says_whether_a_person_asked_for_it(
    drive: Drive, link: DriveLink, heard: Heard, order: RunOrder, hand: OperatorClient, kept: Kept, by_person: bool
) -> None:
    begin(link, heard, order, link.take_lease("test"))
    drive.rig.halter.press("button at COM3", "its line is lost", by_person)
    assert heard.end() is RunState.STOPPED
    end = kept.records[-1]
    assert isinstance(end, EndRecord)
    assert (end.by_itself, end.who, end.reason) == (
        not by_person,
        "button at COM3" if by_person else None,
        "stopped by hand" if by_person else "STOP by button at COM3: its line is lost",
    )


def test_a_run_that_a_program_ends_is_no_run_that_a_person_ended(
    drive: Drive, link: DriveLink, heard: Heard, order: RunOrder, hand: OperatorClient, kept: Kept
) -> None:
    begin(link, heard, order, link.take_lease("test"))
    drive.rig.end_safely("the computer goes down")
    end = kept.records[-1]
    assert isinstance(end, EndRecord)
    assert (end.state, end.by_itself, end.reason) == (RunState.STOPPED, True, "the computer goes down")


def test_a_run_that_begins_after_a_reset_by_another_client_is_not_told_as_tripped(
    link: DriveLink, heard: Heard, order: RunOrder, hand: OperatorClient, laboratory: Laboratory
) -> None:
    lease = link.take_lease("test")
    laboratory.tester.emergency_stop()
    until(lambda: heard.now.state.interlocks is Interlock.EMERGENCY_STOP)
    laboratory.tester.release_emergency_stop()
    with tester.connect(laboratory.addresses.tester) as other:
        other.reset()
    begin(link, heard, order, lease)  # before the tester is polled again
    assert not heard.now.state.interlocks
