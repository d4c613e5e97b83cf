"""What differs on every bench is estimated from the data, and is no reason for an effect."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.effects.attachment import JointMass
from analysis.gap.evidence.plausibility import CHANCE
from analysis.gap.fitting.fit import Fit, fit
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import Model, misfit
from analysis.gap.fitting.scale_estimate import HOLDS, with_likely_scales
from analysis.gap.fitting.stages import FINAL
from analysis.gap.measurement import Measurement, SetUpTolerances
from analysis.gap.search.single_effects import search_of
from analysis.gap.simulation.scales import HALF_NORMAL, Scales
from analysis.gap.simulation.two_rigs import Simulation
from jointlab.diagnosis.load import subject_of_bundle
from store.exchange.bundle import read_bundle
from tests.analysis.gap.conftest import LEAN, Made, simulation_of
from tests.recordings import SHARED

BENCHES = SHARED / "benches"
NONE_BUT_ORDINARY = ("ordinary-1", "ordinary-2")
DRAWS = 40
"""Of smooth errors."""
MISSING = "labelled bundles of a foreign simulator are not on this machine"


def plain(measurement: Measurement) -> Fit:
    """The paper's model, with scales at those of their priors."""
    simulation = simulation_of(measurement)
    return fit(simulation, np.zeros(Likelihood(simulation).unknowns))


def ordinary(measurement: Measurement, scales: Scales, seed: int = 5) -> Measurement:
    """The same with gains by configuration and smooth errors of these scales, drawn by seed.

    Every set has the same rows: they have a share of their errors in common.
    """
    random, points = np.random.default_rng(seed), measurement.points
    assert points is not None
    gains = 1 + scales.configuration_gain * np.array([1.0, -1.2, 0.4])
    frequency, sets = measurement.sets[0].frequency, []
    process = np.exp(-((frequency[:, None] - frequency) ** 2) / (2 * scales.correlation**2))
    smooth = np.linalg.cholesky(process + 1e-9 * np.eye(frequency.size)).T * scales.model_error
    common = random.standard_normal((2, *measurement.sets[0].accelerance.shape)) * np.sqrt(scales.common)
    for each in measurement.sets:
        own = random.standard_normal(common.shape) * np.sqrt(1 - scales.common)
        drawn = (common + own) @ smooth
        sets.append(replace(each, accelerance=each.accelerance * (1 + drawn[0] + 1j * drawn[1])))
    return replace(
        measurement,
        sets=tuple(sets),
        points=replace(points, stiffness=points.stiffness * gains[points.configuration]),
    )


def with_noise(measurement: Measurement, random: np.random.Generator) -> Measurement:
    """The same, with noise of the accelerances."""
    sets = []
    for each in measurement.sets:
        noise = random.standard_normal(each.accelerance.shape) + 1j * random.standard_normal(each.accelerance.shape)
        sets.append(replace(each, accelerance=each.accelerance + each.deviation * noise))
    return replace(measurement, sets=tuple(sets))


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
    assert found.likelihood.scales.correlation == pytest.approx(40.0, rel=0.4)  # noise is nearly as large
    for name in ("configuration_gain", "model_error"):
        assert 0.5 < getattr(found.likelihood.scales, name) / getattr(true, name) < 2.5, name


@pytest.mark.parametrize("correlation", [25.0, 60.0])
def test_smooth_errors_of_any_length_leave_nothing_beyond_noise(made: Made, correlation: float) -> None:
    """Their noise is a small part of these errors, as on a good bench, so that a wrong length shows as a misfit."""
    true = Scales(setup_scatter=0.0, configuration_gain=0.0, model_error=0.006, blow_lean=0.0, correlation=correlation)
    found = with_likely_scales(plain(ordinary(made(), true)))
    assert found.likelihood.scales.correlation == pytest.approx(correlation, rel=0.2)
    assert misfit(found).significance < CHANCE


@pytest.mark.parametrize(("common", "low", "high"), [(0.0, 0.0, 0.3), (0.6, 0.3, 0.8), (1.0, 0.985, 1.0)])
def test_the_share_of_smooth_errors_that_all_sets_have_is_found(
    made: Made, common: float, low: float, high: float
) -> None:
    true = Scales(
        setup_scatter=0.0, configuration_gain=0.0, model_error=0.006, blow_lean=0.0, correlation=25.0, common=common
    )
    measurement = made()  # with lines too far apart for what neighbours show of a sharp peak
    sets = tuple(replace(each, reference=each.accelerance) for each in measurement.sets)
    found = with_likely_scales(plain(ordinary(replace(measurement, sets=sets), true)))
    assert low <= found.likelihood.scales.common <= high
    assert misfit(found).significance < CHANCE


def test_what_a_model_lacks_is_no_smooth_error_that_sets_have_in_common(made: Made) -> None:
    lacking = with_likely_scales(plain(made((JointMass(),), (1.0,))))
    assert lacking.per_datum > HOLDS
    assert lacking.likelihood.scales.common == 0.0


def test_estimates_scatter_by_their_standard_errors_where_sets_have_their_errors_in_common(made: Made) -> None:
    """Where such errors count as those of each set, what the sets tell together seems to be known better than it is."""
    scales = Scales(
        setup_scatter=0.0, configuration_gain=0.0, model_error=0.005, blow_lean=0.0, correlation=25.0, common=1.0
    )
    stated = SetUpTolerances(setup_scatter=0.0, configuration_gain=0.0, model_error=0.005, blow_lean=0.0)
    first = plain(replace(made(), tolerances=stated).thinned(40))
    measurement, true = first.likelihood.measurement, first.likelihood.predict(first.scores, ()).accelerances
    pairs = zip(measurement.sets, true, strict=True)
    there = replace(measurement, sets=tuple(replace(each, accelerance=h, reference=h) for each, h in pairs))
    random = np.random.default_rng(3)
    drawn = [with_noise(ordinary(there, scales, seed), random) for seed in range(DRAWS)]
    gains = [own[0] for own in first.likelihood.setups]  # nearest to what smooth errors do
    together, apart = np.zeros(len(first.scores)), np.zeros(len(first.scores))
    together[gains], apart[gains] = [1, 1], [1, -1]
    ratio = dict[float, list[float]]()
    for common in (0.0, 1.0):
        simulation = first.likelihood.simulation.with_scales(replace(scales, common=common))
        found = [fit(simulation.of(each), first.scores, (FINAL,), 1e-2) for each in drawn]
        assert np.mean([each.per_datum for each in found]) == pytest.approx(1.0, abs=0.05)
        scatter, known = np.cov(np.transpose([each.scores for each in found])), found[0].covariance
        by_data = known @ (found[0].at.normal - np.eye(len(known))) @ known  # scatter of the most likely scores
        ratio[common] = [float(way @ scatter @ way / (way @ by_data @ way)) for way in (together, apart)]
    assert ratio[1.0] == pytest.approx([1.0, 1.0], abs=3 * np.sqrt(2 / DRAWS))
    assert ratio[0.0][0] > 1.5 * ratio[1.0][0]
    assert ratio[0.0][1] < 0.5 * ratio[1.0][1]


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
        tolerances=replace(
            measurement.tolerances,
            setup_scatter=0.0,
            configuration_gain=0.0,
            model_error=0.0,
            blow_lean=LEAN,
        ),
    )
    without = plain(stated)
    simulation = Simulation(without.likelihood.simulation.baseline, simulation.modes, (JointMass(),))
    with_mass = fit(simulation, np.concatenate([without.scores[:shared], [0.0], without.scores[shared:]]))
    before = Model((JointMass(),), with_mass).log_evidence - Model((), without).log_evidence
    assert before > 10
    assert gain > 0.5 * before  # scales that are not known may take a part of it


def test_scales_that_are_stated_stay(clean: Measurement) -> None:
    stated = SetUpTolerances(setup_scatter=0.01, configuration_gain=0.02, model_error=0.001)
    found = with_likely_scales(plain(replace(clean, tolerances=stated))).likelihood.scales
    assert (found.setup_scatter, found.configuration_gain, found.model_error) == (0.01, 0.02, 0.001)


@pytest.mark.skipif(not BENCHES.is_dir(), reason=MISSING)
@pytest.mark.parametrize("name", NONE_BUT_ORDINARY)
def test_ordinary_benches_of_a_foreign_simulator_are_no_gap(name: str) -> None:
    search = search_of(subject_of_bundle(read_bundle(BENCHES / name)).measurement, ())
    assert search.fit_paper_model().fit.per_datum < 1.1
