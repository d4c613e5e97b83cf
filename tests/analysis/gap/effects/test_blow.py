"""Effects of blows by their laws, in numbers."""

import numpy as np
import pytest

from analysis.dof import Direction
from analysis.gap.bench import BeamBench
from analysis.gap.effects.blow import AllBlows, BlowsAtOnePoint, ImpactAngle, ImpactPosition, SurfaceBlows
from analysis.gap.measurement import Measurement
from analysis.gap.simulation.free_beam_modes import BeamModes
from tests.analysis.gap.effects.readings import read


def test_leaning_blows_add_the_response_to_a_blow_along_the_beam(empty: Measurement, modes: BeamModes) -> None:
    upright, leaning, of_all = (
        read(effect, empty, modes, angle_deg=angle)
        for effect, angle in ((ImpactAngle(), 0.0), (ImpactAngle(), 3.0), (AllBlows(), 3.0))
    )
    rows = {str(dof): row for row, dof in enumerate(empty.sets[0].inputs)}
    sine, cosine = np.sin(np.radians(3.0)), np.cos(np.radians(3.0))
    across, along = rows["1y"], rows["1x"]
    assert np.allclose(leaning[across], cosine * upright[across] + sine * upright[along], rtol=1e-9)
    assert np.array_equal(leaning[along], upright[along])
    assert np.allclose(of_all[along], cosine * upright[along] + sine * upright[across], rtol=1e-9)
    assert np.array_equal(of_all[across], leaning[across])


def test_leaning_blows_on_the_surface_turn_the_section_too(
    empty: Measurement, modes: BeamModes, bench: BeamBench
) -> None:
    (surface,) = SurfaceBlows.variants(empty)
    assert surface.height == pytest.approx(empty.drawing.beam.height / 2)
    at_axis, above = (read(effect, empty, modes, angle_deg=3.0) for effect in (ImpactAngle(), surface))
    across = [dof.direction is Direction.Y for dof in empty.sets[0].inputs]
    changed = np.max(np.abs(above - at_axis), axis=1) / np.max(np.abs(at_axis), axis=1)
    assert np.all((changed > 1e-4) == across)


def test_a_point_that_is_hard_to_reach_leans_alone(empty: Measurement, modes: BeamModes) -> None:
    variants = {effect.point: effect for effect in BlowsAtOnePoint.variants(empty)}
    assert set(variants) == set(empty.sets[0].inputs)
    for row, dof in enumerate(empty.sets[0].inputs):
        leaning = read(variants[dof], empty, modes, angle_deg=3.0)
        own = read(AllBlows(), empty, modes, angle_deg=3.0)[row]
        assert leaning[row] == pytest.approx(own)
        others = np.delete(leaning, row, axis=0), np.delete(read(AllBlows(), empty, modes), row, axis=0)
        assert others[0] == pytest.approx(others[1])


def test_blows_beside_their_mark_change_their_own_row_by_its_slope(empty: Measurement, modes: BeamModes) -> None:
    (effect,) = ImpactPosition.variants(empty)
    on, right, left = (read(effect, empty, modes, shift_7=shift) for shift in (0.0, 1e-3, -1e-3))
    row = [str(dof) for dof in empty.sets[0].inputs].index("7y")
    others = np.arange(len(on)) != row
    assert np.array_equal(right[others], on[others])
    slope = (right[row] - left[row]) / 2
    assert np.max(np.abs(slope)) > 1e-3 * np.max(np.abs(on[row]))
    assert np.max(np.abs(right[row] - on[row] - slope)) < 0.02 * np.max(np.abs(slope))
    marks = empty.drawing.node_positions
    # as far as the next mark it is the blow there
    there = read(effect, empty, modes, shift_3=float(marks[3] - marks[2]))
    names = [str(dof) for dof in empty.sets[0].inputs]
    assert np.allclose(there[names.index("3y")], on[names.index("4y")], rtol=1e-7)
