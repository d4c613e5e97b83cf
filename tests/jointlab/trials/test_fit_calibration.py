"""Figures are recovered from marks that were made with them, and stay where marks say nothing."""

import numpy as np
import pytest

from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.findings.intervals import TWO_SIDED
from jointlab.trials.fit_calibration import KNOWN_FORM, fit_calibration
from jointlab.trials.marks import Coverage, Mark, Truth


def mark(
    left: float, effect: str = "frequency_dependence", outside: bool = False, coverage: tuple[Coverage, ...] = ()
) -> Mark:
    effects, novel = ((), ("crack",)) if outside else ((effect,), ())
    truth = Truth(
        case="a", kind="novel" if outside else "single", effects=effects, novel=novel, size={}, parameters={},
        d=500.0, floor_percent=3.0,
    )  # fmt: skip
    return Mark(truth=truth, shares={"": 1.0, effect: left}, coverage=coverage)


def test_the_share_at_even_odds_is_found_between_right_laws_and_causes_outside() -> None:
    chance = np.random.default_rng(3)
    inside = [mark(float(10 ** chance.normal(-1.6, 0.35))) for _ in range(120)]
    outside = [mark(float(10 ** chance.normal(-0.6, 0.25)), outside=True) for _ in range(40)]
    found = fit_calibration([*inside, *outside], UNCALIBRATED, "a test")
    assert 0.05 < found.calibration.outside_share < 0.2
    assert found.calibration.outside_slope > 3.0
    assert found.loss_after < found.loss_before
    assert (found.cases, found.outside, found.other_forms) == (160, 40, 120)
    assert found.calibration.form_error == pytest.approx(0.21, abs=0.06)  # three of four are below
    assert found.calibration.provenance == "a test"


def test_too_few_cases_change_no_form() -> None:
    assert "joint_mass" in KNOWN_FORM
    found = fit_calibration([mark(1e-6, "joint_mass")] * 3, UNCALIBRATED, "a test")
    assert found.calibration.known_form_error == UNCALIBRATED.known_form_error
    assert found.calibration.outside_share == pytest.approx(UNCALIBRATED.outside_share, rel=0.6)


@pytest.mark.parametrize("error", [0.01, 0.05])
def test_the_error_of_parameters_is_the_one_with_which_their_intervals_hold(error: float) -> None:
    """Noise of one per cent is in the intervals, beside the error that was assumed before."""
    chance = np.random.default_rng(5)
    assumed, noise, truth = UNCALIBRATED.parameter_error, 0.01, 2.0
    half = TWO_SIDED * float(np.hypot(noise, assumed)) * truth
    values = truth * (1 + chance.normal(0.0, np.hypot(noise, error), 400))
    found = [
        Coverage("frequency_dependence", "ratio", truth, float(v), float(v - half), float(v + half)) for v in values
    ]
    fitted = fit_calibration([mark(1e-3, coverage=(each,)) for each in found], UNCALIBRATED, "a test")
    assert fitted.calibration.parameter_error == pytest.approx(error, rel=0.15)
    assert fitted.parameters == 400


def test_parameters_of_known_form_say_nothing_of_those_of_other_laws() -> None:
    far = Coverage("joint_mass", "m", 0.1, 0.2, 0.19, 0.21)
    found = fit_calibration([mark(1e-3, "joint_mass", coverage=(far,))] * 50, UNCALIBRATED, "a test")
    assert found.calibration.parameter_error == UNCALIBRATED.parameter_error
