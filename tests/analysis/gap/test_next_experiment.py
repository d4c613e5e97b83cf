"""The cheapest further measurement is the first that is expected to settle the matter."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.catalogue import effect_ids
from analysis.gap.effect import Effect
from analysis.gap.effects.beam import AccelerometerMass, YoungsModulus
from analysis.gap.effects.joint_state import ConditioningDrift
from analysis.gap.effects.tester import FrameCompliance
from analysis.gap.fit import CLOSE, Likelihood, fit
from analysis.gap.free_beam_modes import beam_modes_of
from analysis.gap.measurement import Measurement
from analysis.gap.model import Model
from analysis.gap.next_experiment import (
    CONVINCING,
    EXPERIMENTS,
    Check,
    Experiment,
    FurtherMeasurement,
    NextExperiment,
    _expected,
    next_experiment,
    separation,
)
from analysis.gap.search import search_of
from analysis.gap.verdict import UNKNOWN, Status, Weighed
from tests.analysis.gap.conftest import Made

FURTHER = {each.id: each for each in EXPERIMENTS if isinstance(each, FurtherMeasurement)}
HEAVIER = FURTHER[Experiment.HEAVIER_ACCELEROMETER]
SHUFFLED = FURTHER[Experiment.RANDOM_ORDER]
SOFTER = FURTHER[Experiment.HALF_FORCE]


def fitted(measurement: Measurement, *effects: Effect) -> Model:
    search = search_of(measurement, ())
    simulation = replace(search.simulation(), modes=beam_modes_of(measurement.drawing), effects=effects)
    return Model(effects, fit(simulation, np.zeros(Likelihood(simulation).unknowns)))


def weighed(probability: float, model: Model) -> Weighed:
    return Weighed(tuple(sorted(model.ids)), model, float(np.log(probability)), probability)


@pytest.fixture(scope="module")
def heavy(made: Made) -> Measurement:
    """Of a bench with too heavy an accelerometer."""
    return made((AccelerometerMass(),), (0.5,))


@pytest.fixture(scope="module")
def of_mass(heavy: Measurement) -> Model:
    return fitted(heavy, AccelerometerMass())


@pytest.fixture(scope="module")
def of_modulus(heavy: Measurement) -> Model:
    return fitted(heavy, YoungsModulus())


def test_an_explanation_follows_what_it_expects_itself(of_mass: Model) -> None:
    for each in FURTHER.values():
        assert each.separation(of_mass, of_mass) == pytest.approx(0.0, abs=1e-3)


def test_a_separation_is_by_how_much_a_fit_to_both_measurements_is_worse(of_mass: Model, of_modulus: Model) -> None:
    alone = of_modulus.fit
    first, simulation = alone.likelihood.measurement, alone.likelihood.simulation
    further = SOFTER.planned(first)
    assert further is not None
    seen = _expected(of_mass, further)
    both = simulation.of(replace(first, sets=(*first.sets, *seen.sets)))
    shared = len(both.shared)
    start = np.zeros(Likelihood(both).unknowns)
    start[:shared] = alone.scores[:shared]
    together = fit(both, start, CLOSE)
    expected = separation(of_mass, of_modulus, further, "inverse")
    assert expected > 1  # joints that differ by set-up and smooth errors leave little to half the force
    assert expected**2 == pytest.approx(together.at.cost - alone.at.cost, rel=0.02)


def test_noise_makes_a_further_measurement_tell_less(of_mass: Model, of_modulus: Model) -> None:
    further = HEAVIER.planned(of_mass.fit.likelihood.measurement)
    assert further is not None
    noisy = replace(further, sets=tuple(replace(each, deviation=3 * each.deviation) for each in further.sets))
    quiet, loud = (separation(of_mass, of_modulus, each, "inverse") for each in (further, noisy))
    assert 0 < loud < quiet


def test_random_order_tells_drift_from_compliance_of_a_frame(made: Made) -> None:
    measurement = made((ConditioningDrift(),), (1.0,))
    points = measurement.points
    assert points is not None
    stiff_last = np.argsort(np.argsort(np.abs(points.stiffness))).astype(float)
    drifting = _expected(
        fitted(measurement, ConditioningDrift()), replace(measurement, points=replace(points, order=stiff_last))
    )
    drift, frame = fitted(drifting, ConditioningDrift()), fitted(drifting, FrameCompliance())
    assert SHUFFLED.separation(drift, frame) > CONVINCING


def test_a_check_tells_sizes_that_only_one_explanation_has(of_mass: Model, of_modulus: Model) -> None:
    scales = Check(Experiment.WEIGH_PARTS, ("accelerometer_mass", "density"), 0.05)
    size = abs(of_mass.fit.scores[of_mass.places(0)[0]])
    assert scales.separation(of_mass, of_modulus) == pytest.approx(size / 0.05)
    assert scales.separation(of_modulus, of_mass) == pytest.approx(size / 0.05)
    assert scales.separation(of_mass, of_mass) == 0.0


def test_no_gap_asks_for_nothing_and_an_unknown_cause_for_a_new_set_up(of_mass: Model) -> None:
    assert next_experiment(Status.NONE, [weighed(0.9, of_mass)], ()) == NextExperiment(Experiment.NOTHING)
    found = next_experiment(Status.UNKNOWN, [Weighed(UNKNOWN, of_mass, 0.0, 0.9)], ())
    assert found == NextExperiment(Experiment.NEW_SET_UP)


def test_confounded_effects_ask_for_the_first_experiment_that_tells_them_apart(
    of_mass: Model, of_modulus: Model
) -> None:
    explanations = [weighed(0.6, of_mass), weighed(0.3, of_modulus)]
    found = next_experiment(Status.EXPLAINED, explanations, [("accelerometer_mass", "youngs_modulus")])
    assert (found.id, found.tells_apart) == (Experiment.WEIGH_PARTS, True)
    assert found.effects == ("accelerometer_mass", "youngs_modulus")
    assert found.separation > 0


def test_a_clear_verdict_is_to_be_confirmed_against_the_next_best(of_mass: Model, of_modulus: Model) -> None:
    found = next_experiment(Status.EXPLAINED, [weighed(0.97, of_mass), weighed(0.02, of_modulus)], ())
    assert (found.id, found.tells_apart, found.effects) == (Experiment.WEIGH_PARTS, False, ("accelerometer_mass",))


def test_where_nothing_tells_the_verdict_from_another_its_effects_are_to_be_corrected(of_mass: Model) -> None:
    found = next_experiment(Status.EXPLAINED, [weighed(1.0, of_mass)], ())
    assert found == NextExperiment(Experiment.CORRECT_EFFECTS, ("accelerometer_mass",))


def test_every_effect_of_the_bench_has_an_experiment() -> None:
    checked = {name for each in EXPERIMENTS if isinstance(each, Check) for name in each.tells}
    assert checked <= set(effect_ids())
    seen_otherwise = {"conditioning_drift", "double_hit", "mains_hum"}  # by another order, and in raw blows
    assert set(effect_ids()) - checked <= seen_otherwise
    assert all(0 < each.share < 1 for each in EXPERIMENTS if isinstance(each, Check))
