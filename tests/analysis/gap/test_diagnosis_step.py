"""What a diagnosis tells while it works: every step in order, and a first answer that later ones refine."""

import pytest

from analysis.gap.catalogue import effect_ids
from analysis.gap.diagnosis import diagnose
from analysis.gap.diagnosis_step import DiagnosisStep, FirstAnswer, Stage, StepReport
from analysis.gap.effects.attachment import JointMass
from analysis.gap.effects.tester import FrameCompliance
from analysis.gap.evidence.verdict import UNKNOWN, Weighed
from analysis.gap.fitting.model import Model
from tests.analysis.gap.conftest import Made, search_among

PAIR = {"joint_mass", "frame_compliance"}
LINES = 20
"""Of each set, and no other effects are tried: a whole diagnosis takes seconds then."""


def test_a_first_answer_after_single_effects_is_refined_before_the_last_one(made: Made) -> None:
    measurement = made((JointMass(), FrameCompliance()), (1.0, 0.6)).thinned(LINES)
    steps = list[DiagnosisStep]()
    found = diagnose(measurement, frozenset(effect_ids()) - PAIR, steps.append)
    stages = [each.stage for each in steps]
    assert stages == sorted(stages, key=list(Stage).index), "each stage once, and further effects in several rounds"
    assert (stages[0], stages[-1]) == (Stage.FAULTS, Stage.DONE)
    shares = [each.share for each in steps]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    searched = stages.index(Stage.FURTHER_EFFECTS)
    assert [each.first for each in steps[:searched]] == [None] * searched
    first, refined = steps[searched].first, steps[stages.index(Stage.ALL_LINES)].first
    assert first is not None
    assert refined is not None
    assert len(first.effects) == 1
    assert set(first.effects) < PAIR
    assert set(refined.effects) == set(found.effects) == PAIR
    assert 0.0 < first.explained < refined.explained <= 1.0


@pytest.fixture(scope="module")
def fitted(made: Made) -> tuple[Model, Model]:
    """The model without effects, and one with the frame of the tester."""
    search = search_among(made((FrameCompliance(),), (0.6,)).thinned(LINES), {"frame_compliance"})
    none = search.fit_paper_model()
    return none, search.singles(none)[0]


@pytest.mark.parametrize(
    ("leads", "in_records", "told", "explains"),
    [
        (("frame_compliance",), (), ("frame_compliance",), True),
        (("frame_compliance",), ("double_hit",), ("frame_compliance", "double_hit"), True),
        ((), (), (), False),
        ((), ("double_hit",), ("double_hit",), False),
        (UNKNOWN, (), UNKNOWN, False),
        (UNKNOWN, ("double_hit",), ("double_hit",), False),
    ],
)
def test_a_first_answer_has_what_records_show_as_the_verdict_has(
    fitted: tuple[Model, Model],
    leads: tuple[str, ...],
    in_records: tuple[str, ...],
    told: tuple[str, ...],
    explains: bool,
) -> None:
    none, frame = fitted
    steps = list[DiagnosisStep]()
    report = StepReport(steps.append, in_records)
    report.answer(Weighed(leads, frame if leads else none, 0.0, 1.0), none)
    report.begin(Stage.FURTHER_EFFECTS, 0.4)
    ((first),) = [each.first for each in steps]
    assert isinstance(first, FirstAnswer)
    assert first.effects == told
    assert (first.explained > 0.9) is explains
    assert first.explained > 0.9 or first.explained == 0.0
