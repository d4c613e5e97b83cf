"""The next experiment is the one that tells most about the explanations for its time."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.catalogue import candidates, effect_ids, laws
from analysis.gap.effect import Effect, Mechanism
from analysis.gap.effects.attachment import JointMass, MassOfEachJoint
from analysis.gap.effects.beam import AccelerometerMass, YoungsModulus
from analysis.gap.effects.joint_state import ConditioningDrift
from analysis.gap.effects.tester import FixtureInertia, FrameCompliance
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.verdict import UNKNOWN, Status, Weighed
from analysis.gap.experiments.catalogue import (
    CHECKS,
    EXPERIMENTS,
    Experiment,
    FurtherMeasurement,
    RigTime,
    SizeCheck,
    after_readings,
)
from analysis.gap.experiments.expected_data import Reading, as_expected, readable_names, reading_of
from analysis.gap.experiments.next_experiment import LEAST, NextExperiment, experiments_in_turn
from analysis.gap.fitting.fit import fit
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import Model, without_effects
from analysis.gap.measurement import Measurement
from analysis.gap.search.single_effects import search_of
from analysis.gap.simulation.free_beam_modes import beam_modes_of
from tests.analysis.gap.conftest import Made

FURTHER = {each.id: each for each in EXPERIMENTS if isinstance(each, FurtherMeasurement)}
HEAVIER = FURTHER[Experiment.HEAVIER_ACCELEROMETER]
SHUFFLED = FURTHER[Experiment.RANDOM_ORDER]


def fitted(measurement: Measurement, *effects: Effect) -> Model:
    search = search_of(measurement, ())
    simulation = replace(search.simulation(), modes=beam_modes_of(measurement.drawing), effects=effects)
    return Model(effects, fit(simulation, np.zeros(Likelihood(simulation).unknowns)))


def weighed(probability: float, model: Model) -> Weighed[Model]:
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


def told(each: SizeCheck | FurtherMeasurement, *explanations: Weighed[Model]) -> float:
    """Bits that an experiment is expected to tell."""
    return each.asked(explanations, None, RigTime(), UNCALIBRATED)[0]


def test_an_explanation_is_not_told_from_itself_and_another_one_is(of_mass: Model, of_modulus: Model) -> None:
    assert told(HEAVIER, weighed(0.5, of_mass), weighed(0.5, of_mass)) < LEAST
    assert told(HEAVIER, weighed(0.5, of_mass), weighed(0.5, of_modulus)) > 3 * LEAST


def test_random_order_tells_drift_from_compliance_of_a_frame(made: Made) -> None:
    measurement = made((ConditioningDrift(),), (1.0,))
    points = measurement.points
    assert points is not None
    stiff_last = np.argsort(np.argsort(np.abs(points.stiffness))).astype(float)
    drifting = as_expected(
        fitted(measurement, ConditioningDrift()), replace(measurement, points=replace(points, order=stiff_last))
    )
    drift, frame = fitted(drifting, ConditioningDrift()), fitted(drifting, FrameCompliance())
    assert told(SHUFFLED, weighed(0.5, drift), weighed(0.5, frame)) > 0.5


def test_scales_tell_masses_that_they_can_read_and_no_others(of_mass: Model, of_modulus: Model) -> None:
    two = weighed(0.5, of_mass), weighed(0.5, of_modulus)
    scales = SizeCheck(Experiment.WEIGH_PARTS, 5.0, (Reading("accelerometer_mass", "m", 5e-4),))
    coarse = replace(scales, readings=(Reading("accelerometer_mass", "m", 0.05),))
    ruler = SizeCheck(Experiment.MEASURE_PLACES, 5.0, (Reading("support_position", "dx", 5e-4),))
    assert told(scales, *two) == pytest.approx(1.0, abs=0.02)
    assert 0 < told(coarse, *two) < 0.2
    assert told(ruler, *two) == 0.0


def test_a_reading_changes_the_odds_by_what_it_reads(of_mass: Model, of_modulus: Model) -> None:
    two = weighed(0.1, of_mass), weighed(0.89, of_modulus), Weighed(UNKNOWN, of_mass, 0.0, 0.01)
    scales = CHECKS[Experiment.WEIGH_PARTS]
    size = of_mass.fit.value("m")
    there = scales.after(two, {"accelerometer_mass.m": size}, UNCALIBRATED)
    assert (there[0].model, there[0].effects) == (of_mass, ("accelerometer_mass",))
    assert there[0].probability > 0.99
    absent = scales.after(two, {"accelerometer_mass.m": 0.0}, UNCALIBRATED)
    assert absent[0].model is of_modulus
    assert absent[-1].probability < 1e-6
    assert sum(each.probability for each in absent) == pytest.approx(1.0)
    assert scales.after(two, {"joint_mass.m": 0.1}, UNCALIBRATED) == two  # no explanation has it


def test_a_reading_of_one_joint_is_what_a_law_of_equal_masses_expects_there(made: Made) -> None:
    """Explanations may have different laws of one effect; what is read at joint I speaks for both."""
    measurement = made((JointMass(),), (0.5,))
    equal, each = (fitted(measurement, law) for law in (JointMass(), MassOfEachJoint(("I", "II"))))
    none = without_effects(equal, fitted(measurement))
    three = weighed(0.4, equal), weighed(0.4, each), weighed(0.2, none)
    scales, mass = CHECKS[Experiment.WEIGH_PARTS], equal.fit.value("m")
    asked = [name for name, _ in readable_names(three, scales.readings) if name.startswith("joint_mass")]
    assert asked == ["joint_mass.m_I", "joint_mass.m_II"]
    for read in ({"joint_mass.m_I": mass, "joint_mass.m_II": mass}, {"joint_mass.m": mass}):
        for explanations in (three, three[::2], three[1:]):
            left = {found.model: found.probability for found in scales.after(explanations, read, UNCALIBRATED)}
            assert left[none] < 1e-6, (read, left)
            assert all(p > 0.1 for model, p in left.items() if model is not none)


@pytest.mark.filterwarnings("error")
def test_a_reading_far_from_what_an_explanation_expects_is_weighed_without_a_warning(
    of_mass: Model, of_modulus: Model
) -> None:
    two = weighed(0.5, of_mass), weighed(0.5, of_modulus)
    after = CHECKS[Experiment.WEIGH_PARTS].after(two, {"accelerometer_mass.m": 0.1}, UNCALIBRATED)
    assert [each.probability for each in after] == [1.0, 0.0]
    assert np.isfinite(after[1].score)


def test_what_two_checks_read_of_one_thing_counts_once(made: Made) -> None:
    """A trace of inertia that blank and mass both read is one trace, and an estimate that both confirm is one."""
    measurement = made((FixtureInertia(),), (0.5,))
    inertia, none = fitted(measurement, FixtureInertia()), fitted(measurement)
    two = weighed(0.5, inertia), weighed(0.5, none)
    read = {"fixture_inertia.m": 0.03}
    checks = [(each, read) for each in (Experiment.BLANK_TEST, Experiment.MASS_IN_TESTER)]
    once, twice = (
        {each.model: each.probability for each in after_readings(two, some, UNCALIBRATED)}
        for some in (checks[:1], checks)
    )
    closer = SizeCheck(Experiment.BLANK_TEST, 5.0, (Reading("fixture_inertia", "m", 5e-3 / np.sqrt(2)),))
    as_one = {each.model: each.probability for each in closer.after(two, read, UNCALIBRATED)}
    for model in (inertia, none):
        assert twice[model] == pytest.approx(as_one[model], rel=1e-6)
        assert once[model] != pytest.approx(twice[model], rel=1e-6)


def test_an_explanation_that_the_data_refute_is_a_rival_for_checks_alone(of_mass: Model) -> None:
    none = without_effects(of_mass, fitted(of_mass.fit.likelihood.measurement))
    two = weighed(0.9, of_mass), weighed(0.1, none)
    assert told(HEAVIER, *two) == 0.0
    assert told(CHECKS[Experiment.WEIGH_PARTS], *two) > 0.4


def test_of_two_experiments_that_tell_as_much_the_shorter_is_asked_for(of_mass: Model, of_modulus: Model) -> None:
    long = SizeCheck(Experiment.FREE_BEAM, 60.0, (Reading("youngs_modulus", "relative", 1e-3),))
    short = SizeCheck(Experiment.WEIGH_PARTS, 6.0, (Reading("accelerometer_mass", "m", 5e-4),))
    vague = SizeCheck(Experiment.MEASURE_PLACES, 0.1, (Reading("accelerometer_mass", "m", 0.05),))
    two = [weighed(0.6, of_mass), weighed(0.4, of_modulus)]
    found = experiments_in_turn(Status.EXPLAINED, two, (), among=(long, vague, short))[0]
    assert (found.id, found.minutes) == (Experiment.WEIGH_PARTS, 6.0)
    assert found.information == pytest.approx(found.doubt, abs=0.05)


def test_where_one_cannot_be_made_the_next_one_is_that_of_the_others_alone(of_mass: Model, of_modulus: Model) -> None:
    two = [weighed(0.6, of_mass), weighed(0.4, of_modulus)]
    among = CHECKS.values()
    in_turn = experiments_in_turn(Status.EXPLAINED, two, (), among=tuple(among))
    assert [each.id for each in in_turn[:1]] == [Experiment.WEIGH_PARTS]
    assert len(in_turn) > 2
    for number, expected in enumerate(in_turn):
        gone = {each.id for each in in_turn[:number]}
        left = tuple(each for each in among if each.id not in gone)
        assert experiments_in_turn(Status.EXPLAINED, two, (), among=left)[0] == expected
    assert [each.information == 0 for each in in_turn] == [*(len(in_turn) - 1) * [False], True]


def test_an_unknown_cause_is_told_from_a_law_that_says_what_further_data_would_be(of_mass: Model) -> None:
    none = Model((), fitted(of_mass.fit.likelihood.measurement).fit)
    two = weighed(0.5, of_mass), Weighed(UNKNOWN, of_mass, 0.0, 0.5)
    assert HEAVIER.asked(two, none, RigTime(), UNCALIBRATED)[0] > 0.3


def test_no_gap_asks_for_nothing_and_an_unknown_cause_for_a_new_set_up(of_mass: Model) -> None:
    assert experiments_in_turn(Status.NONE, [weighed(0.9, of_mass)], ()) == (NextExperiment(Experiment.NOTHING),)
    found = experiments_in_turn(Status.UNKNOWN, [Weighed(UNKNOWN, of_mass, 0.0, 0.9)], ())[0]
    assert found == NextExperiment(Experiment.NEW_SET_UP)


def test_confounded_effects_ask_for_the_first_experiment_that_tells_them_apart(
    of_mass: Model, of_modulus: Model
) -> None:
    explanations = [weighed(0.6, of_mass), weighed(0.3, of_modulus)]
    found = experiments_in_turn(Status.EXPLAINED, explanations, [("accelerometer_mass", "youngs_modulus")])[0]
    assert (found.id, found.tells_apart) == (Experiment.WEIGH_PARTS, True)
    assert found.effects == ("accelerometer_mass", "youngs_modulus")
    assert 0 < found.information <= found.doubt


def test_a_clear_verdict_is_to_be_confirmed_against_the_next_best(of_mass: Model, of_modulus: Model) -> None:
    found = experiments_in_turn(Status.EXPLAINED, [weighed(0.97, of_mass), weighed(0.02, of_modulus)], ())[0]
    assert (found.id, found.tells_apart, found.effects) == (Experiment.WEIGH_PARTS, False, ("accelerometer_mass",))


def test_where_nothing_tells_the_verdict_from_another_its_effects_are_to_be_corrected(of_mass: Model) -> None:
    found = experiments_in_turn(Status.EXPLAINED, [weighed(1.0, of_mass)], ())[0]
    assert found == NextExperiment(Experiment.CORRECT_EFFECTS, ("accelerometer_mass",))


def test_every_effect_of_the_bench_has_an_experiment() -> None:
    checked = {each.effect for check in EXPERIMENTS if isinstance(check, SizeCheck) for each in check.readings}
    assert checked <= set(effect_ids())
    of_laws = {law.id: law for law in laws()}
    simulated = {"density", "conditioning_drift"} | {
        each for each, law in of_laws.items() if law.mechanism in (Mechanism.JOINT_AMPLITUDE, Mechanism.JOINT_FREQUENCY)
    }
    in_records = {"double_hit", "mains_hum"}
    assert set(effect_ids()) - checked <= simulated | in_records


def test_every_reading_is_a_parameter_of_its_effect(empty: Measurement) -> None:
    known = [(each.id, parameter.name) for each in candidates(empty) for parameter in each.parameters]
    for check in EXPERIMENTS:
        for each in check.readings if isinstance(check, SizeCheck) else ():
            assert any(reading_of(f"{effect}.{name}", (each,)) for effect, name in known), each
