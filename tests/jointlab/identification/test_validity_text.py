"""Findings of checks read as sentences, with what a failure means."""

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.inverse.model_error import Cause
from analysis.inverse.validity_checks import (
    ChiSquare,
    Correlation,
    Couplings,
    Finding,
    LeastLoss,
    LeastStiffness,
    NextStep,
    StrongestCause,
    ValidityCheck,
    WorstDeviation,
)
from jointlab.identification.validity_text import check_text

MASS = Cause("mass at joint II", 0.01, "kg", 400.0, 0.004, np.zeros(2), ())
POWER = Cause("power of frequency of joint I", 0.015, "1", 9.0, 0.028, np.zeros(2), ())


@pytest.mark.parametrize(
    ("finding", "passed", "text"),
    [
        (
            LeastLoss("I", 0.123, 0.04),
            True,
            "least loss factor of joint I 0.12 +-0.04 (of all motions): no motion draws energy from it",
        ),
        (
            LeastLoss("I", -0.5, 0.04),
            False,
            "least loss factor of joint I -0.5 +-0.04 (of all motions): a motion draws energy from it, which no "
            "elastomer can do",
        ),
        (
            LeastStiffness("II", 0.5, 0.1),
            True,
            "least relative stiffness of joint II 0.5 +-0.1 (of all motions): every motion meets resistance",
        ),
        (
            LeastStiffness("II", -0.5, 0.1),
            False,
            "least relative stiffness of joint II -0.5 +-0.1 (of all motions): a motion is pushed on, which no joint "
            "at rest can do",
        ),
        (Couplings(2, (("I", -9e5),)), True, "joints couple motion along and across the beam as drawn"),
        (Couplings(0, ()), True, "no joint shows a coupling"),
        (
            Couplings(2, (("I", -9e5), ("II", 8e5))),
            False,
            "k12(I) is -9e+05 N/m, k12(II) is 8e+05 N/m, against the drawing: either all rows along the beam have the "
            "wrong polarity, or the joints lean the other way than drawn; check the accelerometer, the hammer's "
            "direction and the inclinations",
        ),
        (Correlation(0.52, 3.54), True, "the residual of lines a few apart is alike by 0.5 standard deviations"),
        (
            Correlation(9.0, 3.54),
            False,
            "the residual of lines a few apart is alike by 9.0 standard deviations, above 3.5: something is not in the "
            "model, even where chi-square is small",
        ),
        (StrongestCause(None), True, "no further cause could be distinguished from the fitted parameters"),
        (
            StrongestCause(MASS, True, 14.0, 0.4, 0.4),
            True,
            "a mass at joint II of 0.01 kg would lower chi-square by 400 (noise: 14 at most); intervals allow for 0.4 "
            "standard deviations of a term",
        ),
        (
            StrongestCause(MASS, True, 14.0, 2.0, 2.1),
            False,
            "a mass at joint II of 0.01 kg would lower chi-square by 400 (noise: 14 at most) and move a term by 2.0 "
            "standard deviations: it, or something like it, is not in the model",
        ),
        (
            StrongestCause(POWER, False, 14.0, 2.8, 2.8),
            True,
            "a power of frequency of joint I of 0.015 would lower chi-square by 9, as noise can",
        ),
        (WorstDeviation(None), True, "no deviation of the bench was estimated"),
        (WorstDeviation("density", 1.24, 3.9), True, "density is 1.2 tolerances off"),
        (
            WorstDeviation("density", 5.0, 3.9),
            False,
            "density is 5.0 tolerances off, above 3.9: measure it again, state its tolerance, or look for what is not "
            "in the model",
        ),
        (ChiSquare(1.01, Dof.parse("3y"), 1.2, 100.0, 4.0), True, "chi-square is 1.01 per datum"),
        (
            ChiSquare(12.0, Dof.parse("3y"), 80.0, 123.45, 400.0),
            False,
            "chi-square is 12 per datum, above 1.1: the model does not explain the data; worst at 3y (80) and near "
            "123.5 Hz (400)",
        ),
        (NextStep(0.0003), True, "another step would lower chi-square by 0.0003"),
    ],
)
def test_a_finding_is_a_sentence(finding: Finding, passed: bool, text: str) -> None:
    assert check_text(ValidityCheck("a check", passed, finding)) == text
