"""What differs on every bench is estimated from the data, and is no reason for an effect."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.gap.baseline import baseline_of
from analysis.gap.effects.attachment import JointMass
from analysis.gap.fit import Fit, Likelihood, fit
from analysis.gap.free_beam_modes import beam_modes_of
from analysis.gap.measurement import Measurement, StatedTolerances
from analysis.gap.model import Model
from analysis.gap.scale_estimate import with_likely_scales
from analysis.gap.scales import HALF_NORMAL, Scales
from analysis.gap.search import search_of
from analysis.gap.simulation import Simulation
from jointlab.diagnosis.load import subject_of_bundle
from store.bundle import read_bundle
from tests.analysis.gap.conftest import Made

BENCHES = Path("/work/shared/benches")
NONE_BUT_ORDINARY = ("ordinary-1", "ordinary-2")
MISSING = "labelled bundles of a foreign simulator are not on this machine"


def plain(measurement: Measurement) -> Fit:
    """The paper's model, with scales at those of their priors."""
    simulation = Simulation(baseline_of(measurement), beam_modes_of(measurement.drawing))
    return fit(simulation, np.zeros(Likelihood(simulation).unknowns))


def ordinary(measurement: Measurement, scales: Scales, seed: int = 5) -> Measurement:
    """The same with gains by configuration and smooth errors of these scales, drawn by seed."""
    random, points = np.random.default_rng(seed), measurement.points
    assert points is not None
    gains = 1 + scales.configuration_gain * np.array([1.0, -1.2, 0.4])
    sets = []
    for each in measurement.sets:
        apart = each.frequency[:, None] - each.frequency
        smooth = np.linalg.cholesky(np.exp(-(apart**2) / (2 * scales.correlation**2)) + 1e-9 * np.eye(apart.shape[0]))
        drawn = random.standard_normal((2, *each.accelerance.shape)) @ smooth.T * scales.model_error
        sets.append(replace(each, accelerance=each.accelerance * (1 + drawn[0] + 1j * drawn[1])))
    return replace(
        measurement,
        sets=tuple(sets),
        points=replace(points, stiffness=points.stiffness * gains[points.configuration]),
    )


@pytest.fixture(scope="module")
def clean(made: Made) -> Measurement:
    """A bench without effects, the noise of its accelerances a fifth of a per cent."""
    measurement, random = made(), np.random.default_rng(8)
    sets = []
    for each in measurement.sets:
        noise = random.standard_normal(each.accelerance.shape) + 1j * random.standard_normal(each.accelerance.shape)
        further = 2e-3 * np.abs(each.accelerance)
        deviation = np.hypot(each.deviation, further)
        sets.append(replace(each, accelerance=each.accelerance + further * noise, deviation=deviation))
    return replace(measurement, sets=tuple(sets))


def test_a_bench_with_ordinary_differences_is_no_gap(clean: Measurement) -> None:
    true = replace(HALF_NORMAL, correlation=40.0)
    found = with_likely_scales(plain(ordinary(clean, true)))
    assert found.per_datum < 1.1
    assert found.likelihood.scales.correlation == 40.0
    for name in ("configuration_gain", "model_error"):
        assert 0.5 < getattr(found.likelihood.scales, name) / getattr(true, name) < 2.5, name


def test_scales_of_a_bench_without_them_are_as_good_as_none(clean: Measurement) -> None:
    found = with_likely_scales(plain(clean)).likelihood.scales
    assert found.model_error <= 0.1 * HALF_NORMAL.model_error
    assert found.configuration_gain <= 0.2 * HALF_NORMAL.configuration_gain
    assert found.setup_scatter <= 0.35 * HALF_NORMAL.setup_scatter


def test_a_small_effect_is_found_as_before_where_nothing_else_differs(made: Made) -> None:
    measurement = made((JointMass(),), (0.1,))  # 20 g at each joint
    none = with_likely_scales(plain(measurement))
    simulation = Simulation(none.likelihood.simulation.baseline, none.likelihood.simulation.modes, (JointMass(),))
    shared = len(none.likelihood.simulation.shared)
    start = np.concatenate([none.scores[:shared], [0.0], none.scores[shared:]])
    mass = with_likely_scales(fit(simulation, start))
    gain = Model((JointMass(),), mass).log_evidence - Model((), none).log_evidence
    stated = replace(
        measurement,
        tolerances=replace(measurement.tolerances, setup_scatter=0.0, configuration_gain=0.0, model_error=0.0),
    )
    without = plain(stated)
    simulation = Simulation(without.likelihood.simulation.baseline, simulation.modes, (JointMass(),))
    with_mass = fit(simulation, np.concatenate([without.scores[:shared], [0.0], without.scores[shared:]]))
    before = Model((JointMass(),), with_mass).log_evidence - Model((), without).log_evidence
    assert before > 10
    assert gain > 0.5 * before  # scales that are not known may take a part of it


def test_scales_that_are_stated_stay(clean: Measurement) -> None:
    stated = StatedTolerances(setup_scatter=0.01, configuration_gain=0.02, model_error=0.001)
    found = with_likely_scales(plain(replace(clean, tolerances=stated))).likelihood.scales
    assert (found.setup_scatter, found.configuration_gain, found.model_error) == (0.01, 0.02, 0.001)


@pytest.mark.skipif(not BENCHES.is_dir(), reason=MISSING)
@pytest.mark.parametrize("name", NONE_BUT_ORDINARY)
def test_ordinary_benches_of_a_foreign_simulator_are_no_gap(name: str) -> None:
    search = search_of(subject_of_bundle(read_bundle(BENCHES / name)).measurement, ())
    assert search.without_effects().fit.per_datum < 1.1
