"""Sensors that are not quite as simple as their first law: uneven, late by frequency, above the beam's axis."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Direction, Dof
from analysis.frequency_response import Complex
from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect
from analysis.gap.effects.beam import AccelerometerOnTheSurface
from analysis.gap.effects.joint_geometry import ContactPatch, LopsidedContactPatch
from analysis.gap.effects.measuring_chain import (
    ChannelDelay,
    CrossAxisAboveTheAxis,
    CrossAxisSensitivity,
    DelayOfFilter,
    HighpassCorner,
    SensorGain,
    TwoCorners,
    UnevenGain,
)
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.measurement import Measurement
from analysis.gap.simulation.baseline import baseline_of
from analysis.gap.simulation.free_beam_modes import beam_modes_of
from analysis.gap.simulation.two_rigs import Simulation
from analysis.structure.forward import accelerance
from analysis.structure.joints import Joint
from tests.analysis.gap.conftest import at_centre, simulation_of


@pytest.fixture
def setting(empty: Measurement) -> Setting:
    return simulation_of(empty).groups[0].setting


@pytest.fixture
def bench(empty: Measurement, setting: Setting) -> BeamBench:
    baseline = baseline_of(empty)
    values = at_centre(baseline)
    return baseline.beam(values, setting, baseline.mounting(values))


def read(effect: Effect, measurement: Measurement, **own: float) -> Complex:
    """(rows, lines) of the first set, without damping of the free beam, with an effect whose values are `own`."""
    modes = beam_modes_of(measurement.drawing)
    undamped = replace(modes, damping_rate=np.zeros_like(modes.damping_rate))
    simulation = Simulation(baseline_of(measurement), undamped, (effect,))
    scores = np.zeros(Likelihood(simulation).unknowns)
    for place, parameter in enumerate(effect.parameters, start=len(simulation.baseline.parameters)):
        scores[place] = parameter.score(own.get(parameter.name, parameter.centre))
    return Likelihood(simulation).predict(scores, derivatives=()).accelerances[0]


@pytest.mark.parametrize(
    ("simple", "wider", "own"),
    [
        (SensorGain(), UnevenGain(), {"gain": 0.03}),
        (ChannelDelay(), DelayOfFilter(), {"tau": 2e-5}),
        (HighpassCorner(), TwoCorners(), {"corner": 2.0, "second": 0.0}),
    ],
    ids=["gain", "delay", "corner"],
)
def test_a_wider_law_is_the_simple_one_where_nothing_deviates(
    bench: BeamBench, setting: Setting, simple: Effect, wider: Effect, own: dict[str, float]
) -> None:
    expected = simple.beam(at_centre(simple, **own), bench, setting).chain
    found = wider.beam(at_centre(wider, **own), bench, setting).chain
    np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), rtol=1e-12)


def test_an_uneven_gain_keeps_its_phase_and_a_filter_delays_by_its_share(bench: BeamBench, setting: Setting) -> None:
    uneven = at_centre(UnevenGain(), gain=0.0, uneven_80=0.003)
    ratio = UnevenGain().beam(uneven, bench, setting).chain / bench.chain
    assert np.max(np.abs(np.angle(ratio))) < 1e-12
    assert np.max(np.abs(ratio)) == pytest.approx(np.exp(0.003), rel=1e-3)
    late = at_centre(DelayOfFilter(), tau=2e-5, more_80=0.1, more_300=0.1, more_900=0.1)
    ratio = DelayOfFilter().beam(late, bench, setting).chain / bench.chain
    np.testing.assert_allclose(np.angle(ratio[0]), -2 * np.pi * setting.frequency * 2.2e-5, rtol=1e-9)


def test_two_corners_are_two_stages_in_a_row(bench: BeamBench, setting: Setting) -> None:
    both = TwoCorners().beam({"corner": 2.0, "second": 0.3}, bench, setting).chain
    one, other = (HighpassCorner().beam({"corner": corner}, bench, setting).chain for corner in (2.0, 0.6))
    np.testing.assert_allclose(both, one * other, rtol=1e-12)


def test_a_mass_above_the_axis_is_a_joint_with_its_inertia(empty: Measurement) -> None:
    """Compared with the forward model, which has the mass in its equations of motion, at one frequency at a time."""
    (effect,) = AccelerometerOnTheSurface.variants(empty)
    mass, height = 0.03, 0.025
    found = read(effect, empty, m=mass, c=0.0, height=height)
    simulation = simulation_of(empty)
    values = simulation.values([0.0] * len(simulation.baseline.parameters))
    stiffness = simulation.joints(values, simulation.groups[0].setting, np.zeros(1, dtype=complex), np.ones((2, 2)))
    joints = [Joint(each.name, each.node, stiffness[0, 0, place]) for place, each in enumerate(empty.drawing.joints)]
    each, sensor = empty.sets[0], empty.drawing.accelerometer
    inertia = mass * np.array([[1, 0, -height], [0, 1, 0], [-height, 0, height**2]])
    for line in (3, 40, 90):
        frequency = each.frequency[[line]]
        held = Joint("mass", sensor.node, np.asarray(-((2 * np.pi * frequency[0]) ** 2) * inertia, dtype=complex))
        expected = accelerance(simulation.modes.free, [*joints, held], frequency, sensor, each.inputs).accelerance
        np.testing.assert_allclose(found[:, [line]], expected, rtol=1e-5, atol=1e-6 * np.max(np.abs(expected)))


def test_cross_axis_motion_above_the_axis_grows_with_height_as_an_accelerometer_along_the_beam_there(
    empty: Measurement,
) -> None:
    (above,) = CrossAxisAboveTheAxis.variants(empty)
    share, heights = 0.04, (0.0, 0.01, 0.02)
    on_axis = read(CrossAxisSensitivity(), empty, sensitivity=share)
    low, middle, high = (read(above, empty, sensitivity=share, height=height) for height in heights)
    np.testing.assert_allclose(low, on_axis, rtol=1e-12)
    np.testing.assert_allclose(high - low, 2 * (middle - low), atol=1e-9 * np.max(np.abs(low)))
    along = replace(empty, drawing=replace(empty.drawing, accelerometer=Dof(3, Direction.X)))
    (mass,) = AccelerometerOnTheSurface.variants(along)
    at_axis, higher = (read(mass, along, m=0.0, c=0.0, height=height) for height in heights[:2])
    np.testing.assert_allclose(middle - low, share * (higher - at_axis), atol=1e-9 * np.max(np.abs(low)))


def test_a_patch_pressed_at_one_end_acts_beside_its_place(empty: Measurement) -> None:
    baseline = baseline_of(empty)
    mounting = baseline.mounting(at_centre(baseline))
    (effect,) = LopsidedContactPatch.variants(empty)
    found = effect.mounting({"length": 0.03, "aside_I": 0.1, "aside_II": -0.05}, mounting)
    np.testing.assert_allclose(found.length, ContactPatch().mounting({"length": 0.03}, mounting).length)
    np.testing.assert_allclose(found.position - mounting.position, [0.003, -0.0015])
