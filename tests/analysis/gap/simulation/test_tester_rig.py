"""What the tester reads of specimens that follow the motion which its frame leaves them."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.frequency_response import Complex
from analysis.gap.effect import Effect
from analysis.gap.effects.joint_amplitude import AmplitudeDependence, CubicStiffness, ManySliders
from analysis.gap.effects.tester import ComplianceOfEachFixture, FixtureInertia, FrameCompliance
from analysis.gap.measurement import Measurement, TesterPoints
from analysis.gap.simulation.baseline import baseline_of
from analysis.gap.simulation.tester_rig import reading_of_tester
from tests.analysis.gap.conftest import at_centre

COMPLIANCE = 4e-7  # m/N, about that of the specimens


def reading(measurement: Measurement, points: TesterPoints, *effects: Effect) -> Complex:
    """(points,) N/m with parameters at their centres, but for the size of what would do nothing there."""
    baseline, sizes = baseline_of(measurement), {"c": COMPLIANCE, "beta": -8e7}
    soft = [
        at_centre(effect, **{each.name: sizes[each.name] for each in effect.parameters if each.name in sizes})
        for effect in effects
    ]
    return reading_of_tester(baseline, at_centre(baseline), list(zip(effects, soft, strict=True)), points)


@pytest.mark.parametrize(
    "law", [AmplitudeDependence(), CubicStiffness(), ManySliders()], ids=lambda each: type(each).__name__
)
@pytest.mark.parametrize("frame", [FrameCompliance(), ComplianceOfEachFixture()], ids=lambda each: type(each).__name__)
def test_specimen_and_frame_carry_one_force_and_share_the_motion(
    law: Effect, frame: Effect, empty: Measurement, points: TesterPoints
) -> None:
    read = reading(empty, points, law, frame)
    of_specimen = np.abs(1 - COMPLIANCE * read)  # the force over the machine's motion is what is read
    specimen = reading(empty, replace(points, amplitude=of_specimen * points.amplitude), law)
    np.testing.assert_allclose(read, 1 / (1 / specimen + COMPLIANCE), rtol=1e-3)
    assert np.max(of_specimen) < 0.9
    without_share = reading(empty, points, law)
    assert np.max(np.abs(1 / (1 / without_share + COMPLIANCE) / read - 1)) > 0.01


def test_what_gives_nothing_leaves_the_specimen_all_the_motion(empty: Measurement, points: TesterPoints) -> None:
    inertia = FixtureInertia()
    alone, read = (reading(empty, points, *effects) for effects in ((CubicStiffness(),), (CubicStiffness(), inertia)))
    np.testing.assert_allclose(read, inertia.tester(at_centre(inertia), alone, points))
