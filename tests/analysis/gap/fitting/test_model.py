"""Models of one measurement: what one leaves to another."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.effects.joint_amplitude import CoulombFriction
from analysis.gap.evidence.model_evidence import log_evidence
from analysis.gap.evidence.residual_structure import energy_of
from analysis.gap.fitting.fit import evaluated, fit
from analysis.gap.fitting.model import Model, misfit, refined, with_misfit_on, with_overdispersion, without_effects
from analysis.gap.fitting.scale_estimate import HOLDS
from analysis.gap.fitting.stages import FINAL
from analysis.gap.measurement import Measurement
from tests.analysis.gap.conftest import Made, search_among


def test_an_effect_of_amplitude_taken_out_leaves_the_unknowns_of_the_paper_s_model(made: Made) -> None:
    search = search_among(made().thinned(25), {"coulomb_friction"})
    none = search.fit_paper_model()
    (friction, *_) = search.fitted(none, search.screened(none, search.candidates, always=1), 1)
    assert friction.fit.scores.size > none.fit.scores.size + len(friction.places(0))
    left: Model = without_effects(friction, none)
    assert left.fit.scores.shape == none.fit.scores.shape
    assert np.isfinite(left.log_evidence)


def noisier(measured: Measurement, factor: float) -> Measurement:
    """The same readings with deviations that are some times as large."""
    points = measured.points
    assert points is not None
    sets = tuple(replace(each, deviation=factor * each.deviation) for each in measured.sets)
    return replace(measured, sets=sets, points=replace(points, deviation=factor * points.deviation))


def test_a_model_that_holds_by_tolerances_far_beyond_what_is_stated_is_not_clean(made: Made) -> None:
    none = search_among(noisier(made().thinned(8), 1e6), {"joint_mass"}).fit_paper_model()
    assert none.clean
    astray = Model((), evaluated(none.fit.likelihood, none.fit.scores + 6.0))
    assert astray.fit.per_datum < HOLDS
    assert not astray.clean


def test_a_fit_with_overdispersion_is_that_of_readings_with_as_much_noise(made: Made) -> None:
    overdispersion = 100.0
    measured = made((CoulombFriction(),), (1.0,))
    search = search_among(measured, {"coulomb_friction"})
    none = search.fit_paper_model()
    (leading, *_) = search.fitted(none, search.screened(none, search.candidates, always=1), 1)
    friction = refined(leading, measured, replace(leading.fit.likelihood.scales, model_error=0.0))
    found = with_overdispersion(friction, overdispersion)
    simulation = friction.fit.likelihood.simulation.of(noisier(measured, np.sqrt(overdispersion)))
    expected = fit(simulation, friction.fit.scores, (FINAL,), 1e-3)
    again = found.fit_with(overdispersion)
    assert log_evidence(again) == pytest.approx(log_evidence(expected), abs=0.1)
    off = again.scores - expected.scores
    assert np.max(np.abs(off) / expected.deviations) < 0.05
    assert found.fit is friction.fit


def test_a_misfit_between_the_lines_of_a_fit_counts_in_proportion(made: Made) -> None:
    whole = made()
    first, *others = whole.sets
    bump = 40 * np.exp(-(np.linspace(-2, 2, 7) ** 2))
    left = np.zeros(first.accelerance.shape)
    left[0, 1:8] = bump  # a fit to every eighth line sees lines 0 and 8
    changed = replace(whole, sets=(replace(first, accelerance=first.accelerance + left * first.deviation), *others))
    thinned = changed.thinned(first.frequency.size // 8)
    none = search_among(thinned, {"joint_mass"}).fit_paper_model()
    assert misfit(none.fit).certain == 0.0
    seen, before = (with_misfit_on(none, each).misfit for each in (changed, whole))
    share = thinned.sets[0].frequency.size / first.frequency.size
    expected = share * energy_of(left[0].astype(complex))[0]
    assert seen.energy - before.energy == pytest.approx(expected, rel=0.2)
    assert seen.certain > 0.5 * expected


def test_the_misfit_on_the_lines_of_a_fit_is_its_own(made: Made) -> None:
    lines = made().thinned(25)
    none = search_among(lines, {"joint_mass"}).fit_paper_model()
    own, again = misfit(none.fit), with_misfit_on(none, lines).misfit
    assert (again.energy, again.deviation, again.excess) == pytest.approx((own.energy, own.deviation, own.excess))
