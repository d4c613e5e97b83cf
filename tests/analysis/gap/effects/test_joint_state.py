"""Effects of temperature, preload and order of measuring, by their laws: what each makes of the cylinders."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given as examples
from hypothesis import strategies as st

from analysis.gap.effects.joint_amplitude import (
    BentStiffness,
)
from analysis.gap.effects.joint_state import (
    DRIFT_KNOTS,
    MORE_SLOPE,
    MOST_EXPECTED,
    NOTICED,
    ConditioningDrift,
    DriftAlongCurve,
    LogarithmicDrift,
    PreloadOfEachConfiguration,
    PreloadStiffening,
    PreloadWithLoss,
    PreloadWithSomeLoss,
    SaturatingDrift,
    ShownTemperatureShift,
    TemperatureShift,
)
from analysis.gap.measurement import Measurement
from tests.analysis.gap.conftest import at_centre
from tests.analysis.gap.effects.cylinders import in_tester, ratios, struck

DRIFTS = (ConditioningDrift(), SaturatingDrift(), LogarithmicDrift(), DriftAlongCurve())


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


def test_a_preload_may_stiffen_shear_less_than_compression_also_at_45_degrees(empty: Measurement) -> None:
    (effect,) = PreloadOfEachConfiguration.variants(empty)
    given = at_centre(effect, s=0.5, share_shear=0.6, share_angled=1.2, shear_when_angled=0.5, loss_share=0.0)
    straight, loss = ratios(effect, given, in_tester())
    angled, _ = ratios(effect, given, in_tester(angled=True))
    assert straight[:, 0] == pytest.approx([1.15, 1.25, 1.25])
    assert angled[:, 0] == pytest.approx([1.15, 1.3, 1.3])
    assert np.allclose(loss, 1.0)
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


def test_a_softening_that_goes_beyond_where_it_holds_stays_a_number() -> None:
    given = at_centre(BentStiffness(), beta=-4e8, x_s=1.0, more_storage_at_um_60=0.3)
    assert np.all(np.isfinite(ratios(BentStiffness(), given, in_tester(np.array([1e-6, 1e-3])))))
