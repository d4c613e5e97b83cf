"""Effects of the geometry of joints by their laws, in numbers."""

import numpy as np
import pytest

from analysis.gap.bench import Cylinders, Mounting, joint_matrices
from analysis.gap.effects.joint_geometry import (
    ContactPatch,
    CylinderAngle,
    SplayedCylinders,
    SupportPosition,
    VerticalOffset,
)
from analysis.gap.measurement import Configuration, Measurement
from analysis.gap.simulation.baseline import Baseline
from tests.analysis.gap.conftest import at_centre
from tests.analysis.gap.effects.conftest import COMPRESSION, SHEAR


def test_a_contact_patch_turns_with_a_twelfth_of_its_length_squared(cylinders: Cylinders, mounting: Mounting) -> None:
    spread = ContactPatch().mounting({"length": 0.03}, mounting)
    joints = joint_matrices(cylinders, mounting)
    added = joint_matrices(cylinders, spread) - joints
    assert np.allclose(added[..., 2, 2], joints[..., 1, 1] * 0.03**2 / 12, rtol=1e-9)
    added[..., 2, 2] = 0
    assert np.allclose(added, 0.0)


def test_a_steeper_cylinder_splits_k11_from_k22_and_shows_in_angled_pairs(
    empty: Measurement, baseline: Baseline, cylinders: Cylinders, mounting: Mounting
) -> None:
    delta, given = np.radians(2.0), at_centre(baseline)
    for effect in CylinderAngle.variants(empty):
        leaning = effect.mounting({"delta_deg": 2.0}, mounting)
        k = joint_matrices(cylinders, leaning)[0, 0, effect.joint]
        split = 2 * (COMPRESSION - SHEAR) * np.sin(2 * delta)
        assert k[1, 1] - k[0, 0] == pytest.approx(split, rel=1e-9)
        assert k[1, 1] + k[0, 0] == pytest.approx(2 * (SHEAR + COMPRESSION), rel=1e-9)
        angled = effect.joint, Configuration.ANGLED
        for mounted, share in ((leaning, np.sin(2 * delta)), (mounting, 0.0)):
            seen = baseline.weights(given, mounted)[angled] @ [SHEAR, COMPRESSION]
            assert seen == pytest.approx(SHEAR + COMPRESSION + share * (COMPRESSION - SHEAR), rel=1e-9)
        moved = baseline.weights(given, leaning) != baseline.weights(given, mounting)
        assert np.argwhere(moved.any(axis=2)).tolist() == [list(angled)]
    # for small angles that is the catalogue's a + b + 2 delta (b - a)
    assert np.sin(2 * delta) == pytest.approx(2 * delta, rel=1e-3)


def test_cylinders_that_lean_apart_lean_by_delta_in_the_mean(empty: Measurement, mounting: Mounting) -> None:
    for effect in SplayedCylinders.variants(empty):
        alike = CylinderAngle.mounting(effect, {"delta_deg": 2.0}, mounting).inclination
        apart = effect.mounting({"delta_deg": 2.0, "splay_deg": 1.0}, mounting).inclination
        assert np.allclose(apart.mean(axis=1), alike.mean(axis=1))
        lower, upper = np.degrees(np.abs(apart - mounting.inclination))[effect.joint]
        assert (lower, upper) == pytest.approx((1.5, 2.5))
        assert np.array_equal(np.delete(apart, effect.joint, axis=0), np.delete(alike, effect.joint, axis=0))


def test_a_vertical_offset_couples_translation_and_rotation(
    empty: Measurement, cylinders: Cylinders, mounting: Mounting
) -> None:
    (effect,) = VerticalOffset.variants(empty)
    centred = joint_matrices(cylinders, mounting)
    assert np.allclose(centred[..., 0, 2], 0.0, atol=1e-9 * abs(COMPRESSION))
    shifted = joint_matrices(cylinders, effect.mounting({"shift_I": 3e-3, "shift_II": 0.0}, mounting))
    assert shifted[0, 0, 0, 0, 2] == pytest.approx(-3e-3 * centred[0, 0, 0, 0, 0], rel=1e-9)
    assert np.allclose(shifted[0, 0, 1], centred[0, 0, 1])


def test_a_support_moves_along_the_beam_alone(empty: Measurement, mounting: Mounting) -> None:
    (effect,) = SupportPosition.variants(empty)
    moved = effect.mounting({"dx_I": 4e-3, "dx_II": -2e-3}, mounting)
    assert moved.position - mounting.position == pytest.approx([4e-3, -2e-3])
    assert moved.inclination is mounting.inclination
    assert moved.eccentricity is mounting.eccentricity
