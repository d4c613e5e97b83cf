"""Values of variables from the state and events of a rig."""

from datetime import UTC, datetime
from typing import Any

import pytest

from jointlab.client.connection import RigEvent
from jointlab.drive.events import EVENTS
from jointlab.drive.phase import Phase
from jointlab.publishing.variables import EVENT_VARIABLES, STATE_VARIABLES, VARIABLES, event_values, state_values
from tests.jointlab.publishing.test_messages import IDLE


def event(name: str, **data: Any) -> RigEvent:
    return RigEvent("a-1", name, datetime.now(UTC), data)


def test_the_state_has_a_value_for_each_of_its_variables() -> None:
    running = IDLE.model_copy(
        update={"phase": Phase.RUNNING, "run_id": 7, "blows": 3, "blows_wanted": 8, "sines": 1, "sines_wanted": 8}
    )
    found = state_values(running)
    assert found.keys() == {each.name for each in STATE_VARIABLES}
    assert (found["State"], found["Run"], found["Progress"], found["Stop"]) == ("running", 7, 25.0, False)
    assert state_values(IDLE)["Progress"] is None


def test_a_blow_and_a_sine_point_have_all_other_values() -> None:
    blow = event_values(event("BlowAccepted", point="3y", blow=1, accepted=1, wanted=2, peak_force=80.0))
    sine = event_values(
        event("SinePointMeasured", specimen="I", configuration="compression", amplitude_pp_mm=0.1, frequency=40.0,
              index=1, points=1, reached_pp_mm=0.099, stiffness=None, loss_factor=None)
    )  # fmt: skip
    assert blow == {"LastBlowPoint": "3y", "LastBlowForce": 80.0}
    assert (sine["LastSineAmplitude"], sine["LastStiffness"]) == (0.099, None)
    assert (blow | sine).keys() == {each.name for each in EVENT_VARIABLES}


@pytest.mark.parametrize("name", sorted(EVENTS.keys() - {"BlowAccepted", "SinePointMeasured"}))
def test_other_events_change_none(name: str) -> None:
    assert event_values(event(name)) == {}


def test_each_variable_has_a_name_of_its_own_and_a_unit_with_its_code() -> None:
    assert len({each.name for each in VARIABLES}) == len(VARIABLES)
    assert all((each.unit is None) == (not each.unit_code) for each in VARIABLES)
