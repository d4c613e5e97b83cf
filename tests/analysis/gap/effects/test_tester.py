"""Effects of the tester by their laws: what each makes of the stiffness that it reads."""

import numpy as np
import pytest

from analysis.gap.effects.tester import (
    OVER_SWEEP,
    ComplianceOfEachFixture,
    DampedResonance,
    FilteredDisplacement,
    FixtureInertia,
    FrameCompliance,
    FrameResonance,
    InertiaOfEachFixture,
    LossyFrame,
    TransducerLag,
    VaryingLag,
)
from analysis.gap.measurement import Configuration, TesterPoints


def test_frame_compliance_is_in_series(points: TesterPoints) -> None:
    found = FrameCompliance().tester({"c": 2e-7}, points.stiffness, points)
    assert np.allclose(1 / found, 1 / points.stiffness + 2e-7, rtol=1e-12)
    lost_share = 1 - np.abs(found / points.stiffness)
    compressed, sheared = (points.configuration == each for each in (Configuration.COMPRESSION, Configuration.SHEAR))
    assert np.min(lost_share[compressed]) > np.max(lost_share[sheared])


def test_a_frame_with_loss_dissipates_in_series(points: TesterPoints) -> None:
    elastic = FrameCompliance().tester({"c": 2e-7}, points.stiffness, points)
    lossy = LossyFrame().tester({"c": 2e-7, "loss": 0.04}, points.stiffness, points)
    assert np.allclose(1 / lossy - 1 / elastic, -0.04j * 2e-7, rtol=1e-6, atol=1e-18)
    assert np.allclose(LossyFrame().tester({"c": 2e-7, "loss": 0.0}, points.stiffness, points), elastic, rtol=1e-12)


def test_fixture_inertia_takes_the_same_from_every_configuration(points: TesterPoints) -> None:
    found = FixtureInertia().tester({"m": 0.1}, points.stiffness, points)
    assert np.allclose(points.stiffness - found, 0.1 * (2 * np.pi * points.frequency) ** 2, rtol=1e-6)


def test_a_fixture_for_each_configuration_takes_its_share(points: TesterPoints) -> None:
    effect, inertia = InertiaOfEachFixture(), (2 * np.pi * points.frequency) ** 2
    given = {"m": 0.1, "share_compression": 1.0, "share_shear": 0.9, "share_angled": 1.2}
    taken = (points.stiffness - effect.tester(given, points.stiffness, points)) / inertia
    for configuration, mass in zip(Configuration, (0.1, 0.09, 0.12), strict=True):
        assert taken[points.configuration == configuration] == pytest.approx(mass)


def test_each_fixture_gives_way_in_its_own_measure(points: TesterPoints) -> None:
    given = {"c": 2e-7, "loss": 0.04, "share_compression": 1.0, "share_shear": 0.9, "share_angled": 1.2}
    found = ComplianceOfEachFixture().tester(given, points.stiffness, points)
    compliance = 1 / found - 1 / points.stiffness
    for configuration, share in zip(Configuration, (1.0, 0.9, 1.2), strict=True):
        expected = share * 2e-7 * (1 - 0.04j)
        assert np.allclose(compliance[points.configuration == configuration], expected, rtol=1e-6)


def test_a_lag_that_changes_is_a_delay_of_its_own_at_each_frequency(points: TesterPoints) -> None:
    even = TransducerLag().tester({"tau": 1e-4}, points.stiffness, points)
    more = {f"more_{knot:g}": 0.1 for knot in OVER_SWEEP.knots}
    varying = VaryingLag().tester({"tau": 1e-4} | more, points.stiffness, points)
    np.testing.assert_allclose(np.angle(varying / points.stiffness), 1.1 * np.angle(even / points.stiffness), rtol=1e-9)


def test_frame_resonance_magnifies_every_configuration_by_one_ratio(points: TesterPoints) -> None:
    found = FrameResonance().tester({"f_r": 360.0}, points.stiffness, points)
    ratio = found / points.stiffness
    assert np.allclose(ratio[points.frequency == 180.0], 4 / 3, rtol=1e-12)
    assert np.allclose(ratio.imag, 0.0, atol=1e-12)


def test_a_damped_resonance_without_loss_is_the_plain_one_and_its_loss_softens_the_phase(points: TesterPoints) -> None:
    plain = FrameResonance().tester({"f_r": 360.0}, points.stiffness, points)
    lossless = {"f_r": 360.0, "zeta": 0.0, "share": 1.0, "second_over_first": 2.5}
    assert np.allclose(DampedResonance().tester(lossless, points.stiffness, points), plain, rtol=1e-12)
    damped = {"f_r": 360.0, "zeta": 0.05, "share": 0.5, "second_over_first": 2.0}
    ratio = DampedResonance().tester(damped, points.stiffness, points) / points.stiffness
    at = points.frequency == 180.0
    assert np.allclose(ratio[at], 0.5 / (0.75 + 0.05j) + 0.5 / (0.9375 + 0.025j), rtol=1e-12)
    assert np.all(ratio.imag < 0.0)


def test_transducer_lag_turns_the_phase_in_proportion_to_frequency(points: TesterPoints) -> None:
    found = TransducerLag().tester({"tau": 1e-4}, points.stiffness, points)
    assert np.allclose(np.angle(found / points.stiffness), 2 * np.pi * points.frequency * 1e-4, rtol=1e-9)
    assert np.allclose(np.abs(found), np.abs(points.stiffness), rtol=1e-12)


def test_a_filter_of_displacement_lags_as_a_delay_at_low_frequency_and_reads_too_stiff_above(
    points: TesterPoints,
) -> None:
    filtered, delayed = (
        effect.tester({"tau": 1e-4}, points.stiffness, points) / points.stiffness
        for effect in (FilteredDisplacement(), TransducerLag())
    )
    low = points.frequency == np.min(points.frequency)
    assert np.angle(filtered[low]) == pytest.approx(np.angle(delayed[low]), rel=1e-3)
    assert np.abs(filtered) == pytest.approx(np.hypot(1, 2e-4 * np.pi * points.frequency))
