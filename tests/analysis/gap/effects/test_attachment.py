"""Foundations of more than one mode."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.frequency_response import Complex
from analysis.gap.bench import Cylinders, Mounting, joint_matrices
from analysis.gap.effects.attachment import (
    FoundationBothWays,
    FoundationCompliance,
    FoundationOfTwoModes,
    JointMass,
    MassOfEachJoint,
    TurningMass,
)
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.verdict import leading, weigh
from analysis.gap.search.forward_selection import selected
from tests.analysis.gap.conftest import Made, at_centre, search_among

POLE: Complex = np.asarray(2j * np.pi * np.linspace(20.0, 800.0, 60), dtype=np.complex128)
ONE, TWO = FoundationCompliance(1), FoundationOfTwoModes(1)


def test_the_compliance_of_a_foundation_is_the_sum_of_its_modes() -> None:
    given = at_centre(TWO, second_over_first=0.5, f_second=90.0, eta_second=0.2)
    second = at_centre(ONE, k_f=given["k_f"] / 0.5, f=90.0, eta=0.2)
    compliance = 1 / ONE.foundation(given, POLE) + 1 / ONE.foundation(second, POLE)
    np.testing.assert_allclose(TWO.foundation(given, POLE), 1 / compliance)


def test_a_second_mode_that_gives_nothing_way_leaves_the_first() -> None:
    given = at_centre(TWO, second_over_first=1e-12)
    np.testing.assert_allclose(TWO.foundation(given, POLE), ONE.foundation(given, POLE), rtol=1e-9)


def test_a_foundation_on_a_foundation_is_named_alone(made: Made) -> None:
    """With one mode alone, masses and losses would take up the rest."""
    search = search_among(
        made((TWO,), (-0.5, 0.0, 0.0, 0.9, 0.5, 0.0)), {"foundation_compliance", "joint_mass", "loss_law"}
    )
    none = search.fit_paper_model()
    verdict = leading(weigh(none, selected(search, none, UNCALIBRATED), UNCALIBRATED))
    assert (verdict.effects, verdict.laws) == ((ONE.id,), (TWO.law,))
    assert verdict.model.fit.value("f_second") == pytest.approx(200.0 * np.exp(0.9), rel=0.03)


def test_joint_mass_adds_inertia_to_both_translations(cylinders: Cylinders, mounting: Mounting) -> None:
    pole = 2j * np.pi * np.array([50.0, 400.0])
    joints = joint_matrices(cylinders, mounting)
    added = JointMass().joints({"m": 0.2}, joints, pole) - joints
    expected = np.zeros((1, 2, 2, 3, 3))
    expected[..., 0, 0] = expected[..., 1, 1] = (pole**2 * 0.2).real[:, None]
    assert np.allclose(added, expected, rtol=1e-9, atol=1e-6)


def test_a_mass_that_turns_has_its_inertia_about_the_joint(cylinders: Cylinders, mounting: Mounting) -> None:
    pole = 2j * np.pi * np.array([400.0])
    joints = joint_matrices(cylinders, mounting)
    added = TurningMass().joints({"m": 0.2, "gyration_squared": 1e-4}, joints, pole) - joints
    assert np.allclose(added[0, 0, 1], np.diag([0.2, 0.2, 2e-5]) * pole[0] ** 2, atol=1e-9)


def test_mass_of_each_joint_stays_at_its_joint(cylinders: Cylinders, mounting: Mounting) -> None:
    pole = 2j * np.pi * np.array([400.0])
    joints = joint_matrices(cylinders, mounting)
    effect = MassOfEachJoint(("I", "II"))
    added = effect.joints(at_centre(effect, m_II=0.1), joints, pole) - joints
    assert np.allclose(added[0, 0, 0], 0.0)
    assert added[0, 0, 1, 1, 1] == pytest.approx((pole[0] ** 2).real * 0.1)


def test_a_mass_aside_of_its_joint_moves_with_the_turning_beam(cylinders: Cylinders, mounting: Mounting) -> None:
    pole = 2j * np.pi * np.array([400.0])
    joints = joint_matrices(cylinders, mounting)
    effect, aside = MassOfEachJoint(("I", "II")), 0.008
    added = effect.joints(at_centre(effect, m_II=0.1, aside_II=aside, along=0.8), joints, pole) - joints
    motion = np.array([0.3, 1.0, 5.0])  # along, across, turning
    centre = motion[1] + aside * motion[2]
    force = added[0, 0, 1] @ motion
    assert np.allclose(force, 0.1 * pole[0] ** 2 * np.array([0.8 * 0.3, centre, aside * centre]))
    assert np.allclose(added[0, 0, 0], 0.0)


def test_a_foundation_is_in_series_across_the_beam(cylinders: Cylinders, mounting: Mounting) -> None:
    given = {"f": 200.0, "k_f": 1.5e7, "eta": 0.05}
    pole = 2j * np.pi * np.array([10.0, 200.0, 900.0])
    straight = replace(mounting, eccentricity=np.zeros_like(mounting.eccentricity))
    joints = joint_matrices(cylinders, straight)
    found = FoundationCompliance(joint=1).joints(given, joints, pole)
    foundation = 1.5e7 * (1 + 0.05j) + pole**2 * 1.5e7 / (2 * np.pi * 200.0) ** 2
    # seen with x and rotation held, the joint is in series with its foundation
    held = 1 / (1 / joints[0, 0, 1, 1, 1] + 1 / foundation)
    assert np.allclose(found[0, :, 1, 1, 1], held, rtol=1e-9)
    assert np.allclose(found[0, :, 0], joints[0, 0, 0])
    assert np.allclose(found, np.swapaxes(found, 3, 4))
    # at its resonance it gives way by its loss alone
    assert foundation[1] == pytest.approx(1.5e7 * 0.05j, rel=1e-9)


def test_a_stiff_light_foundation_changes_nothing(cylinders: Cylinders, mounting: Mounting) -> None:
    joints = joint_matrices(cylinders, mounting)
    pole = 2j * np.pi * np.array([10.0, 500.0])
    for law in (FoundationCompliance(0), FoundationBothWays(0)):
        found = law.joints({"f": 1e6, "k_f": 1e16, "eta": 0.05}, joints, pole)
        assert np.allclose(found, joints, rtol=1e-6, atol=1e-6 * np.max(np.abs(joints)))


def test_a_foundation_both_ways_gives_way_along_the_beam_too(cylinders: Cylinders, mounting: Mounting) -> None:
    straight = replace(mounting, eccentricity=np.zeros_like(mounting.eccentricity))
    joints, pole = joint_matrices(cylinders, straight), np.array([2j * np.pi * 10.0])
    given = {"f": 1e5, "k_f": 1e7, "eta": 0.0}
    own = np.linalg.inv(FoundationBothWays(0).joints(given, joints, pole)[0, 0, 0, :2, :2])
    alone = np.linalg.inv(joints[0, 0, 0, :2, :2])
    assert np.allclose(own - alone, np.eye(2) / 1e7, rtol=1e-6, atol=1e-15)
