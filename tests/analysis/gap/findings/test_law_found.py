"""The law of the joints as found covers the true one within its band, where measured data reach."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from analysis.frequency_response import Real
from analysis.gap.catalogue import effect_ids, laws
from analysis.gap.diagnosis import diagnose
from analysis.gap.effect import Effect, Given, LawOver, Mechanism, acts_on
from analysis.gap.effects.joint_amplitude import AmplitudeDependence, BentDependence, CoulombFriction, CubicStiffness
from analysis.gap.effects.joint_frequency import (
    LOSS_REFERENCE,
    OVER_FREQUENCY,
    FractionalZener,
    JointsOverFrequency,
    LossLawOfEach,
)
from analysis.gap.effects.joint_state import (
    ConditioningDrift,
    LogarithmicDrift,
    PreloadStiffening,
    PreloadWithLoss,
    TemperatureShift,
)
from analysis.gap.effects.tester import FrameCompliance
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.verdict import Weighed
from analysis.gap.findings.effects_found import effects_found
from analysis.gap.findings.intervals import Band
from analysis.gap.findings.law_found import LawFound, law_found
from analysis.gap.fitting.fit import evaluated, fit
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import Model
from analysis.gap.fitting.stages import FROM_TESTER
from analysis.gap.measurement import Measurement
from tests.analysis.gap.conftest import Made, drawn_scores, simulation_of

LINES, SEED = 42, 3
HELD = 0.8
"""Share of a range over which a band of 90 % has to hold: places beside each other err alike on one bench."""
Law = Callable[[Given, Real], tuple[Real, Real]]
"""(n,) factors of k' and of k'' in compression, up to a constant for k'."""


def kraus(given: Given, x: Real) -> tuple[Real, Real]:
    def both(amplitude: Real | float) -> tuple[Real, Real]:
        size, ratio = (np.asarray(amplitude) / given["xc"]) ** given["m"], given["k0_over_kinf"] - 1
        loss = 2 * given["loss_peak"] * size + given["loss_follows"] * ratio
        return 1 + ratio / (1 + size**2), 1 + loss / (1 + size**2)

    (storage, loss), (unit, unit_loss) = both(x), both(25e-6)
    return storage / unit, loss / unit_loss


def cubic(given: Given, x: Real) -> tuple[Real, Real]:
    return 1 + given["beta"] * x**2, np.ones_like(x)


def loss_power(given: Given, x: Real) -> tuple[Real, Real]:
    return np.ones_like(x), (x / LOSS_REFERENCE) ** given["p_compression"]


def smooth(given: Given, x: Real) -> tuple[Real, Real]:
    storage, loss = (np.exp(OVER_FREQUENCY.at(given, name, x)) for name in ("storage", "loss"))
    return storage, loss


def preload(given: Given, x: Real) -> tuple[Real, Real]:
    return 1 + given["s"] * 1e3 * x, np.ones_like(x)


def preload_with_loss(given: Given, x: Real) -> tuple[Real, Real]:
    storage, _ = preload(given, x)
    return storage, storage


def warmer(given: Given, x: Real) -> tuple[Real, Real]:
    """Relative to the beam, which is delta_t warmer than the tester."""
    softer = given["softening"] * (given["delta_t"] - x)
    return np.exp(softer), np.exp(softer * given["loss_ratio"])


def drift(given: Given, x: Real) -> tuple[Real, Real]:
    done = np.log1p(100 * x) / np.log(101)
    factor = (1 - given["d"] * done) / (1 - given["d"] * given["under_beam"])
    return factor, factor


CASES: list[tuple[Effect, tuple[float, ...], Law, LawOver]] = [
    (AmplitudeDependence(), (0.8, 0.0, 0.0, 0.5, 0.3), kraus, LawOver.AMPLITUDE),
    (CubicStiffness(), (0.6,), cubic, LawOver.AMPLITUDE),
    (LossLawOfEach(), (0.5, 0.8), loss_power, LawOver.FREQUENCY),
    (JointsOverFrequency(), (0.5, 0.2, 0.3, -0.4, 0.6, 0.1, 0.2, 0.3, 0.0), smooth, LawOver.FREQUENCY),
    (PreloadStiffening(0.5), (0.7,), preload, LawOver.PRELOAD),
    (PreloadWithLoss(0.5), (0.7,), preload_with_loss, LawOver.PRELOAD),
    (TemperatureShift(), (1.0, 0.0, 0.0, 0.0, 0.0), warmer, LawOver.TEMPERATURE),
    (LogarithmicDrift(), (1.0,), drift, LawOver.ORDER),
]


def fitted(made: Made, effect: Effect, own: tuple[float, ...]) -> Model:
    measurement = made((effect,), own, seed=SEED).thinned(LINES)
    simulation = simulation_of(measurement, effect)
    return Model((effect,), fit(simulation, np.zeros(Likelihood(simulation).unknowns), FROM_TESTER))


def truth(empty: Measurement, effect: Effect, own: tuple[float, ...]) -> tuple[Given, Real, Real]:
    """True parameters of the effect; the stiffness of each joint in compression (joints,), and its loss factor."""
    likelihood = Likelihood(simulation_of(empty, effect))
    scores = drawn_scores(likelihood, own, np.random.default_rng(SEED))
    values = likelihood.simulation.values(scores[: len(likelihood.simulation.shared)].tolist())
    names = [joint.name for joint in empty.drawing.joints]
    b, gamma = (np.array([values.baseline[f"{part}({name})"] for name in names]) for part in ("b", "gamma_b"))
    return values.acting[0][1], b, gamma


def found_for(model: Model) -> LawFound:
    found = law_found(model, 0, UNCALIBRATED)
    assert found is not None
    return found


def held(band: Band, true: Real) -> float:
    """Share of the range over which the band holds a true curve; rounding counts as nothing."""
    return float(np.mean((band.low - 1e-9 <= true) & (true <= band.high + 1e-9)))


@pytest.mark.parametrize(("effect", "own", "law", "over"), CASES, ids=lambda case: getattr(type(case), "__name__", ""))
def test_the_band_holds_the_true_law_over_the_range_of_the_data(
    made: Made, empty: Measurement, effect: Effect, own: tuple[float, ...], law: Law, over: LawOver
) -> None:
    found = found_for(fitted(made, effect, own))
    given, b, gamma = truth(empty, effect, own)
    storage, loss = law(given, found.at)
    band = found.compression
    assert found.over is over
    assert held(band.stiffness, storage / storage[0]) >= HELD
    factor = loss / storage * np.sum(b * gamma) / np.sum(b)
    assert held(band.loss_factor, factor) >= HELD
    assert held(band.loss_ratio, factor / factor[0]) >= HELD
    change = max(np.ptp(storage / storage[0]), np.ptp(loss / loss[0]))
    assert np.max(band.stiffness.high - band.stiffness.low) < change, "a band that says something"


def test_friction_is_seen_in_the_loss_factor_alone(made: Made, empty: Measurement) -> None:
    found = found_for(fitted(made, CoulombFriction(), (1.0,)))
    given, b, gamma = truth(empty, CoulombFriction(), (1.0,))
    rubbing = len(b) * 4 * given["F_c"] / (np.pi * found.at)
    assert held(found.compression.loss_factor, np.asarray((np.sum(b * gamma) + rubbing) / np.sum(b))) >= HELD
    np.testing.assert_allclose(found.compression.stiffness.value, 1.0)
    assert np.all(found.compression.stiffness.high - found.compression.stiffness.low < 1e-9)


def test_a_law_that_bends_is_drawn_as_it_bends(made: Made, empty: Measurement) -> None:
    effect, own = BentDependence(), (0.8, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, -1.0, 1.0, 2.0)
    found = found_for(fitted(made, effect, own))
    given, *_ = truth(empty, effect, own)
    straight, _ = kraus(given, found.at)
    bend = np.array([given[f"more_storage_at_um_{knot}"] for knot in (2, 8, 25, 60)])
    logarithm = np.log(np.clip(1e6 * found.at, 2.0, 60.0))
    powers = np.log([2.0, 8.0, 25.0, 60.0])[:, None] ** np.arange(4)
    share = (logarithm[:, None] ** np.arange(4)) @ np.linalg.solve(powers, bend)
    bent = straight ** (1 + share)
    assert held(found.compression.stiffness, bent / bent[0]) >= HELD
    assert held(found.compression.stiffness, straight / straight[0]) < 0.5


def test_amplitudes_are_those_of_sines_and_blows(made: Made) -> None:
    model = fitted(made, CubicStiffness(), (0.6,))
    whole = found_for(model).at
    points = model.fit.likelihood.measurement.points
    assert points is not None
    sines = points.amplitude / np.where(points.angled, np.sqrt(2), 1.0)
    assert whole[0] <= np.min(sines)
    assert whole[-1] >= np.max(sines)
    harder = replace(
        model.fit.likelihood.measurement,
        sets=tuple(replace(each, peak_force=3 * each.peak_force) for each in model.fit.likelihood.measurement.sets),
    )
    simulation = model.fit.likelihood.simulation.of(harder)
    moved = found_for(Model(model.effects, evaluated(Likelihood(simulation), model.fit.scores))).at
    assert moved[-1] > 1.2 * whole[-1]


def test_the_band_of_frequency_is_that_of_both_rigs(made: Made) -> None:
    at = found_for(fitted(made, LossLawOfEach(), (0.5, 0.8))).at
    assert (at[0], at[-1]) == pytest.approx((20.0, 516.0))


def test_a_colder_beam_is_stiffer_than_the_tester(made: Made) -> None:
    found = found_for(fitted(made, TemperatureShift(), (-1.0,)))
    assert found.at[0] < 0.0 == found.at[-1]
    assert found.compression.stiffness.value[-1] < 1.0


def without_data(empty: Measurement, effect: Effect) -> Model:
    """A model of a measurement that means nothing, at the centre of its priors."""
    likelihood = Likelihood(simulation_of(empty.thinned(4), effect))
    return Model((effect,), evaluated(likelihood, np.zeros(likelihood.unknowns)))


def test_what_is_no_law_of_the_joints_has_none(empty: Measurement) -> None:
    assert law_found(without_data(empty, FrameCompliance()), 0, UNCALIBRATED) is None


def test_what_was_seen_at_one_place_is_no_curve(empty: Measurement) -> None:
    assert law_found(without_data(empty, TemperatureShift()), 0, UNCALIBRATED) is None, "no difference"
    assert law_found(without_data(replace(empty, points=None), ConditioningDrift()), 0, UNCALIBRATED) is None


@pytest.mark.parametrize("law", laws(), ids=lambda law: f"{law.id}, {law.law}")
def test_every_law_that_changes_cylinders_says_over_what(law: type[Effect]) -> None:
    joints = law.mechanism in (Mechanism.JOINT_AMPLITUDE, Mechanism.JOINT_FREQUENCY, Mechanism.JOINT_STATE)
    assert (law.law_over is not None) == (joints and acts_on(law, "cylinders"))


@pytest.mark.parametrize("law", [each for each in laws() if each.law_over is not None], ids=lambda law: law.law)
def test_every_law_of_the_joints_can_be_drawn(empty: Measurement, law: type[Effect]) -> None:
    few = empty.thinned(4)
    for variant in law.variants(few):
        likelihood = Likelihood(simulation_of(few, variant))
        scores = np.zeros(likelihood.unknowns)
        scores[len(likelihood.simulation.baseline.parameters) : len(likelihood.simulation.shared)] = 0.3
        found = found_for(Model((variant,), evaluated(likelihood, scores)))
        for axis in (found.shear, found.compression):
            assert axis.stiffness.value.shape == axis.loss_factor.value.shape == found.at.shape
            assert np.all(np.isfinite([axis.stiffness.low, axis.loss_factor.high, axis.loss_ratio.value]))


def test_a_law_beside_another_over_the_same_quantity_is_its_own(empty: Measurement) -> None:
    effects = LossLawOfEach(), FractionalZener(), JointsOverFrequency()
    likelihood = Likelihood(simulation_of(empty.thinned(4), *effects))
    scores = np.zeros(likelihood.unknowns)
    own = slice(len(likelihood.simulation.baseline.parameters), len(likelihood.simulation.shared))
    scores[own] = np.linspace(-0.5, 0.8, own.stop - own.start)
    found = law_found(Model(effects, evaluated(likelihood, scores)), 2, UNCALIBRATED)
    assert found is not None
    values = likelihood.simulation.values(scores[: own.stop].tolist())
    storage, _ = smooth(values.acting[2][1], found.at)
    np.testing.assert_allclose(found.compression.stiffness.value, storage / storage[0], rtol=1e-9)


def test_a_diagnosis_gives_the_law_of_its_verdict(made: Made) -> None:
    measurement = made((LossLawOfEach(),), (0.5, 0.8)).thinned(LINES)
    diagnosis = diagnose(measurement, without=frozenset(effect_ids()) - {"loss_law", "joint_mass"})
    assert diagnosis.effects == ("loss_law",)
    (found,) = [each for each in diagnosis.included if each.id == "loss_law"]
    assert found.law_found is not None
    assert found.law_found.over is LawOver.FREQUENCY
    assert found.law_found.compression.loss_ratio.low[-1] > 2.0, "a power of 0.48 over 4.7 octaves"


def weighed(model: Model, effect: str, probability: float) -> tuple[Weighed[Model], ...]:
    return Weighed((effect,), model, 0.0, probability), Weighed((), model, 0.0, 1 - probability)


def test_effects_of_the_verdict_and_likely_ones_have_their_law(empty: Measurement) -> None:
    model = without_data(empty, CubicStiffness())
    (likely,) = effects_found(weighed(model, "cubic_stiffness", 0.9), UNCALIBRATED)
    assert likely.law_found is not None
    assert likely.law_found.closest == ""
    (unlikely,) = effects_found(weighed(model, "cubic_stiffness", 0.1)[::-1], UNCALIBRATED)
    assert unlikely.law_found is None
    (other,) = effects_found(weighed(without_data(empty, FrameCompliance()), "frame_compliance", 0.9), UNCALIBRATED)
    assert other.law_found is None


def test_the_closest_known_law_is_the_one_that_bends(empty: Measurement) -> None:
    model = without_data(empty, BentDependence())
    (found,) = effects_found(weighed(model, "amplitude_dependence", 0.9), UNCALIBRATED)
    assert found.law_found is not None
    assert found.law_found.closest == "Kraus"


def test_the_closest_known_law_to_a_smooth_function_is_the_best_that_was_fitted(empty: Measurement) -> None:
    smooth_model, named = without_data(empty, JointsOverFrequency()), without_data(empty, LossLawOfEach())
    found, *_ = effects_found(weighed(smooth_model, "loss_law", 0.9), UNCALIBRATED, (smooth_model, named))
    assert found.law_found is not None
    assert found.law_found.closest == "powers of shear and compression"
    (alone,) = effects_found(weighed(smooth_model, "loss_law", 0.9), UNCALIBRATED, (smooth_model,))
    assert alone.law_found is not None
    assert alone.law_found.closest == ""
