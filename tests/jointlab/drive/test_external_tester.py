"""A rig whose tester its own software drives: its drive process, and what STOP says of such a machine."""

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from api.page.frame import badge_of
from jointlab.drive.phase import Phase
from jointlab.drive.process import Drive, driving
from jointlab.drive.protocol import Acknowledge, AnswerPrompt, Begin, Examine, StopNow
from jointlab.hall import ReportedState
from jointlab.settings import DriveSettings, Settings
from jointlab.supervision.drive_link import NEEDED, DriveLink
from jointlab.trials.simulated_laboratory import simulated_settings
from rig.checks.check import CheckState
from rig.checks.examination import Examination
from rig.errors import RigError
from rig.instruments import EXTERNAL
from rig.runs.records import RunOrder
from rig.tester.limits import TesterLimits
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from store.states import RunState
from tests.jointlab.drive.conftest import Heard, Kept
from tests.waiting import until

PRESSED = "STOP did not stop the machine: this machine is not driven from here. Press its own stop. Recording has ended"


@pytest.fixture
def drive_settings(laboratory: Laboratory, tmp_path: Path) -> Settings:
    found = simulated_settings(
        laboratory.addresses, drive=DriveSettings(folder=tmp_path / "drive", stop_port=0), rig="rig under test"
    )
    return found.model_copy(update={"tester_url": EXTERNAL})


@pytest.fixture
def moving(link: DriveLink, heard: Heard, order: RunOrder, hand: OperatorClient) -> Iterator[None]:
    """A run that waits for points, on a machine that moves otherwise than planned."""
    lease = link.take_lease("test")
    link.ask(Begin(order=order, limits=TesterLimits(), lease=lease))
    until(lambda: heard.now.prompt is not None)
    assert heard.now.prompt is not None
    link.ask(AnswerPrompt(run_id=1, prompt=heard.now.prompt.number, lease=lease))
    hand.do("run_points", preset=5e-4, points=[[1e-4, 10.0]])
    until(lambda: heard.now.state.activity == "sees 10 Hz at 0.1 mm: not in the plan")
    yield
    hand.do("rest")


@pytest.mark.usefixtures("moving")
def test_stop_ends_the_run_and_says_that_the_machine_is_to_be_stopped_by_its_own_stop(
    drive: Drive, heard: Heard, laboratory: Laboratory, kept: Kept
) -> None:
    answer = httpx.post(f"http://127.0.0.1:{drive.listener.port}/stop")
    assert (answer.status_code, answer.json()) == (502, {"latched": True, "at_rest": False, "detail": PRESSED})
    # it moves on, as STOP says; between two points it rests for a moment
    until(lambda: laboratory.tester.actuator.steady_pp() > 0)
    assert heard.end() is RunState.STOPPED
    assert heard.now.stop is not None
    assert not kept.sines
    assert badge_of(heard.now.state) == ("not driven from here", "idle")


def test_stop_of_an_idle_rig_claims_no_rest_either(drive: Drive, link: DriveLink) -> None:
    with pytest.raises(RigError, match=PRESSED):
        link.ask(StopNow(who="test", why="it was pressed"))
    told = ReportedState.model_validate(httpx.get(f"http://127.0.0.1:{drive.listener.port}/state").json())
    assert (told.phase, told.is_driven) == (Phase.IDLE, False)


def test_the_points_to_run_are_a_prompt_that_needs_no_answer(
    link: DriveLink, heard: Heard, order: RunOrder, hand: OperatorClient
) -> None:
    lease = link.take_lease("test")
    link.ask(Begin(order=order, limits=TesterLimits(), lease=lease))
    until(lambda: heard.now.prompt is not None)
    assert heard.now.prompt is not None
    link.ask(AnswerPrompt(run_id=1, prompt=heard.now.prompt.number, lease=lease))
    until(lambda: heard.now.prompt is not None and heard.now.prompt.kind == "points")
    asked = heard.now.prompt
    assert not asked.waits
    assert asked.text.startswith(
        "let the machine's own software run, in any order, about a mean of 0.5 mm, 0.1 mm peak "
    )
    hand.do("run_points", preset=5e-4, points=[[1e-4, 20.0], [1e-4, 120.0]])
    until(lambda: heard.now.state.sines == 2)
    hand.do("rest")


def test_nothing_is_asked_of_the_tester(link: DriveLink) -> None:
    lease = link.take_lease("test")
    found = link.ask(Examine(asked=Examination(), lease=lease)).value
    states = {check["id"]: check["state"] for check in found["checks"] if check["subject"] == "tester"}
    assert set(states.values()) == {CheckState.NOT_DONE}
    assert {"identity", "interlocks", "watchdog", "emergency_stop"} == set(states)
    with pytest.raises(RigError, match="not driven from here; use its own controls"):
        link.ask(Acknowledge(lease=lease))


def test_two_rigs_may_have_an_external_tester_each(drive: Drive, drive_settings: Settings, tmp_path: Path) -> None:
    other = drive_settings.model_copy(
        update={"rig": "another rig", "drive": DriveSettings(folder=tmp_path / "other", stop_port=0)}
    )
    with driving(other) as second:
        assert second.rig.name != drive.rig.name


def test_a_drive_process_of_its_own_gets_what_it_needs(drive_settings: Settings) -> None:
    patient = drive_settings.model_copy(update={"external_patience": 7.0})
    given = Settings.model_validate_json(patient.model_dump_json(include=NEEDED))
    assert (given.tester_url, given.external_patience) == (EXTERNAL, 7.0)
