"""Effects of amplitude on joints, by their laws: what each makes of the cylinders, in the tester and under blows."""

import numpy as np
import pytest
from scipy.stats import norm

from analysis.gap.bench import Cylinders
from analysis.gap.effect import Effect
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
from analysis.gap.measurement import Measurement
from tests.analysis.gap.conftest import at_centre
from tests.analysis.gap.effects.cylinders import CYLINDERS, LOSS, STORAGE, in_tester, ratios, struck


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


@pytest.mark.parametrize("law", [BentStiffness(), BentSliders()], ids=lambda each: each.law)
def test_where_nothing_turns_a_law_that_bends_says_nothing_of_rotation(law: Effect) -> None:
    still = Cylinders(STORAGE * [[[1.0]], [[1.0]], [[0.0]]], LOSS * [[[1.0]], [[1.0]], [[0.0]]])
    found = law.cylinders(at_centre(law), still, in_tester(np.array([1e-6, 5e-5])))
    assert np.all(found.storage[0, 2] == 0.0)
    assert np.all(found.loss[0, 2] == 0.0)
    assert np.all(np.isfinite(found.storage))


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
