"""Examining a rig through its drive process: by the holder of the lease alone, and never beside a run or a STOP."""

import threading

import pytest

from jointlab.drive.journal import event_of
from jointlab.drive.phase import Phase
from jointlab.drive.protocol import EXAMINED, Examine, ResetStop, StopNow
from jointlab.errors import ConflictError
from jointlab.supervision.drive_link import DriveLink
from rig.checks.check import CheckState
from rig.checks.examination import Examination
from rig.errors import RunStoppedError
from rig.events import ExaminationStep
from rig.registers import State
from rig.runs.records import RunOrder
from rig.tester.stop_latch import LeaseLostError
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from tests.jointlab.drive.conftest import Heard, begin
from tests.waiting import LONG, until


def test_an_examination_leaves_the_tester_without_pressure(link: DriveLink, laboratory: Laboratory) -> None:
    lease = link.take_lease("test")
    found = EXAMINED.validate_python(link.ask(Examine(asked=Examination(trip=True), lease=lease), LONG).value)
    assert not [check for check in found.checks if check.state is CheckState.FAILED]
    assert {each.kind for each in found.instruments} == {"acquisition", "thermometer", "tester"}
    assert laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF
    with pytest.raises(LeaseLostError):
        link.ask(Examine(asked=Examination(), lease=lease - 1), LONG)


def test_nothing_is_examined_beside_a_run(link: DriveLink, heard: Heard, order: RunOrder, hand: OperatorClient) -> None:
    lease = link.take_lease("test")
    begin(link, heard, order, lease)
    with pytest.raises(ConflictError, match="run 1 is in progress"):
        link.ask(Examine(asked=Examination(), lease=lease))


def test_stop_ends_a_trip_of_the_watchdog_at_once(link: DriveLink, heard: Heard, laboratory: Laboratory) -> None:
    lease, ended = link.take_lease("test"), list[Exception]()

    def examine() -> None:
        try:
            link.ask(Examine(asked=Examination(trip=True), lease=lease), LONG)
        except RunStoppedError as error:
            ended.append(error)

    examining = threading.Thread(target=examine)
    examining.start()
    until(lambda: laboratory.tester.device.status()["state"] not in (State.HYDRAULICS_OFF, State.TRIPPED))
    link.ask(StopNow(who="test", why="it was pressed"))
    examining.join()
    assert ended
    until(lambda: laboratory.tester.device.status()["state"] in (State.HYDRAULICS_OFF, State.TRIPPED))
    assert heard.now.stop is not None
    link.ask(ResetStop(epoch=heard.now.stop.epoch, lease=lease))


def test_the_state_of_the_rig_tells_what_is_examined_and_when_that_ends(link: DriveLink, heard: Heard) -> None:
    lease = link.take_lease("test")
    link.ask(Examine(asked=Examination(), lease=lease), LONG)
    until(lambda: "ExaminationEnded" in heard.names)
    told = [event_of(entry) for news in heard.news for entry in news.entries]
    steps = [event.subject for event in told if isinstance(event, ExaminationStep)]
    assert steps == [
        "the acquisition device", "hammer, accelerometer", "displacement, force", "the thermometer", "the tester"
    ]  # fmt: skip
    shown = {(news.snapshot.state.phase, news.snapshot.state.activity) for news in heard.news}
    assert (Phase.EXAMINING, "examining hammer, accelerometer") in shown  # its record takes 2 s
    assert (heard.now.state.phase, heard.now.state.activity) == (Phase.IDLE, "")
