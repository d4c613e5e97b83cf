"""What the row that drives a run tells the operator."""

import pytest

from api.page.steering import beside_prompt, prompt_text
from jointlab.drive.events import PromptKind, RunEnded
from jointlab.drive.phase import Phase
from jointlab.drive.prompts import Prompt
from jointlab.drive.state import RigState, after
from rig.events import ActuatorShutDown, Event, RestUnknown
from rig.registers import Interlock
from store.states import RunState

MOUNT = Prompt(1, PromptKind.MOUNT, "mount the cylinders, and step back", waits=True)
STRIKE = Prompt(2, PromptKind.STRIKE, "strike 1y (blow 1)", waits=False)


@pytest.mark.parametrize("event", [ActuatorShutDown("hydraulics are on"), RestUnknown("hydraulics are on")])
def test_nobody_is_asked_to_mount_at_a_tester_that_was_given_up(event: Event) -> None:
    mounting = RigState(Phase.RUNNING, 7)
    assert prompt_text(mounting, MOUNT, None) == "Mount the cylinders, and step back"
    given_up = after(mounting, event)
    assert prompt_text(given_up, MOUNT, None) == "Step back, and keep away from the machine: hydraulics are on"
    ended = after(given_up, RunEnded(7, RunState.FAILED, "hydraulics are on"))
    assert prompt_text(ended, None, None) == "No run is in progress."


@pytest.mark.parametrize(
    ("phase", "prompt", "told"),
    [
        (Phase.RUNNING, STRIKE, "The trigger waits for your blow."),
        (Phase.PAUSED, STRIKE, ""),  # nothing is armed
        (Phase.STOPPING, STRIKE, ""),
        (Phase.RUNNING, MOUNT, ""),
        (Phase.PAUSED, MOUNT, "Still to be done after that: mount the cylinders, and step back."),
        (Phase.RUNNING, None, ""),
    ],
)
def test_a_blow_is_waited_for_only_where_the_trigger_is_armed(phase: Phase, prompt: Prompt | None, told: str) -> None:
    assert beside_prompt(RigState(phase, 7), prompt) == told


@pytest.mark.parametrize("phase", [Phase.RUNNING, Phase.PAUSED])
def test_a_trip_that_a_run_which_waits_does_not_notice_is_told_beside_its_prompt(phase: Phase) -> None:
    tripped = RigState(phase, 7, interlocks=Interlock.EMERGENCY_STOP)
    told = beside_prompt(tripped, MOUNT)
    assert told.endswith(
        "The emergency stop has tripped: somebody pressed it, or the program tripped it. Remove the cause. The tester "
        "can be reset when the run has ended, and the run then resumed."
    )
    assert told.startswith("Still to be done") == (phase is Phase.PAUSED)
    assert "has tripped" not in beside_prompt(RigState(Phase.STOPPING, 7, interlocks=Interlock.EMERGENCY_STOP), None)
