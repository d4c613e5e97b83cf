"""What a verdict leaves: its size against the true one."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.effects.tester import FrameCompliance
from analysis.gap.findings.effects_found import misfit_percent
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.measurement import Measurement
from tests.analysis.gap.conftest import LEAN, Made, drawn_scores, fitted, search_among, simulation_of

SOFT = 0.8
"""Score of the compliance of the tester's frame."""


def without_scatter(measurement: Measurement) -> Measurement:
    """The same, with joints that are alike in every set-up: no other unknown makes up for a soft frame."""
    alike = replace(measurement.tolerances, setup_scatter=0.0, configuration_gain=0.0, model_error=0.0, blow_lean=LEAN)
    return replace(measurement, tolerances=alike)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_a_wrong_model_leaves_is_its_distance_from_the_response_without_noise(
    made: Made, empty: Measurement, seed: int
) -> None:
    fit = fitted(without_scatter(made((FrameCompliance(),), (SOFT,), seed)))
    likelihood = Likelihood(simulation_of(empty, FrameCompliance()))
    scores = drawn_scores(likelihood, (SOFT,), np.random.default_rng(seed))
    true = np.concatenate([each.ravel() for each in likelihood.predict(scores, ()).accelerances])
    apart = np.concatenate([each.ravel() for each in fit.readings.accelerances]) - true
    assert misfit_percent(fit) == pytest.approx(100 * np.linalg.norm(apart) / np.linalg.norm(true), rel=0.1)


def test_the_right_model_leaves_nothing_beside_noise(made: Made) -> None:
    search = search_among(without_scatter(made((FrameCompliance(),), (SOFT,))), {"frame_compliance"})
    right = search.singles(search.fit_paper_model())[0].fit
    sets = right.likelihood.measurement.sets
    noise = sum(float(np.sum(2 * each.deviation**2)) for each in sets)
    size = sum(float(np.sum(np.abs(each.accelerance) ** 2)) for each in sets)
    assert misfit_percent(right) < 0.2 * 100 * np.sqrt(noise / size)


def test_without_hammer_sets_it_is_that_of_the_tester(made: Made) -> None:
    fit = fitted(replace(without_scatter(made()), sets=()))
    points = fit.likelihood.measurement.points
    assert points is not None
    stiffer = replace(points, stiffness=1.1 * points.stiffness)
    assert misfit_percent(fit) < 0.1
    other = replace(fit.likelihood.measurement, points=stiffer)
    worse = replace(fit, likelihood=Likelihood(fit.likelihood.simulation.of(other)))
    assert misfit_percent(worse) == pytest.approx(100 * 0.1 / 1.1, rel=0.05)
