"""Fits to joints that follow a law of frequency, and the choice between such laws."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from analysis.inverse.frequency_dependent_joints import joints_at
from analysis.inverse.frequency_law import FrequencyLaw
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.inverse.tolerances import Tolerances
from analysis.structure.forward import accelerance
from analysis.structure.joints import Joint
from tests.analysis.inverse.laboratory import (
    DOMINANT,
    FREQUENCY,
    SENSOR,
    STATED,
    Complex,
    Laboratory,
    dominant,
    power_laws,
)

CHOSEN = replace(STATED, joint_law=FrequencyLaw.AUTO)
FOLLOWING = Tolerances(joint_law=FrequencyLaw.POWER)
EXPONENTS = np.array([0.06, 0.11])
LAWS = {
    FrequencyLaw.POWER: power_laws(0.02, 0.05),
    FrequencyLaw.ZENER: np.array([[0.0, 0.0], [0.5, 0.4], [0.5, 0.2], [0.4, -0.2]]),
}


@pytest.fixture(scope="module")
def following(laboratory: Laboratory) -> Complex:
    """Accelerances of joints that follow a power of frequency, stated at 100 Hz."""
    return laboratory.accelerance(laboratory.finer(), power_laws(*EXPONENTS))


def test_a_joint_that_follows_frequency_is_another_joint_at_each_line(
    laboratory: Laboratory, following: Complex
) -> None:
    finer = laboratory.finer()
    for line in (0, 30, 200, 500):
        factors = (FREQUENCY[line] / 100.0) ** EXPONENTS
        joints = [
            replace(joint, dynamic_stiffness=factor * joint.dynamic_stiffness)
            for joint, factor in zip(laboratory.joints, factors, strict=True)
        ]
        found = accelerance(finer, joints, FREQUENCY[line : line + 1], SENSOR, laboratory.inputs).accelerance[:, 0]
        assert found == pytest.approx(following[:, line], rel=1e-7)


def test_joints_that_follow_frequency_give_their_exponents_and_their_stiffness(
    laboratory: Laboratory, following: Complex
) -> None:
    scores = []
    for seed in range(8):
        measured = laboratory.measured(seed, following)
        fit = identify_from_responses(laboratory.model, measured, laboratory.off(seed), tolerances=FOLLOWING)
        assert fit.passed
        found, terms = [law["exponent"] for law in fit.law_parameters.values()], dominant(laboratory, fit)
        of_exponents = [(each.value - true) / each.standard_error for each, true in zip(found, EXPONENTS, strict=True)]
        scores.append([*of_exponents, *(terms[:, 0] / terms[:, 1])])
    inside = np.abs(np.array(scores)) < 1.96
    assert float(np.mean(inside[:, :2])) >= 13 / 16
    assert float(np.mean(inside)) >= 0.88


def test_constant_joints_have_no_exponent_to_speak_of(laboratory: Laboratory, fits: list[JointFit]) -> None:
    fit = identify_from_responses(
        laboratory.model,
        laboratory.measured(0),
        laboratory.off(0),
        tolerances=replace(STATED, joint_law=FrequencyLaw.POWER),
    )
    for law in fit.law_parameters.values():
        assert abs(law["exponent"].value) < 3 * law["exponent"].standard_error
        assert law["exponent"].standard_error < 0.01
    assert not fits[0].law_parameters


def test_constant_joints_win_where_they_are_true_with_the_same_result(laboratory: Laboratory) -> None:
    measured, start = laboratory.measured(31), laboratory.off(31)
    chosen, asked = (
        identify_from_responses(laboratory.model, measured, start, tolerances=tolerances)
        for tolerances in (CHOSEN, STATED)
    )
    assert chosen.law is FrequencyLaw.CONSTANT
    np.testing.assert_array_equal(chosen.values, asked.values)
    np.testing.assert_array_equal(chosen.covariance, asked.covariance)
    at_another = chosen.joints_at(400.0)["I"]
    np.testing.assert_allclose(at_another.stiffness, chosen.joints["I"].stiffness, rtol=1e-9)
    width, stated = (np.diff(each.k_ci95)[DOMINANT["k22"]] for each in (at_another, chosen.joints["I"]))
    assert stated <= width < 1.01 * stated  # it allows for laws that noise seems to show


@pytest.mark.parametrize("law", LAWS)
def test_the_law_that_joints_follow_is_chosen_and_holds_over_the_band(
    laboratory: Laboratory, law: FrequencyLaw
) -> None:
    measured = laboratory.measured(32, laboratory.accelerance(laboratory.finer(), LAWS[law]))
    fit = identify_from_responses(laboratory.model, measured, laboratory.off(32), tolerances=CHOSEN)
    assert fit.passed
    assert fit.law is law
    for frequency in (40.0, 100.0, 500.0):
        for true in joints_at(frequency, laboratory.joints, LAWS[law]):
            found = fit.joints_at(frequency)[true.name]
            for place in DOMINANT.values():
                half = np.ptp(found.k_ci95[place]) / 2
                assert found.observable[place]
                assert abs(found.stiffness[place] - true.dynamic_stiffness[place].real) < 1.7 * half


def apart(frequency: float, joints: Sequence[Joint]) -> list[Joint]:
    """The joints at `frequency`, Hz: a power of 0.03, but the coupling along and across the beam is constant."""
    powers = np.full((3, 3), (1j * frequency / 100j) ** 0.03)
    powers[0, 1] = powers[1, 0] = 1.0
    return [replace(joint, dynamic_stiffness=powers * joint.dynamic_stiffness) for joint in joints]


def test_a_term_that_follows_another_law_than_its_joint_shows_in_its_interval_over_the_band(
    laboratory: Laboratory,
) -> None:
    """As where rubber in shear follows another power than in compression."""
    free, inputs = laboratory.finer(), laboratory.inputs
    exact = [
        accelerance(free, apart(each, laboratory.joints), np.array([each]), SENSOR, inputs).accelerance[:, 0]
        for each in FREQUENCY
    ]
    fit = identify_from_responses(
        laboratory.model, laboratory.measured(33, np.array(exact).T), laboratory.off(33), tolerances=CHOSEN
    )
    assert fit.law is FrequencyLaw.POWER
    assert any(cause.name.startswith("power of frequency of k12") and cause.size > 0 for cause in fit.causes)
    for frequency in (40.0, 100.0, 500.0, 900.0):
        for true in apart(frequency, laboratory.joints):
            found = fit.joints_at(frequency)[true.name]
            for place in DOMINANT.values():
                half = np.ptp(found.k_ci95[place]) / 2
                assert abs(found.stiffness[place] - true.dynamic_stiffness[place].real) < 1.5 * half


def test_a_mass_at_a_joint_is_not_taken_for_a_law_of_frequency(laboratory: Laboratory) -> None:
    measured = laboratory.measured(20, laboratory.accelerance(laboratory.finer(point_masses={2: 0.02, 10: 0.02})))
    fit = identify_from_responses(laboratory.model, measured, laboratory.joints, tolerances=CHOSEN)
    assert fit.law is FrequencyLaw.CONSTANT
    assert not fit.passed
