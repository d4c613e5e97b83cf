"""The information of an experiment is that of a mixture of Gaussians, which brute force gives, too."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import multivariate_normal, norm

from analysis.gap.experiments.information import Expectation, entropy, expected_information, log_posterior


def nothing(data: int) -> np.ndarray:
    return np.zeros((0, data))


def test_two_sharp_explanations_are_told_apart_as_quadrature_says() -> None:
    for distance in (0.5, 2.0, 4.0):
        two = [Expectation(p, np.array([m]), nothing(1)) for p, m in ((0.7, 0.0), (0.3, distance))]

        def density(x: float, at: float = distance) -> float:
            return float(0.7 * norm.pdf(x) + 0.3 * norm.pdf(x - at))

        entropy = quad(lambda x: -density(x) * np.log2(density(x)), -9, 14)[0]
        known = entropy - np.log2(np.sqrt(2 * np.pi * np.e))
        assert expected_information(two, 20_000) == pytest.approx(known, abs=0.01)
        assert expected_information(two) == pytest.approx(known, abs=0.04)


def test_few_data_of_improbable_explanations_are_enough() -> None:
    for distance in (0.5, 2.0, 4.0):
        three = [
            Expectation(p, np.array([m]), nothing(1)) for p, m in ((0.97, 0.0), (0.02, distance), (0.01, -distance))
        ]
        assert expected_information(three) == pytest.approx(expected_information(three, 200_000), abs=0.02)


def test_uncertain_parameters_count_as_brute_force_over_parameters_and_noise_says() -> None:
    random = np.random.default_rng(1)
    expected = [
        Expectation(p, random.standard_normal(6), scale * random.standard_normal((2, 6)))
        for p, scale in ((0.5, 1.0), (0.3, 0.3), (0.2, 2.0))
    ]
    densities = [multivariate_normal(each.mean, np.eye(6) + each.spread.T @ each.spread) for each in expected]
    told = 0.0
    for own, each in enumerate(expected):
        parameters, noise = random.standard_normal((40_000, 2)), random.standard_normal((40_000, 6))
        data = each.mean + parameters @ each.spread + noise
        mixed = sum(e.probability * d.pdf(data) for e, d in zip(expected, densities, strict=True))
        told += each.probability * float(np.mean(densities[own].logpdf(data) - np.log(mixed))) / np.log(2)
    assert 0.3 < told < entropy([0.5, 0.3, 0.2])
    assert expected_information(expected, 20_000) == pytest.approx(told, abs=0.01)
    assert expected_information(expected) == pytest.approx(told, abs=0.05)


def test_an_unknown_along_the_difference_hides_it() -> None:
    mean = np.array([4.0, 0.0])
    along, across = 100.0 * mean[None], np.array([[0.0, 400.0]])
    hidden, seen = (
        expected_information([Expectation(0.5, 0 * mean, each), Expectation(0.5, mean, each)])
        for each in (along, across)
    )
    assert hidden == pytest.approx(0.0, abs=0.02)
    assert seen > 0.8


def test_explanations_of_one_mean_are_told_apart_by_what_they_leave_open() -> None:
    """An alternative that is not modelled expects anything of the size of the gap, a law nearly one thing."""
    sharp, wide = nothing(20), 10 * np.eye(20)
    two = [Expectation(0.5, np.zeros(20), sharp), Expectation(0.5, np.zeros(20), wide)]
    assert expected_information(two) > 0.95


def test_a_posterior_is_bayes_rule_and_one_explanation_leaves_no_doubt() -> None:
    two = [Expectation(0.9, np.zeros(2), nothing(2)), Expectation(0.1, np.array([3.0, 0.0]), nothing(2))]
    found = np.exp(log_posterior(two, np.array([2.0, 5.0])))
    odds = 0.1 / 0.9 * norm.pdf(-1.0) / norm.pdf(2.0)
    assert found == pytest.approx([1 / (1 + odds), odds / (1 + odds)])
    assert expected_information([Expectation(1.0, np.zeros(2), nothing(2))]) == 0.0
    assert entropy([0.5, 0.5]) == pytest.approx(1.0)
    assert entropy([1.0, 0.0]) == 0.0
