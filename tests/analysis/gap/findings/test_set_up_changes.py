"""Joints that differ from one hammer set to the next."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.frequency_response import Complex
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.findings.set_up_changes import SetUpChange, set_up_changes
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.measurement import Measurement
from tests.analysis.gap.conftest import Made, drawn_scores, search_among, simulation_of


def changed(empty: Measurement, stiffer: float, stated: float | None = None, seed: int = 1) -> tuple[SetUpChange, ...]:
    """What is told of a bench whose joint I is stiffer by that in the second set, by the paper's model."""
    random = np.random.default_rng(seed)
    likelihood = Likelihood(simulation_of(empty))
    scores = drawn_scores(likelihood, (), random)
    scores[likelihood.setups[1][1]] = stiffer / likelihood.scales.setup_scatter
    predicted = likelihood.predict(scores, derivatives=())

    def noisy(values: Complex, deviation: np.ndarray) -> Complex:
        shape = values.shape
        return np.asarray(values + deviation * (random.standard_normal(shape) + 1j * random.standard_normal(shape)))

    sets = tuple(
        replace(each, accelerance=noisy(accelerance, each.deviation))
        for each, accelerance in zip(empty.sets, predicted.accelerances, strict=True)
    )
    assert empty.points is not None
    points = replace(empty.points, stiffness=noisy(predicted.stiffness, empty.points.deviation))
    tolerances = replace(empty.tolerances, setup_scatter=stated)
    measurement = replace(empty, sets=sets, points=points, tolerances=tolerances)
    return set_up_changes(search_among(measurement, set()).fit_paper_model(), UNCALIBRATED)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_joint_that_was_stiffer_in_one_set_is_told_with_its_size(empty: Measurement, seed: int) -> None:
    (found,) = changed(empty, 0.06, seed=seed)
    assert (found.joint, found.softest, found.stiffest) == ("I", 1, 2)
    assert abs(found.percent - 6.0) < 4 * found.error_percent + 0.6  # the prior draws it towards zero
    assert 0.0 < found.error_percent < 1.0


def test_what_set_ups_usually_make_is_not_told(empty: Measurement) -> None:
    assert changed(empty, 0.0) == ()
    assert changed(empty, 0.015) == ()


def test_of_a_laboratory_that_states_a_larger_scatter_less_is_told(empty: Measurement) -> None:
    assert changed(empty, 0.06, stated=0.03) == ()


def test_a_single_set_differs_from_none(made: Made) -> None:
    whole = made()
    one = replace(whole, sets=whole.sets[:1])
    assert set_up_changes(search_among(one, set()).fit_paper_model(), UNCALIBRATED) == ()
