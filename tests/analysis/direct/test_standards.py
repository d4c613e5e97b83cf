from dataclasses import replace

import pytest

from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.standards import claims, linearity_difference_db
from tests.analysis.direct.points import from_polar


def point(frequency: float, amplitude_pp: float = 1e-5, magnitude: float = 2e6) -> DynamicStiffness:
    return from_polar(frequency, amplitude_pp, magnitude, 0.1, 0.001, thd_force=0.005)


def claim(points: list[DynamicStiffness], standard: str) -> str:
    (found,) = [sentence for sentence in claims(points) if sentence.startswith(standard)]
    return found


def test_a_sweep_to_two_hundred_hertz_exceeds_astm_d5992() -> None:
    sweep = [point(float(frequency)) for frequency in range(5, 201, 5)]
    assert "20 of 40 points lie within its 0.01-100 Hz" in claim(sweep, "ASTM D5992")
    assert "up to 200 Hz, exceed it" in claim(sweep, "ASTM D5992")
    assert claim(sweep[:20], "ASTM D5992") == "ASTM D5992: all 20 points lie within its 0.01-100 Hz."
    assert "down to 0.005 Hz" in claim([point(0.005), point(50.0)], "ASTM D5992")


def test_one_amplitude_is_no_test_for_linearity() -> None:
    assert linearity_difference_db([point(50.0), point(60.0, 1e-4)]) is None
    assert linearity_difference_db([point(50.0), point(50.0, 1e-4), point(60.0)]) is None
    assert "no claim" in claim([point(50.0), point(50.0, 3e-5)], "ISO 10846-2")  # 9.5 dB apart
    assert "was not shown" in claim([point(50.0)], "ISO 18437-4")


@pytest.mark.parametrize(("softness", "passed"), [(0.85, True), (0.83, False)])
def test_linear_is_what_differs_by_one_and_a_half_decibels_or_less(softness: float, passed: bool) -> None:
    points = [point(50.0), point(50.0, 1e-4, softness * 2e6)]
    assert ("passed" in claim(points, "ISO 10846-2")) is passed
    assert ("linear at these amplitudes" in claim(points, "ISO 18437-4")) is passed


def test_the_papers_cylinders_fail_the_test_for_linearity_by_six_decibels() -> None:
    """Stiffness falls by a factor of 2.1 from 0.01 to 0.1 mm."""
    assert linearity_difference_db([point(50.0), point(50.0, 1e-4, 2e6 / 2.1)]) == pytest.approx(6.44, abs=0.01)


def test_points_below_a_hertz_are_outside_of_iso_10846_2() -> None:
    assert "1 points below 1 Hz" in claim([point(0.5), point(50.0)], "ISO 10846-2")


def test_a_distorted_point_claims_nothing_by_iso_4664_1() -> None:
    assert "have to be reported" in claim([point(50.0)], "ISO 4664-1")
    assert "at 1 of 2 points" in claim([point(50.0), replace(point(60.0), thd_force=0.3)], "ISO 4664-1")
    assert "was not seen" in claim([replace(point(50.0), thd_force=None)], "ISO 4664-1")


def test_no_points_claim_nothing() -> None:
    assert claims([]) == ()
