"""The figures that every diagnosis takes."""

import pytest

from analysis.gap.evidence.calibration import UNCALIBRATED


def test_the_numbers_of_effects_are_a_probability_distribution() -> None:
    assert sum(UNCALIBRATED.counts) == pytest.approx(1)
    assert UNCALIBRATED.most_effects == len(UNCALIBRATED.counts) - 1


def test_a_law_of_unknown_form_is_less_exact_than_one_of_known_form() -> None:
    (least, most), (least_known, most_known) = UNCALIBRATED.form_errors(False), UNCALIBRATED.form_errors(True)
    assert 0 == least_known < least < most
    assert most_known < most
