"""A request from before a STOP, or for an earlier prompt or pause, moves nothing, however late it arrives."""

import threading
from dataclasses import replace

import pytest

from jointlab.drive.phase import Phase
from jointlab.drive.process import Drive
from jointlab.drive.protocol import AnswerPrompt, Begin, End, Pause, ResetStop, Resume, StopNow
from jointlab.drive.rig import DrivenRig
from jointlab.errors import ConflictError
from jointlab.supervision.drive_link import DriveLink
from rig.control import PauseOverError
from rig.errors import RunStoppedError
from rig.runs.records import RunOrder
from rig.tester.limits import TesterLimits
from rig.tester.stop_latch import StopLatch
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from tests.jointlab.drive.conftest import Heard, begin, is_at_rest
from tests.waiting import LONG, until


def test_a_resume_ends_only_the_pause_that_it_names(
    link: DriveLink, heard: Heard, order: RunOrder, hand: OperatorClient, laboratory: Laboratory
) -> None:
    lease = link.take_lease("test")
    begin(link, heard, order, lease)
    first = link.ask(Pause(run_id=1)).value
    until(lambda: heard.now.pause == first)
    second = link.ask(Pause(run_id=1)).value  # by somebody who wants to be sure
    with pytest.raises(PauseOverError, match="is over, or the run was paused once more"):
        link.ask(Resume(run_id=1, lease=lease, pause=first))
    assert is_at_rest(laboratory)
    link.ask(Resume(run_id=1, lease=lease, pause=second))
    until(lambda: heard.now.state.phase is Phase.RUNNING and heard.now.pause is None)
    link.ask(Pause(run_id=1))
    with pytest.raises(PauseOverError):
        link.ask(Resume(run_id=1, lease=lease, pause=second))
    assert is_at_rest(laboratory)


def test_an_answer_to_a_prompt_of_an_earlier_part_of_the_run_confirms_no_later_prompt(
    link: DriveLink, heard: Heard, order: RunOrder, hand: OperatorClient, laboratory: Laboratory
) -> None:
    lease, numbers = link.take_lease("test"), list[int]()
    for _ in range(2):
        link.ask(Begin(order=order, limits=TesterLimits(), lease=lease))
        until(lambda: heard.now.prompt is not None)
        assert heard.now.prompt is not None
        numbers.append(heard.now.prompt.number)
        if len(numbers) == 1:
            link.ask(End(run_id=1))
            heard.end()
            until(lambda: heard.now.prompt is None)
    with pytest.raises(ConflictError, match="is not what is asked for now; mount"):
        link.ask(AnswerPrompt(run_id=1, prompt=numbers[0], lease=lease))
    assert heard.now.prompt is not None


def test_a_start_that_waits_for_the_instruments_is_ended_by_a_stop_that_is_reset_meanwhile(
    drive: Drive, link: DriveLink, heard: Heard, order: RunOrder
) -> None:
    lease, refused = link.take_lease("test"), list[Exception]()

    def begin_later() -> None:
        try:
            link.ask(Begin(order=order, limits=TesterLimits(), lease=lease), LONG)
        except RunStoppedError as error:
            refused.append(error)

    begins = threading.Thread(target=begin_later)
    with drive.rig._lock:  # as an examination does
        begins.start()
        until(lambda: bool(drive.rig._lock._waiting))
        link.ask(StopNow(who="test", why="somebody is at the machine"), LONG)
        until(lambda: heard.now.stop is not None)
        assert heard.now.stop is not None
        link.ask(ResetStop(epoch=heard.now.stop.epoch, lease=lease))
    begins.join()
    assert refused
    assert heard.now.state.run_id is None


def test_a_start_that_names_an_earlier_stop_than_the_last_one_does_not_begin(
    link: DriveLink, heard: Heard, order: RunOrder
) -> None:
    lease = link.take_lease("test")
    until(lambda: heard.now.stop_epoch is not None)
    seen = heard.now.stop_epoch
    link.ask(StopNow(who="test", why="somebody is at the machine"), LONG)
    until(lambda: heard.now.stop is not None)
    assert heard.now.stop is not None
    link.ask(ResetStop(epoch=heard.now.stop.epoch, lease=lease))
    with pytest.raises(ConflictError, match="STOP was pressed since this was asked for"):
        link.ask(Begin(order=order, limits=TesterLimits(), lease=lease, stop_epoch=seen))


def test_numbers_of_prompts_leases_and_stops_begin_elsewhere_in_each_process(drive: Drive) -> None:
    other = DrivenRig(replace(drive.rig._instruments, latch=StopLatch()), drive.rig._records_of)
    try:
        for numbers in ((rig.lease, rig.snapshot().stop_epoch or 0) for rig in (drive.rig, other)):
            assert all(0 < number < 2**53 for number in numbers)
        assert abs(other.lease - drive.rig.lease) > 1000
        assert abs((other.snapshot().stop_epoch or 0) - (drive.rig.snapshot().stop_epoch or 0)) > 1000
        assert next(other._prompt_numbers) != next(drive.rig._prompt_numbers)
    finally:
        other.close()
