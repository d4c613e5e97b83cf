"""Effects of beam and accelerometer by their laws, in numbers."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Direction, Dof
from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given
from analysis.gap.effects.beam import (
    REFERENCE,
    AccelerometerMass,
    AccelerometerWithCable,
    BeamDamping,
    DampingAlongCurve,
    DampingFollowingFrequency,
    DampingOfModes,
    Density,
    MeshError,
    MoreFreeDamping,
    YoungsModulus,
)
from analysis.gap.effects.measuring_chain import (
    CrossAxisSensitivity,
)
from analysis.gap.measurement import Measurement
from analysis.gap.simulation.free_beam_modes import BeamModes
from tests.analysis.gap.conftest import at_centre
from tests.analysis.gap.effects.readings import read


@pytest.mark.parametrize(
    ("effect", "own", "field"),
    [
        (YoungsModulus(), {"relative": 0.02}, "modulus"),
        (Density(), {"relative": 0.02}, "density"),
        (BeamDamping(), {"eta": 0.02}, "loss"),
        (MeshError(), {"third_mode": 0.02}, "mesh"),
        (AccelerometerMass(), {"m": 0.02}, "sensor_mass"),
        (AccelerometerWithCable(), {"m": 0.0, "c": 0.02}, "sensor_damping"),
        (CrossAxisSensitivity(), {"sensitivity": 0.02}, "cross_axis"),
    ],
)
def test_an_effect_of_beam_or_sensor_adds_to_one_property(
    bench: BeamBench, setting: Setting, effect: Effect, own: Given, field: str
) -> None:
    changed = effect.beam(own, bench, setting)
    assert getattr(changed, field) - getattr(bench, field) == pytest.approx(0.02)
    assert replace(changed, **{field: getattr(bench, field)}).__dict__ == bench.__dict__


def test_rival_dampings_of_the_beam_agree_at_their_common_value(
    empty: Measurement, bench: BeamBench, setting: Setting, modes: BeamModes
) -> None:
    given = {"eta": 0.004, "power": 1.0}
    following = DampingFollowingFrequency().beam(given, bench, setting)
    assert following.loss == pytest.approx(0.004 * setting.frequency / REFERENCE)
    assert DampingOfModes().beam(given, bench, setting).ratio == pytest.approx(0.002)
    curved = DampingAlongCurve()
    assert curved.beam(at_centre(curved, eta=0.004), bench, setting).loss == pytest.approx(0.004)
    more_at_100 = at_centre(curved, eta=0.004, log_share_100=np.log(2.0))
    at_knots = replace(setting, frequency=np.array([50.0, 100.0, REFERENCE, 900.0]))
    assert curved.beam(more_at_100, bench, at_knots).loss == pytest.approx([0.004, 0.008, 0.004, 0.004])
    (more,) = MoreFreeDamping.variants(empty)
    grown = more.beam(given, bench, setting).damping
    assert (grown - 1) * empty.drawing.damping_ratios[-1] == pytest.approx(0.002)
    undamped = replace(empty, drawing=replace(empty.drawing, damping_ratios=()))
    assert MoreFreeDamping.variants(undamped) == ()


def test_every_rival_damping_lowers_a_peak_alike(empty: Measurement, modes: BeamModes) -> None:
    (more,) = MoreFreeDamping.variants(empty)
    laws = (BeamDamping(), DampingFollowingFrequency(), DampingOfModes(), more)
    before = read(BeamDamping(), empty, modes, eta=0.0)
    lowered = [
        np.max(np.abs(read(law, empty, modes, eta=0.005)), axis=1) / np.max(np.abs(before), axis=1) for law in laws
    ]
    for each in lowered:
        assert np.all(each < 1)
        assert each == pytest.approx(lowered[0], abs=0.1)


def test_an_accelerometer_is_a_mass_that_moves_with_its_point(empty: Measurement, modes: BeamModes) -> None:
    """The mass pulls with -m a: H' = (1 + m H)^-1 H, with H (x and y at its point) before."""
    inputs = Dof(3, Direction.X), Dof(3, Direction.Y)
    struck = replace(empty.sets[0].rows(np.arange(len(empty.sets[0].inputs)) < 2), inputs=inputs)
    ways = [
        replace(empty, sets=(struck,), drawing=replace(empty.drawing, accelerometer=accelerometer))
        for accelerometer in inputs
    ]
    without, loaded = (
        np.moveaxis(np.array([read(AccelerometerMass(), way, modes, m=m) for way in ways]), 2, 0) for m in (0.0, 0.03)
    )
    assert np.max(np.abs(loaded - without)) > 0.05 * np.max(np.abs(without))
    assert np.allclose(loaded, np.linalg.solve(np.eye(2) + 0.03 * without, without), rtol=1e-7)
