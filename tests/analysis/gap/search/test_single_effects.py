"""What the search finds on benches that follow its own model."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.effects.attachment import TurningMass
from analysis.gap.effects.beam import AccelerometerMass
from analysis.gap.effects.tester import FrameCompliance, TransducerLag
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.verdict import UNKNOWN, weigh
from analysis.gap.fitting.fit import fit
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import misfit
from analysis.gap.measurement import Measurement
from analysis.gap.outside_catalogue.local_change import Absorber, FixedAcross, FixedTurning
from analysis.gap.search.forward_selection import selected
from analysis.gap.search.screening import PLAUSIBLE
from analysis.gap.search.single_effects import Search, settled
from tests.analysis.gap.conftest import Made, measured, search_among

TRIED = {
    *("accelerometer_mass", "frame_compliance", "transducer_lag", "joint_mass", "temperature_shift", "beam_damping"),
    *("vertical_offset", "fixture_inertia", "sensor_gain", "channel_delay"),
}
"""Enough of the catalogue to be mistaken in."""


def searched(measurement: Measurement) -> Search:
    return search_among(measurement, TRIED)


def test_noise_and_tolerances_alone_leave_nothing_to_explain(made: Made) -> None:
    search = searched(made())
    none = search.fit_paper_model()
    assert none.fit.per_datum == pytest.approx(1.0, abs=5 * np.sqrt(2 / none.fit.likelihood.data) + 0.05)
    weighed = weigh(none, search.singles(none), UNCALIBRATED)
    assert weighed[0].effects == ()
    assert weighed[0].probability > 0.9


@pytest.mark.parametrize(
    ("effect", "score"), [(AccelerometerMass(), 1.0), (FrameCompliance(), 0.5), (TransducerLag(), 0.8)]
)
def test_an_effect_is_named_with_its_size(
    made: Made, effect: AccelerometerMass | FrameCompliance | TransducerLag, score: float
) -> None:
    search = searched(made((effect,), (score,)))
    none = search.fit_paper_model()
    weighed = weigh(none, search.singles(none), UNCALIBRATED)
    assert weighed[0].effects == (effect.id,)
    found = weighed[0].model
    (place,) = found.places(0)
    assert abs(found.fit.scores[place] - score) < 4 * found.fit.deviations[place] + 1e-3


def test_of_each_law_the_closest_start_is_fitted_to_the_end_and_what_falls_behind_is_left(made: Made) -> None:
    measurement = made((FrameCompliance(),), (0.5,))
    search = search_among(measurement, {"frame_compliance", "foundation_compliance", "joint_mass"})
    none = search.fit_paper_model()
    found = search.singles(none)
    laws = [(each.effects[0].id, each.effects[0].law) for each in found]
    assert len(set(laws)) == len(laws)
    best, *others = found
    assert best.ids == ("frame_compliance",)
    assert best.clean
    beaten = [each for each in others if each.ids != best.ids]
    assert beaten
    assert not any(each.fit.converged for each in beaten), "a model far behind one that is clean is not searched for"


def test_the_two_best_laws_of_a_leading_effect_converge_where_data_are_very_precise(empty: Measurement) -> None:
    precise = replace(empty, sets=tuple(replace(each, deviation=each.deviation / 100) for each in empty.sets))
    search = search_among(measured(precise, (TurningMass(),), (1.5,)), {"joint_mass"})
    best, second, *_ = search.singles(search.fit_paper_model())
    assert best.effects != second.effects
    assert best.fit.converged
    assert second.fit.converged


def test_what_no_effect_explains_is_unknown(made: Made) -> None:
    measurement = made()
    each = measurement.sets[0]
    # a resonance in one row of one set that nothing in the catalogue can make
    hung = 0.4 / (1 - (each.frequency / 400.0) ** 2 + 0.05j)
    accelerance = each.accelerance.copy()
    accelerance[2] += hung
    spoilt = replace(measurement, sets=(replace(each, accelerance=accelerance), *measurement.sets[1:]))
    search = searched(spoilt.thinned(25))
    none = search.fit_paper_model()
    weighed = weigh(none, selected(search, none, UNCALIBRATED), UNCALIBRATED)
    assert weighed[0].effects == UNKNOWN


def test_misfit_beyond_noise_is_zero_where_the_model_holds_at_any_noise(made: Made) -> None:
    measurement = made()
    doubled = replace(measurement, sets=tuple(replace(each, deviation=2 * each.deviation) for each in measurement.sets))
    for each in (measurement, doubled):
        search = searched(each)
        found = misfit(search.fit_paper_model().fit)
        assert abs(found.energy) < 4 * found.deviation


def test_intervals_of_parameters_hold_what_the_bench_was_made_of(made: Made) -> None:
    """Over seeds, the estimates scatter about the truth as their standard deviations say."""
    off = []
    for seed in range(6):
        measurement = made((FrameCompliance(),), (0.4,), seed=seed)
        search = searched(measurement)
        simulation = search.simulation((FrameCompliance(),))
        found = fit(simulation, np.zeros(Likelihood(simulation).unknowns))
        place = len(simulation.baseline.parameters)
        off.append((found.scores[place] - 0.4) / found.deviations[place])
    assert np.sqrt(np.mean(np.square(off))) < 1.8
    assert np.max(np.abs(off)) > 0.1


@pytest.mark.parametrize(("place", "damper"), [(3, 0.01), (4, 0.06), (5, 0.04)])
def test_a_small_change_of_the_beam_is_found_at_its_place(
    made: Made, empty: Measurement, place: int, damper: float
) -> None:
    """Fits from wrong places end in other minima; inflated noise would hide which of them is the right one."""
    places = FixedAcross.variants(empty)
    measurement = made((places[place],), (0.0, damper, 0.0, 0.4))
    search = search_among(measurement, set())
    none = search.fit_paper_model()
    assert none.fit.per_datum < PLAUSIBLE
    (found,) = search.fitted_everywhere(none, places, known=[none])
    assert found.clean
    assert found.fit.value("position") == pytest.approx(places[place].position.value(0.4), abs=0.03)


@pytest.mark.parametrize(("place", "resonance"), [(2, 0.44), (4, 0.2), (4, 0.8), (5, -0.3)])
def test_a_narrow_resonance_is_found_at_its_frequency_and_with_a_mass_above_zero(
    made: Made, empty: Measurement, place: int, resonance: float
) -> None:
    """From most frequencies fits end elsewhere, some of them with a mass below zero."""
    places = Absorber.variants(empty)
    search = search_among(made((places[place],), (0.26, resonance, -0.8, 0.3)), set())
    none = search.fit_paper_model()
    (found,) = search.fitted_everywhere(none, places, known=[none])
    found = settled(found)
    assert found.clean
    assert found.fit.value("m") > 0.0
    assert found.fit.value("f") == pytest.approx(places[place].parameters[1].value(resonance), rel=0.02)


@pytest.mark.parametrize(("place", "damper"), [(1, 0.3), (4, 0.05), (6, 0.05)])
def test_a_damper_against_turning_is_found_where_a_step_promises_most_of_it(
    made: Made, empty: Measurement, place: int, damper: float
) -> None:
    """With inflated noise other places come as close, and end 25 to 440 higher in chi-square."""
    places = FixedTurning.variants(empty)
    search = search_among(made((places[place],), (0.0, damper, 0.0, 0.3)), set())
    none = search.fit_paper_model()
    (found,) = search.fitted_everywhere(none, places, known=[none])
    assert found.clean
    assert found.fit.value("position") == pytest.approx(places[place].position.value(0.3), abs=0.04)
