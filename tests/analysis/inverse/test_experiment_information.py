from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import FrequencyResponses
from analysis.inverse.cylinder_parameters import CylinderPair
from analysis.inverse.experiment_information import LinearPrior, PlannedExperiment, PlannedSet, expected
from analysis.inverse.experiment_remedies import (
    CylindersAsParameters,
    EqualTerms,
    SecondAccelerometer,
    WiderBand,
    experiment_of_fit,
    remedies,
)
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.inverse.regression import UPPER
from analysis.inverse.tolerances import Tolerances
from analysis.inverse.undetermined_terms import CommonFactor, WeakDirection
from analysis.structure.forward import accelerance

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

STATED = Tolerances(0.005, 0.005, 0.003, 0.001, 0.001, 0.0015, np.radians(0.5))


@pytest.fixture(scope="module")
def experiment(bench: Bench) -> PlannedExperiment:
    """The paper's: eleven points, one accelerometer, 20 to 1024 Hz every half hertz."""
    planned = PlannedSet(Dof.parse("3y"), bench.inputs, np.linspace(20.0, 1024.0, 2009), 0.003)
    return PlannedExperiment(bench.free_beam, bench.joints, (planned,))


def test_the_papers_experiment_holds_what_an_independent_code_found(experiment: PlannedExperiment) -> None:
    found = expected(experiment)
    unit = np.array([experiment.free_beam.beam.stiffness_unit[place] for place in UPPER])
    first, second = (found.stiffness_deviation[name] / unit for name in ("I", "II"))
    for deviation in (first, second):
        assert deviation[2] == pytest.approx(0.005, abs=5e-4)  # k13
        assert deviation[3] == pytest.approx(0.015, abs=0.003)  # k22
        assert deviation[4] == pytest.approx(0.0013, abs=3e-4)  # k23
        assert deviation[5] == pytest.approx(0.0002, abs=5e-5)  # k33
    assert first[1] == pytest.approx(0.04, abs=0.006)
    assert second[1] == pytest.approx(0.05, abs=0.006)
    weak = [direction for direction in found.weak_directions if isinstance(direction, WeakDirection)]
    assert {direction.terms for direction in weak} == {((f"{x}11(I)", 1.0), (f"{x}11(II)", -1.0)) for x in "kh"}
    for direction in weak:
        assert direction.standard_deviation == pytest.approx(27, abs=0.5)
        assert direction.reversed_deviation == pytest.approx(0.042, abs=5e-4)


def test_with_the_tolerances_stated_the_common_factor_is_weak_as_well(experiment: PlannedExperiment) -> None:
    found = expected(replace(experiment, tolerances=STATED))
    common = found.weak_directions[-1]
    assert isinstance(common, CommonFactor)
    assert common.standard_deviation == pytest.approx(0.0023, abs=5e-5)
    k22 = [joint.dynamic_stiffness[1, 1].real for joint in experiment.joints]
    for value, name in zip(k22, ("I", "II"), strict=True):
        assert 0.0019 < found.stiffness_deviation[name][3] / value < 0.003


def test_more_lines_or_less_noise_sharpen_as_they_should(experiment: PlannedExperiment) -> None:
    (planned,) = experiment.sets
    quieter = expected(replace(experiment, sets=(replace(planned, noise=0.0015),)))
    twice = expected(replace(experiment, sets=(planned, planned)))
    for name, deviation in expected(experiment).stiffness_deviation.items():
        np.testing.assert_allclose(quieter.stiffness_deviation[name], deviation / 2, rtol=1e-6)
        np.testing.assert_allclose(twice.stiffness_deviation[name], deviation / np.sqrt(2), rtol=1e-6)


def test_a_prior_on_the_difference_determines_it(experiment: PlannedExperiment) -> None:
    prior = LinearPrior({"k11(I)": 1.0, "k11(II)": -1.0}, 1e3)
    found = expected(replace(experiment, priors=(prior,)))
    assert found.stiffness_deviation["I"][0] < 1e3
    with pytest.raises(AnalysisError, match=r"k44\(I\)"):
        expected(replace(experiment, priors=(LinearPrior({"k44(I)": 1.0}, 1.0),)))


def test_remedies_are_ranked_and_say_what_they_bring(experiment: PlannedExperiment) -> None:
    pairs = tuple(
        CylinderPair(name, (angle, angle - np.sign(angle) * np.pi), 0.006)
        for name, angle in (("I", -np.pi / 4), ("II", np.pi / 4))
    )
    (planned,) = experiment.sets
    coarser = replace(planned, frequency=np.arange(20.0, 1025.0, 4.0))
    found = remedies(replace(experiment, sets=(coarser,), tolerances=STATED), pairs)
    assert [remedy.after for remedy in found] == sorted(remedy.after for remedy in found)
    assert (found[0].change, found[0].units) == (CylindersAsParameters(), ("EI/L^3",))
    assert found[0].after < 0.1 * found[0].before
    assert {remedy.change for remedy in found} == {
        CylindersAsParameters(),
        EqualTerms(),
        SecondAccelerometer(Dof.parse("1x")),
        SecondAccelerometer(Dof.parse("11x")),
        WiderBand(3068.0),
    }


def of_one_kind(name: str, angle: float) -> CylinderPair:
    return CylinderPair(name, (angle, angle - np.sign(angle) * np.pi), 0.006)


def test_k11_and_k22_are_taken_as_equal_only_where_the_cylinders_are_drawn_so(experiment: PlannedExperiment) -> None:
    (planned,) = experiment.sets
    coarser = replace(experiment, sets=(replace(planned, frequency=np.arange(20.0, 1025.0, 8.0)),))
    steep = remedies(coarser, (of_one_kind("I", -np.pi / 6), of_one_kind("II", np.pi / 6)))
    assert not [remedy for remedy in steep if isinstance(remedy.change, EqualTerms)]
    mixed = remedies(coarser, (of_one_kind("I", -np.pi / 4), of_one_kind("II", np.pi / 6)))
    assert [remedy.change for remedy in mixed if isinstance(remedy.change, EqualTerms)] == [EqualTerms(("I",))]
    across = CylinderPair("II", (np.pi / 6, np.pi / 3), 0.006)  # what one lacks along the beam the other has
    both = remedies(coarser, (of_one_kind("I", -np.pi / 4), across))
    assert EqualTerms() in [remedy.change for remedy in both]


def test_remedies_of_a_rotation_are_in_the_unit_of_a_rotation(experiment: PlannedExperiment) -> None:
    """Low lines hardly turn the joints; of the translations all but k33 are known beforehand."""
    (planned,) = experiment.sets
    known = tuple(
        LinearPrior({f"{letter}{term}({name})": 1.0}, 1e-3)
        for name in ("I", "II")
        for letter in "kh"
        for term in ("11", "12", "13", "22", "23")
    )
    low = replace(planned, frequency=np.arange(20.0, 40.0, 2.0))
    found = remedies(replace(experiment, sets=(low,), priors=known))
    assert {remedy.units for remedy in found} == {("EI/L",)}


def test_an_experiment_that_was_made_tells_what_its_fit_says(experiment: PlannedExperiment) -> None:
    lines = np.arange(20.0, 1024.0, 2.0)
    (planned,) = experiment.sets
    clean = accelerance(experiment.free_beam, experiment.joints, lines, planned.response, planned.inputs).accelerance
    parts = np.random.default_rng(0).standard_normal((2, *clean.shape))
    measured = FrequencyResponses(
        lines,
        clean + 0.003 * (parts[0] + 1j * parts[1]),
        planned.response,
        planned.inputs,
        variance=np.full(clean.shape, 0.003**2),
    )
    fit = identify_from_responses(experiment.free_beam, measured, experiment.joints, tolerances=STATED)
    made = experiment_of_fit(fit, STATED)
    assert made.sets[0].frequency.size < lines.size
    told = np.sqrt(np.diag(expected(made).terms_covariance))
    np.testing.assert_allclose(told, np.sqrt(np.diag(fit.terms_covariance)), rtol=0.05)
    best = remedies(made)[0]
    assert best.change == EqualTerms()
    assert best.after < 0.5 * best.before


def test_an_experiment_without_a_set_is_refused(experiment: PlannedExperiment) -> None:
    with pytest.raises(AnalysisError, match="at least one set"):
        expected(replace(experiment, sets=()))
