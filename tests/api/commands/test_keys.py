"""Ctrl-Z pauses a run that measures, also one that another client has resumed. It resumes only a pause of its own."""

import pytest

from api.commands.sequences import Keys
from jointlab.drive.phase import Phase
from jointlab.supervision.manager import RunManager
from rig.sequences.sequence import sequence_from
from simlab.laboratory import Laboratory
from store.catalogue import Catalogue
from tests.api.conftest import paper
from tests.api.service.conftest import catalogue, impatient, rig, rig_settings
from tests.jointlab.drive.conftest import SWEEP
from tests.waiting import until

__all__ = ["catalogue", "impatient", "rig", "rig_settings"]


@pytest.fixture
def keys(rig: RunManager, catalogue: Catalogue) -> Keys:
    """Keys of a run that moves."""
    run = rig.plan(sequence_from(paper() | {"steps": [SWEEP]}), "test")
    rig.start(run, "test", automatic=True)
    until(lambda: rig.state.sines > 0)
    return Keys(rig, catalogue)


def test_a_run_that_another_client_has_resumed_is_paused_and_not_taken_for_paused(
    keys: Keys,
    rig: RunManager,
    laboratory: Laboratory,
) -> None:
    keys.pause()
    until(lambda: rig.state.phase is Phase.PAUSED)
    assert keys.is_paused()
    rig.resume(keys._run(), "an engineer at the page", pause=rig.pause_number)
    until(lambda: rig.state.phase is Phase.RUNNING)
    assert not keys.is_paused()
    assert not keys.is_interrupted()  # the key pauses it
    keys.pause()
    assert laboratory.tester.actuator.steady_pp() == 0.0


def test_a_run_that_another_client_has_paused_since_is_not_resumed_by_a_key(
    keys: Keys,
    rig: RunManager,
) -> None:
    keys.pause()
    until(lambda: rig.state.phase is Phase.PAUSED)
    rig.resume(keys._run(), "an engineer at the page", pause=rig.pause_number)
    rig.pause(keys._run())
    until(lambda: rig.state.phase is Phase.PAUSED)
    assert not keys.is_paused()
