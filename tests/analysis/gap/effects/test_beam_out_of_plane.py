"""Bending out of plane by its laws, in numbers."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Direction, Dof
from analysis.frequency_response import Complex
from analysis.gap.bench import Mounting, Setting
from analysis.gap.effects.beam_out_of_plane import (
    BendingByRow,
    LeanOfEachPoint,
    OnEdgeOnJoints,
    OutOfPlaneBending,
)
from analysis.gap.measurement import Measurement
from analysis.gap.simulation.baseline import Baseline
from analysis.gap.simulation.free_beam_modes import BeamModes
from tests.analysis.gap.conftest import at_centre
from tests.analysis.gap.effects.readings import read


def test_a_row_of_its_own_shows_bending_out_of_plane_that_the_others_do_not(
    empty: Measurement, modes: BeamModes
) -> None:
    effect, _ = BendingByRow.variants(empty)
    row = empty.sets[0].inputs.index(Dof(11, Direction.Y))
    change = read(effect, empty, modes, row_11y_1=0.05) - read(effect, empty, modes)
    assert np.all(np.delete(change, row, axis=0) == 0)
    peak = empty.sets[0].frequency[np.argmax(np.abs(change[row]))]
    assert peak == pytest.approx(effect.parameters[2].centre, abs=4)


def test_bending_out_of_plane_has_the_modes_of_the_beam_on_edge(empty: Measurement, modes: BeamModes) -> None:
    (effect,) = OutOfPlaneBending.variants(empty)
    assert effect.frequencies == pytest.approx((321.0, 867.0), rel=0.02)
    flat, bent = (read(effect, empty, modes, coupling=coupling) for coupling in (0.0, 0.05))
    added = np.abs(bent - flat)
    along = [dof.direction for dof in empty.sets[0].inputs].index(Direction.X)
    peak = empty.sets[0].frequency[np.argmax(added[along])]
    assert peak == pytest.approx(effect.parameters[2].centre, abs=5.0)
    assert np.allclose(bent, flat + 0.5 * (read(effect, empty, modes, coupling=0.1) - flat), rtol=1e-9)


def test_the_whole_beam_on_edge_bounces_on_soft_joints_and_does_not_move_at_stiff_ones(
    baseline: Baseline, setting: Setting, mounting: Mounting, empty: Measurement
) -> None:
    (effect,) = OnEdgeOnJoints.variants(empty)
    at_joint = Dof(empty.drawing.joints[0].node, Direction.Y)
    struck = replace(setting, inputs=(at_joint, Dof(6, Direction.Y)), frequency=np.linspace(1.0, 200.0, 2000))

    def added(**own: float) -> Complex:
        bench = baseline.beam(at_centre(baseline), struck, mounting)
        return effect.beam(at_centre(effect, coupling=0.05, leak=0.1, **own), bench, struck).added

    softness = 0.01
    mass = empty.drawing.beam.density * empty.drawing.beam.area * empty.drawing.beam.length
    bounce = np.sqrt(softness * sum(effect.shear) / mass) / (2 * np.pi)
    peak = struck.frequency[np.argmax(np.abs(added(shear=softness, gamma=0.01)[1]))]
    assert peak == pytest.approx(bounce, rel=0.02)
    held = np.abs(added(shear=1e6, gamma=0.01))
    assert np.max(held[0]) < 1e-4 * np.max(held[1])


@pytest.mark.parametrize("law", [LeanOfEachPoint, BendingByRow])
def test_blows_at_both_ends_may_drive_the_beam_on_edge_with_opposite_signs(
    empty: Measurement, setting: Setting, law: type[OutOfPlaneBending]
) -> None:
    same, opposite = law.variants(empty)
    struck = replace(setting, inputs=tuple(Dof(node, direction) for node in (1, 11) for direction in Direction))
    given = at_centre(same, coupling=0.05, leak=0.1)
    along = [dof.direction is Direction.X for dof in struck.inputs]
    assert np.array_equal(same.driven(given, struck), np.where(along, 0.05, 0.05 * 0.1))
    turned = [there and dof.node == 1 for there, dof in zip(along, struck.inputs, strict=True)]
    assert np.array_equal(opposite.driven(given, struck), np.where(turned, -1, 1) * same.driven(given, struck))


def test_a_point_whose_blows_lean_on_their_own_changes_its_row_as_a_leak_does(
    empty: Measurement, modes: BeamModes
) -> None:
    effect, _ = LeanOfEachPoint.variants(empty)
    row = empty.sets[0].inputs.index(Dof(11, Direction.Y))
    flat = read(effect, empty, modes)
    own = read(effect, empty, modes, lean_11y=0.03) - flat
    all_rows = read(effect, empty, modes, coupling=0.3, leak=0.1) - flat
    assert np.all(np.delete(own, row, axis=0) == 0)
    assert np.max(np.abs(own[row])) > 0.01 * np.max(np.abs(flat[row]))
    assert np.allclose(own[row], all_rows[row], rtol=1e-6)
