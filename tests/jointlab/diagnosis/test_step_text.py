"""A first answer in words: what leads, how much it explains, and that it is not final."""

import pytest

from analysis.gap.diagnosis_step import DiagnosisStep, FirstAnswer, Stage
from analysis.gap.evidence.verdict import UNKNOWN
from jointlab.diagnosis.catalogue import title_of
from jointlab.diagnosis.step_text import step_text


@pytest.mark.parametrize(
    ("effects", "explained", "said"),
    [
        (
            ("joint_mass",),
            0.866,
            "first answer, not final: mass at the joints (joint_mass), explains 87 % of the misfit",
        ),
        (
            ("joint_mass", "channel_delay"),
            0.999,
            "first answer, not final: mass at the joints (joint_mass) and delay between the channels (channel_delay), "
            "explain nearly all of the misfit",
        ),
        ((), 0.0, "first answer, not final: nothing beyond noise and stated tolerances"),
        (UNKNOWN, 0.0, "first answer, not final: a cause in no catalogue"),
        (
            ("double_hit",),
            0.0,
            "first answer, not final: double hits of the hammer (double_hit) in the records of blows",
        ),
    ],
)
def test_a_first_answer_names_what_leads_and_what_is_done_next(
    effects: tuple[str, ...], explained: float, said: str
) -> None:
    step = DiagnosisStep(Stage.FURTHER_EFFECTS, 0.4, FirstAnswer(effects, explained))
    assert step_text(step, title_of) == f"{said}; trying further effects"


@pytest.mark.parametrize("stage", [each for each in Stage if each is not Stage.DONE])
def test_every_step_has_words(stage: Stage) -> None:
    assert step_text(DiagnosisStep(stage, 0.1), title_of)


def test_no_first_answer_stands_when_all_is_done() -> None:
    assert step_text(DiagnosisStep(Stage.DONE, 1.0, FirstAnswer(("joint_mass",), 0.9)), title_of) == ""
