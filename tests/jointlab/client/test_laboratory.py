"""The typed client on what a laboratory has and has found: each method once, against a real server."""

from collections.abc import Iterator
from datetime import date

import pytest

from analysis.modal.estimator import Estimator
from api.service.application import create_app
from api.service.context import Services
from jointlab.client import Client, ProblemError
from jointlab.documents.laboratory import NewCalibration
from jointlab.jobs.executors import ProcessExecutor
from jointlab.jobs.queue import JobQueue
from jointlab.supervision.manager import RunManager
from rig.sequences.sequence import sequence_from
from store.catalogue import Catalogue
from store.states import AnalysisKind, InvestigationState, JobState, RunState, Scope
from tests.api.conftest import paper
from tests.api.service.conftest import MakeKey, served
from tests.investigations import HALF_FORCE, add_waiting
from tests.store.conftest import fill, frequency_response_set, mode_set


@pytest.fixture
def lab(catalogue: Catalogue, rig: RunManager, make_key: MakeKey) -> Iterator[Client]:
    """A client of a service that has something of everything, on a simulated rig."""
    fill(catalogue)
    # no worker: what is queued waits
    app = create_app(Services(catalogue, rig, jobs=JobQueue(catalogue, ProcessExecutor(0))))
    with served(app) as http, Client(str(http.base_url), make_key(*Scope)) as lab:
        yield lab


def test_instruments_channels_and_specimens(lab: Client) -> None:
    (tester,) = lab.instruments(kind="tester")
    assert tester.serial == "7"
    hammer = next(each for each in lab.instruments() if any(found.sensitivity for found in lab.calibrations(each.id)))
    before = len(list(lab.calibrations(hammer.id)))
    given = NewCalibration(calibrated_on=date(2026, 9, 1), sensitivity=2.3e-3, sensitivity_unit="V/N")
    made = lab.calibrate(hammer.id, given)
    assert (made.sensitivity, len(list(lab.calibrations(hammer.id)))) == (2.3e-3, before + 1)
    assert {each.name for each in lab.channels()} >= {"hammer", "accelerometer", "displacement", "force"}
    assert {each.name for each in lab.channels(run=1)} == {"hammer", "accelerometer"}
    assert [each.name for each in lab.specimens(article="beam 3")] == ["I", "II"]
    assert list(lab.specimens(article="none")) == []


def test_sequences_are_stored_read_and_deleted(lab: Client) -> None:
    paper_one = lab.sequence("paper")
    small = sequence_from(paper() | {"title": "small", "steps": [{"step": "wait", "seconds": 1.0}]})
    assert lab.save_sequence("my small one", small) == small
    built_in = {each.name: each.built_in for each in lab.sequences()}
    assert built_in == {"my small one": False, "paper": True, "short": False, "suspended": True}
    assert lab.sequence("my small one") == small != paper_one
    lab.delete_sequence("my small one")
    with pytest.raises(ProblemError, match="my small one"):
        lab.sequence("my small one")


def test_limits_are_read_and_set(lab: Client) -> None:
    former = lab.limits()
    tighter = former.model_copy(update={"force": former.force / 2})
    assert lab.set_limits(tighter) == tighter == lab.limits()


def test_results_are_read_by_the_analysis_that_found_them(lab: Client) -> None:
    (modes,) = lab.analyses(1, AnalysisKind.MODES)
    (responses,) = lab.analyses(1, AnalysisKind.FREQUENCY_RESPONSES)
    assert lab.modes(1, analysis=modes.id).frequency_hz == mode_set().frequency.tolist()
    (found,) = lab.accelerance_sets(1, analysis=responses.id)
    assert (found.number, found.inputs) == (1, ["1y", "4y"])
    one = lab.accelerance(1, found.number, "4y", analysis=responses.id)
    assert one.real == frequency_response_set().accelerance[1].real.tolist()
    assert len(list(lab.joint_matrices(1))) == 2
    assert len(list(lab.comparisons(1))) == 3
    assert len(list(lab.dynamic_stiffness(2))) == 4


def test_only_the_chosen_options_of_an_identification_are_sent(lab: Client) -> None:
    assert lab.identify(1, elements=3).parameters == {"run": 1, "elements": 3}
    asked = lab.identify(1, elements=2, joint_law="power", regularise=0.5, estimator=Estimator.HV, force_window=0.05)
    assert asked.parameters == {
        "run": 1, "elements": 2, "joint_law": "power", "regularise": 0.5, "estimator": "Hv", "force_window": 0.05
    }  # fmt: skip


def test_a_trial_is_queued_listed_and_cancelled(lab: Client) -> None:
    queued = lab.try_diagnosis(cases=1, seed=7)
    assert queued.parameters == {"cases": 1, "seed": 7}
    assert queued.id in [each.id for each in lab.trials()]
    assert lab.cancel(queued.id).state is JobState.CANCELLED


def test_an_investigation_is_begun_answered_stopped_and_continued(lab: Client, catalogue: Catalogue) -> None:
    begun = lab.investigate(1, experiments=2)
    assert (begun.state, begun.budget.experiments, begun.budget.minutes) == (InvestigationState.WORKING, 2, 240.0)
    assert lab.stop_investigation(begun.id) == lab.wait_for_investigation(begun.id)
    assert lab.continue_investigation(begun.id, minutes=60.0).budget.minutes == 60.0
    assert lab.stop_investigation(begun.id).state is InvestigationState.STOPPED
    asked = add_waiting(catalogue, lab.create_run("paper").id, HALF_FORCE).id
    planned = lab.create_run(lab.investigation_sequence(asked))  # as any other run: it still has to be started
    assert planned.state is RunState.CREATED
    with pytest.raises(ProblemError, match=f"run {planned.id} is created, and not finished"):
        lab.answer_investigation(asked, run=planned.id)
    with pytest.raises(ProblemError, match="give one of run, readings and refusal"):
        lab.answer_investigation(asked)
    answered = lab.answer_investigation(asked, refusal="the hammer is away")
    assert (answered.state, lab.investigation(asked)) == (InvestigationState.WORKING, answered)
    assert [each.id for each in lab.investigations()] == [asked, begun.id]
    assert [each.id for each in lab.investigations(run=1)] == [begun.id]
