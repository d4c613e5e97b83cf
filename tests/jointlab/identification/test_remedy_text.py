"""Remedies are told with what they change and what they bring."""

import pytest

from analysis.dof import Dof
from analysis.inverse.experiment_remedies import (
    CylindersAsParameters,
    EqualTerms,
    Remedy,
    RemedyChange,
    SecondAccelerometer,
    WiderBand,
)
from jointlab.identification.remedy_text import remedy_text


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (EqualTerms(), "taking k11 = k22 in each joint within 3 %"),
        (EqualTerms(("I", "III")), "taking k11 = k22 in joint I, joint III within 3 %"),
        (CylindersAsParameters(), "the cylinders as parameters"),
        (SecondAccelerometer(Dof.parse("11x")), "a second accelerometer at 11x"),
        (WiderBand(3068.2), "lines up to 3068 Hz at the same noise"),
    ],
)
def test_a_remedy_is_told_with_its_effect(change: RemedyChange, words: str) -> None:
    assert remedy_text(Remedy(change, 0.52, 0.013, ("EI/L^3",))) == f"{words}: from +-0.52 EI/L^3 to +-0.013 EI/L^3"
