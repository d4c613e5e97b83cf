"""Effects of the elastomer by their laws: what each makes of the cylinders, in the tester and under blows."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given as examples
from hypothesis import strategies as st
from scipy.stats import norm

from analysis.frequency_response import Real
from analysis.gap.bench import Cylinders, Loading
from analysis.gap.effect import Effect, Given
from analysis.gap.effects.joint_amplitude import (
    BEND,
    MIDDLE,
    AmplitudeDependence,
    BentSliders,
    BentStiffness,
    CoulombFriction,
    CubicStiffness,
    ManySliders,
    SaturatingStiffness,
    StickingFriction,
)
from analysis.gap.effects.joint_frequency import (
    REFERENCE,
    FewRelaxations,
    FractionalZener,
    FrequencyDependence,
    LossCurve,
    LossLaw,
    LossLawOfEach,
    PartViscous,
    SpringPot,
)
from analysis.gap.effects.joint_state import (
    DRIFT_KNOTS,
    MORE_SLOPE,
    MOST_EXPECTED,
    NOTICED,
    ConditioningDrift,
    DriftAlongCurve,
    LogarithmicDrift,
    PreloadStiffening,
    PreloadWithLoss,
    PreloadWithSomeLoss,
    SaturatingDrift,
    ShownTemperatureShift,
    TemperatureShift,
)
from analysis.gap.measurement import Measurement
from analysis.gap.simulation.blow_motion import blow_amplitudes_of
from tests.analysis.gap.conftest import at_centre

STORAGE = np.array([4e5, 2.4e6, 20.0])[None, :, None, None]
LOSS = 0.1 * STORAGE
DRIFTS = (ConditioningDrift(), SaturatingDrift(), LogarithmicDrift(), DriftAlongCurve())
CYLINDERS = Cylinders(STORAGE, LOSS)


def in_tester(
    amplitude: Real | float = 25e-6, frequency: Real | float = 50.0, fraction: Real | float = 0.0, angled: bool = False
) -> Loading:
    """In the tester; arguments broadcast."""
    x, f, done = (
        np.array(each, dtype=float) for each in np.broadcast_arrays(*np.atleast_1d(amplitude, frequency, fraction))
    )
    return Loading(True, f, x, None, done, np.full(x.size, angled))


def struck(motion: Real | None = None, frequency: Real | float = 50.0) -> Loading:
    """Under the beam; `motion` (2,) m in shear and in compression."""
    f = np.atleast_1d(np.asarray(frequency, dtype=float))
    amplitudes = (
        None if motion is None else blow_amplitudes_of(np.log(motion)[None], np.eye(1), np.zeros(1, dtype=np.intp))
    )
    return Loading(False, f, np.full(f.size, np.nan), amplitudes, np.zeros(f.size), np.zeros(f.size, bool))


def ratios(effect: Effect, given: Given, loading: Loading) -> tuple[Real, Real]:
    """(3, n) storage and loss over what they were: shear, compression, rotation."""
    found = effect.cylinders(given, CYLINDERS, loading)
    shape = np.broadcast_shapes(found.storage.shape, found.loss.shape, (1, 3, 1, loading.frequency.size))
    storage, loss = (np.broadcast_to(each, shape)[0, :, 0] for each in (found.storage, found.loss))
    return storage / STORAGE[0, :, 0], loss / LOSS[0, :, 0]


# --- amplitude ---


def test_kraus_falls_from_one_plateau_to_the_other_while_loss_peaks_between() -> None:
    effect = AmplitudeDependence()
    given = at_centre(effect, k0_over_kinf=2.0, xc=25e-6, m=0.6, loss_peak=0.8, loss_follows=0.0)
    storage, loss = ratios(effect, given, in_tester(np.geomspace(1e-12, 1.0, 200)))
    compression = storage[1]
    assert np.all(np.diff(compression) < 0)
    assert compression[0] / compression[-1] == pytest.approx(2.0, rel=1e-3)
    at_critical, most = ratios(effect, given, in_tester(25e-6))
    plateau = ratios(effect, given, in_tester(1e6))[1]
    assert most[1, 0] / plateau[1, 0] == pytest.approx(1.8, rel=1e-5)
    assert np.all(loss[1] <= most[1, 0])
    middle = (compression[0] + compression[-1]) / 2
    assert at_critical[1, 0] == pytest.approx(middle, rel=1e-3)


def test_loss_may_fall_as_stiffness_does_so_that_both_plateaus_have_one_loss_factor() -> None:
    effect = AmplitudeDependence()
    given = at_centre(effect, k0_over_kinf=2.0, loss_peak=0.5, loss_follows=1.0)
    storage, loss = ratios(effect, given, in_tester(np.array([1e-15, 25e-6, 1e6])))
    factor = loss[1] / storage[1]
    assert factor[0] == pytest.approx(factor[2], rel=1e-3)
    assert factor[1] > 1.2 * factor[0]


def test_kraus_keeps_the_baseline_at_the_middle_amplitude_in_the_tester() -> None:
    for effect in (AmplitudeDependence(), AmplitudeDependence(component=True)):
        storage, loss = ratios(effect, at_centre(effect, k0_over_kinf=2.7, xc=60e-6), in_tester(MIDDLE))
        assert np.allclose([storage, loss], 1.0, rtol=1e-12)


def test_shear_follows_amplitude_to_its_share() -> None:
    effect = AmplitudeDependence()
    given = at_centre(effect, k0_over_kinf=2.0, shear_share=0.5)
    ends, _ = ratios(effect, given, in_tester(np.array([1e-15, 1e6])))
    assert ends[0, 0] / ends[0, 1] == pytest.approx(1.5, rel=1e-3)
    assert ends[1, 0] / ends[1, 1] == pytest.approx(2.0, rel=1e-3)


def test_cylinders_at_45_degrees_feel_components_of_their_deformation() -> None:
    for component in (False, True):
        effect = AmplitudeDependence(component)
        angled, _ = ratios(effect, at_centre(effect), in_tester(50e-6, angled=True))
        straight, _ = ratios(effect, at_centre(effect), in_tester(50e-6 / (np.sqrt(2) if component else 1.0)))
        assert np.allclose(angled, straight, rtol=1e-12)


EACH_ITS_OWN = {"by_row": 1.0, "by_joint": 1.0, "fall": 0.0}
"""Every axis of every joint follows its own motion under each blow."""


def test_joints_that_move_more_are_softer_each_axis_by_its_own_motion() -> None:
    moving = np.array([4e-6, 12e-6])
    for component in (False, True):
        effect = AmplitudeDependence(component)
        given = at_centre(effect, shear_share=1.0, **EACH_ITS_OWN)
        gentle, hard = (ratios(effect, given, struck(share * moving))[0] for share in (1.0, 4.0))
        assert np.all(hard < gentle)
        assert bool(gentle[0, 0] > 1.01 * gentle[1, 0]) is component
        tested, _ = ratios(effect, given, in_tester(moving[1] if component else np.hypot(*moving)))
        assert gentle[1, 0] == pytest.approx(tested[1, 0])


def test_joints_may_move_less_at_high_frequencies() -> None:
    effect, moving = AmplitudeDependence(), struck(np.array([4e-6, 12e-6]), np.array([20.0, 500.0]))
    even, falling = (ratios(effect, at_centre(effect, fall=fall), moving)[0][1] for fall in (0.0, 1.0))
    assert even[0] == pytest.approx(even[1])
    assert falling[1] > falling[0]


def test_a_share_of_each_cylinder_sticks_below_its_own_amplitude_and_slides_far_above() -> None:
    alike = at_centre(ManySliders(), F_c=0.4, share=0.25, spread=0.01)
    storage, loss = ratios(ManySliders(), alike, in_tester(np.array([1e-8, 1.0])))
    np.testing.assert_allclose(storage[:2, 0], 1.25)
    np.testing.assert_allclose(storage[2], 1.0)
    np.testing.assert_allclose(storage[:2, 1], 1.0, atol=1e-3)
    slip = 0.4 / (0.25 * STORAGE[0, :2, 0, 0])
    at_slip = [ratios(ManySliders(), alike, in_tester(amplitude))[0] for amplitude in slip]
    assert at_slip[0][0, 0] == pytest.approx(1.25, abs=1e-3)
    assert at_slip[1][1, 0] == pytest.approx(1.25, abs=1e-3)
    assert loss[0, 1] > 1.0


@pytest.mark.parametrize("spread", [0.3, 0.8, 1.5])
def test_many_sliders_are_one_by_one_what_each_of_them_is(spread: float) -> None:
    amplitude, force, share = np.geomspace(1e-7, 1e-3, 25), 0.7, 0.25
    found = ManySliders().cylinders(
        at_centre(ManySliders(), F_c=force, share=share, spread=spread), CYLINDERS, in_tester(amplitude)
    )
    stick = share * STORAGE[0, 1, 0, 0]
    scatter = norm.ppf((np.arange(1000) + 0.5) / 1000)
    slips = force / stick * np.exp(spread * scatter - spread**2 / 2)
    one = StickingFriction()
    added = np.zeros((1, amplitude.size), dtype=complex)
    for slip in slips:
        alone = one.cylinders(at_centre(one, F_c=stick * slip / 1000, slip=slip), CYLINDERS, in_tester(amplitude))
        added += (alone.storage - STORAGE)[0, 1] + 1j * (alone.loss - LOSS)[0, 1]
    summed = (found.storage - STORAGE)[0, 1] + 1j * (found.loss - LOSS)[0, 1]
    np.testing.assert_allclose(summed, added, atol=0.005 * stick)


@pytest.mark.parametrize(
    "law",
    [AmplitudeDependence(component=True), SaturatingStiffness(), StickingFriction(), ManySliders()],
    ids=lambda each: each.law,
)
def test_a_law_deviates_by_a_share_of_its_own_change(law: Effect, empty: Measurement) -> None:
    deviating = law.bent(empty)
    assert deviating is not None
    assert (deviating.id, deviating.bent(empty)) == (law.id, None)
    given, loading = at_centre(deviating), in_tester(np.geomspace(1e-6, 1e-4, 7))
    exact, unbent = ratios(law, at_centre(law), loading), ratios(deviating, given, loading)
    np.testing.assert_allclose(unbent, exact, rtol=1e-12)
    more = at_centre(deviating, more_loss_in_shear=-0.5, **{f"more_storage_at_um_{knot:g}": 0.2 for knot in BEND.knots})
    storage, loss = ratios(deviating, more, loading)
    np.testing.assert_allclose(np.log(storage), 1.2 * np.log(exact[0]), atol=1e-12)
    np.testing.assert_allclose(np.log(loss), np.array([0.5, 1.0, 1.0])[:, None] * np.log(exact[1]), atol=1e-12)


@pytest.mark.parametrize("law", [TemperatureShift(), ShownTemperatureShift(5.0)], ids=lambda each: each.law)
def test_a_softening_may_bend_over_frequency_by_more_than_two_heights(
    law: TemperatureShift, empty: Measurement
) -> None:
    bent = law.bent(empty)
    assert bent is not None
    assert (bent.id, bent.bent(empty), bent.variants(empty)) == (law.id, None, ())
    loading = in_tester(frequency=np.array([8.0, 60.0, 500.0]))
    warmer, straight = at_centre(bent, delta_t=5.0), ratios(law, at_centre(law, delta_t=5.0), loading)
    np.testing.assert_allclose(ratios(bent, warmer, loading), straight, rtol=1e-12)
    more = {
        name: value + 0.2
        for name, value in warmer.items()
        if name in {f"more_slope_{knot:g}" for knot in MORE_SLOPE.knots}
    }
    changed = np.log(ratios(bent, {**warmer, **more}, loading)[0]) / np.log(straight[0])
    np.testing.assert_allclose(changed[0], [1.2, 1.0, 1.2])


@pytest.mark.parametrize("law", [BentStiffness(), BentSliders()], ids=lambda each: each.law)
def test_where_nothing_turns_a_law_that_bends_says_nothing_of_rotation(law: Effect) -> None:
    still = Cylinders(STORAGE * [[[1.0]], [[1.0]], [[0.0]]], LOSS * [[[1.0]], [[1.0]], [[0.0]]])
    found = law.cylinders(at_centre(law), still, in_tester(np.array([1e-6, 5e-5])))
    assert np.all(found.storage[0, 2] == 0.0)
    assert np.all(found.loss[0, 2] == 0.0)
    assert np.all(np.isfinite(found.storage))


def test_a_softening_that_goes_beyond_where_it_holds_stays_a_number() -> None:
    given = at_centre(BentStiffness(), beta=-4e8, x_s=1.0, more_storage_at_um_60=0.3)
    assert np.all(np.isfinite(ratios(BentStiffness(), given, in_tester(np.array([1e-6, 1e-3])))))


def test_cubic_stiffness_grows_with_the_square_and_loses_nothing() -> None:
    effect = CubicStiffness()
    storage, loss = ratios(effect, at_centre(effect, beta=1e8), in_tester(np.array([5e-6, 50e-6])))
    assert np.allclose(storage, 1 + 1e8 * np.square([5e-6, 50e-6]), rtol=1e-12)
    assert np.allclose(loss, 1.0)
    moving = struck(np.full(2, 2e-5))
    under_blows, _ = ratios(effect, at_centre(effect, beta=1e8, motion=2.0, **EACH_ITS_OWN), moving)
    assert np.allclose(under_blows[:2], 1 + 1e8 * (4e-5) ** 2)


def test_cubic_stiffness_may_level_off() -> None:
    amplitudes, beta, knee = np.array([1e-6, 60e-6, 1e-2]), 1e8, 60e-6
    given = at_centre(SaturatingStiffness(), beta=beta, x_s=knee)
    storage, loss = ratios(SaturatingStiffness(), given, in_tester(amplitudes))
    small, middle, large = storage[0] - 1
    assert small == pytest.approx(beta * amplitudes[0] ** 2, rel=1e-3)
    assert middle == pytest.approx(beta * knee**2 / 2)
    assert large == pytest.approx(beta * knee**2, rel=1e-4)
    assert np.all(loss == 1)


def test_friction_adds_its_loss_in_inverse_proportion_to_amplitude() -> None:
    effect = CoulombFriction()
    amplitude = np.array([5e-6, 10e-6, 50e-6])
    found = effect.cylinders(at_centre(effect, F_c=1.0), CYLINDERS, in_tester(amplitude))
    added = found.loss - LOSS
    assert np.allclose(added[0, :2], 4 * 1.0 / (np.pi * amplitude), rtol=1e-9)
    assert np.allclose(added[0, 2], 0.0)
    assert np.array_equal(found.storage, STORAGE)


def test_a_sticking_slider_is_a_spring_when_small_and_rubs_when_large() -> None:
    effect = StickingFriction()
    given = at_centre(effect, F_c=1.0, slip=1e-6)
    small = effect.cylinders(given, CYLINDERS, in_tester(1e-9))
    assert np.allclose((small.storage - STORAGE)[0, :2, 0], 1.0 / 1e-6)
    assert np.allclose(small.loss[0, :, 0], LOSS[0, :, 0])
    large = effect.cylinders(given, CYLINDERS, in_tester(1e-2))
    assert np.allclose(large.storage[0, :, 0], STORAGE[0, :, 0], rtol=1e-3)
    assert np.allclose((large.loss - LOSS)[0, :2, 0], 4 / (np.pi * 1e-2), rtol=1e-2)


# --- frequency ---

FREQUENCIES = np.geomspace(1.0, 2000.0, 60)
CAUSAL = (FrequencyDependence(), FewRelaxations(), FractionalZener(), SpringPot())


@pytest.mark.parametrize("effect", CAUSAL, ids=lambda each: each.law)
@examples(scores=st.lists(st.floats(-1.0, 1.0), min_size=7, max_size=7))
def test_stiffness_rises_with_frequency_and_loses(effect: FrequencyDependence, scores: list[float]) -> None:
    """What relaxes is stiffer when fast, and takes energy out at every frequency (Kramers, Kronig)."""
    given = {
        parameter.name: abs(parameter.value(score)) if parameter.name == "g" else parameter.value(score)
        for parameter, score in zip(effect.parameters, scores, strict=False)
    }
    if "ratio" in given:
        given["ratio"] = max(given["ratio"], 1.01)
    elastic = Cylinders(STORAGE, np.zeros_like(STORAGE))
    found = effect.cylinders(given, elastic, in_tester(frequency=FREQUENCIES))
    assert np.all(np.diff(found.storage, axis=-1) >= 0)
    assert np.all(found.loss >= 0)


@pytest.mark.parametrize("effect", CAUSAL, ids=lambda each: each.law)
def test_loss_is_the_slope_of_stiffness_over_the_logarithm_of_frequency(effect: FrequencyDependence) -> None:
    """Kramers' and Kronig's relation, local for smooth laws: k'' = (pi / 2) dk' / d log w, roughly."""
    given = at_centre(effect, g=0.2) if isinstance(effect, SpringPot) else at_centre(effect)
    elastic = Cylinders(STORAGE, np.zeros_like(STORAGE))
    found = effect.cylinders(given, elastic, in_tester(frequency=np.geomspace(20.0, 400.0, 80)))
    slope = np.gradient(found.storage[0, 1, 0], np.log(np.geomspace(20.0, 400.0, 80)))
    assert np.allclose(found.loss[0, 1, 0], np.pi / 2 * slope, rtol=0.25)


@pytest.mark.parametrize("effect", CAUSAL, ids=lambda each: each.law)
def test_stiffness_keeps_the_baseline_at_the_reference(effect: FrequencyDependence) -> None:
    elastic = Cylinders(STORAGE, np.zeros_like(STORAGE))
    found = effect.cylinders(at_centre(effect), elastic, in_tester(frequency=REFERENCE))
    assert np.allclose(found.storage, STORAGE)


def test_frequency_acts_in_both_rigs_alike() -> None:
    for effect in CAUSAL:
        direct, inverse = (
            ratios(effect, at_centre(effect), at) for at in (in_tester(frequency=180.0), struck(frequency=180.0))
        )
        assert np.array_equal(direct, inverse)


def test_a_loss_law_changes_the_imaginary_part_alone() -> None:
    frequency = np.array([25.0, 100.0, 400.0])
    cases: tuple[tuple[Effect, Given, list[list[float]]], ...] = (
        (LossLaw(), {"p": 0.5}, [[0.5, 1, 2]] * 3),
        (LossLaw(), {"p": 1.0}, [[0.25, 1, 4]] * 3),
        (LossLawOfEach(), {"p_shear": 0.5, "p_compression": -0.5}, [[0.5, 1, 2], [2, 1, 0.5], [2, 1, 0.5]]),
        (PartViscous(), {"q_shear": 0.4, "q_compression": 0.0}, [[0.7, 1, 2.2], [1, 1, 1], [1, 1, 1]]),
    )
    for effect, given, expected in cases:
        storage, loss = ratios(effect, given, in_tester(frequency=frequency))
        assert np.allclose(storage, 1.0)
        assert np.allclose(loss, expected, rtol=1e-12), effect.law


def test_loss_may_follow_a_smooth_curve_of_each_way_of_loading() -> None:
    effect, frequency = LossCurve(), np.array([30.0, 100.0, 300.0])
    given = at_centre(effect, p_compression=0.5, shear_300=0.4, compression_30=-0.2)
    storage, loss = ratios(effect, given, in_tester(frequency=frequency))
    assert np.allclose(storage, 1.0)
    assert loss[0] == pytest.approx([1.0, 1.0, np.exp(0.4)])
    assert loss[1] == pytest.approx([np.sqrt(0.3) * np.exp(-0.2), 1.0, np.sqrt(3.0)])


# --- between the rigs, and in the order of measuring ---


def test_temperature_shows_in_the_tester_alone_and_takes_loss_along() -> None:
    effect = TemperatureShift()
    given = at_centre(effect, delta_t=5.0, loss_ratio=2.0, softening=0.006)
    assert np.allclose(ratios(effect, given, struck()), 1.0)
    storage, loss = ratios(effect, given, in_tester())
    assert np.allclose(storage, np.exp(5 * 0.006))
    assert np.allclose(loss, storage**2)


def test_thermometers_that_differ_say_by_how_much(empty: Measurement) -> None:
    assert ShownTemperatureShift.variants(empty) == ()
    assert empty.points is not None
    colder = replace(empty.points, temperature=empty.points.temperature - 4.0)
    (effect,) = ShownTemperatureShift.variants(replace(empty, points=colder))
    (difference, *_) = effect.parameters
    assert (difference.centre, difference.spread) == pytest.approx((4.0, 1.0))


@examples(st.floats(0.0, 12.0), st.floats(0.0, 12.0))
def test_the_more_thermometers_differ_either_way_the_surer_is_a_difference_that_shows(one: float, other: float) -> None:
    smaller, larger = (ShownTemperatureShift(each).expected for each in sorted((one, other)))
    assert smaller <= larger <= MOST_EXPECTED
    assert ShownTemperatureShift(-one).expected == pytest.approx(ShownTemperatureShift(one).expected)


def test_thermometers_that_differ_by_what_shows_leave_it_open_and_no_thermometer_says_nothing() -> None:
    assert ShownTemperatureShift(NOTICED).expected == pytest.approx(0.5, abs=1e-4)
    assert TemperatureShift().expected == 0.0


def test_a_rubber_softens_otherwise_at_another_frequency() -> None:
    effect, frequency = TemperatureShift(), np.array([15.0, 60.0, 200.0])
    given = at_centre(effect, delta_t=10.0, softening=0.01, loss_ratio=2.0, slope_200=0.5)
    storage, loss = ratios(effect, given, in_tester(frequency=frequency))
    assert np.log(storage[1]) == pytest.approx([0.1, 0.1, 0.15])
    assert np.allclose(np.log(loss), 2 * np.log(storage))


def test_preload_stiffens_in_the_tester_alone(empty: Measurement) -> None:
    for law, on_loss in ((PreloadStiffening, 1.0), (PreloadWithLoss, 1.25), (PreloadWithSomeLoss, 1.1)):
        (effect,) = law.variants(empty)
        assert effect.preset_mm == pytest.approx(0.5)
        given = {"s": 0.5, "loss_share": 0.4}
        storage, loss = ratios(effect, given, in_tester())
        assert np.allclose(storage, 1.25)
        assert np.allclose(loss, on_loss)
        assert np.allclose(ratios(effect, given, struck()), 1.0)


@pytest.mark.parametrize("effect", DRIFTS, ids=lambda e: e.law)
def test_drift_follows_the_order_of_measuring_and_not_frequency(effect: ConditioningDrift) -> None:
    done = np.linspace(0.0, 1.0, 9)
    given = at_centre(effect, d=0.08, under_beam=0.0)
    storage, loss = ratios(effect, given, in_tester(frequency=np.linspace(200.0, 5.0, 9), fraction=done))
    assert storage[:, 0] == pytest.approx(1.0)
    assert storage[:, -1] == pytest.approx(0.92)
    assert np.all(np.diff(storage, axis=1) < 0)
    assert np.allclose(storage, loss)
    again, _ = ratios(effect, given, in_tester(frequency=50.0, fraction=done))
    assert np.array_equal(storage, again)
    assert np.allclose(ratios(effect, given, struck()), 1.0)
    after, _ = ratios(effect, {**given, "under_beam": 1.0}, in_tester(fraction=done))
    assert np.allclose(after, storage / 0.92)  # the beam had the specimens when they had softened


@examples(steps=st.tuples(*[st.floats(-3.0, 3.0)] * len(DRIFT_KNOTS[1:])))
def test_a_drift_along_any_curve_rises_from_nothing_to_all_of_it(steps: tuple[float, ...]) -> None:
    law = DriftAlongCurve()
    rates = {f"faster_to_{share:g}": step for share, step in zip(DRIFT_KNOTS[1:], steps, strict=True)}
    given = {**at_centre(law, d=0.1, under_beam=0.0), **rates}
    storage, _ = ratios(law, given, in_tester(fraction=np.linspace(0.0, 1.0, 30)))
    assert storage[:, 0] == pytest.approx(1.0)
    assert storage[:, -1] == pytest.approx(0.9)
    assert np.all(np.diff(storage, axis=1) <= 0)


def test_a_drift_along_a_curve_is_straight_at_its_centre_and_comes_early_where_the_rate_falls() -> None:
    even = at_centre(DriftAlongCurve(), d=0.1, under_beam=0.0)
    falling = {**even, "faster_to_0.12": -2.0}
    straight, curved = (ratios(DriftAlongCurve(), each, in_tester(fraction=0.5))[0][0, 0] for each in (even, falling))
    assert straight == pytest.approx(0.95)
    assert curved < 0.945


def test_rival_drifts_come_early_and_the_straight_one_evenly() -> None:
    half = {
        law: ratios(law(), at_centre(law(), d=0.1, under_beam=0.0), in_tester(fraction=0.5))[0][0, 0]
        for law in (ConditioningDrift, SaturatingDrift, LogarithmicDrift)
    }
    assert half[ConditioningDrift] == pytest.approx(0.95)
    assert half[LogarithmicDrift] < half[SaturatingDrift] < half[ConditioningDrift]


def test_shear_drifts_to_its_share() -> None:
    given = at_centre(ConditioningDrift(), d=0.1, under_beam=0.0, shear_share=0.5)
    storage, _ = ratios(ConditioningDrift(), given, in_tester(fraction=1.0))
    assert storage[:, 0] == pytest.approx([0.95, 0.9, 0.9])


def test_a_drift_that_comes_to_rest_is_over_after_a_few_knees() -> None:
    early, late = (
        ratios(
            SaturatingDrift(), at_centre(SaturatingDrift(), d=0.1, knee=knee, under_beam=0.0), in_tester(fraction=0.3)
        )[0][0, 0]
        for knee in (0.05, 100.0)
    )
    assert early == pytest.approx(0.9, rel=1e-3)
    assert late == pytest.approx(0.97, rel=1e-3)
