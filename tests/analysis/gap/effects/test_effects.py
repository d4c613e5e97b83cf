"""Effects of joints, beam, measuring chain and blows by their laws, in numbers."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Direction, Dof
from analysis.frequency_response import Complex
from analysis.gap.bench import BeamBench, Cylinders, Mounting, Setting, joint_matrices
from analysis.gap.catalogue import candidates
from analysis.gap.effect import Effect, Given, acts_on
from analysis.gap.effects.attachment import (
    FoundationBothWays,
    FoundationCompliance,
    JointMass,
    MassOfEachJoint,
    TurningMass,
)
from analysis.gap.effects.beam import (
    REFERENCE,
    AccelerometerMass,
    AccelerometerWithCable,
    BeamDamping,
    BendingByRow,
    DampingAlongCurve,
    DampingFollowingFrequency,
    DampingOfModes,
    Density,
    MeshError,
    MoreFreeDamping,
    OnEdgeOnJoints,
    OutOfPlaneBending,
    YoungsModulus,
)
from analysis.gap.effects.blow import AllBlows, BlowsAtOnePoint, ImpactAngle, ImpactPosition, SurfaceBlows
from analysis.gap.effects.joint_geometry import (
    ContactPatch,
    CylinderAngle,
    SplayedCylinders,
    SupportPosition,
    VerticalOffset,
)
from analysis.gap.effects.measuring_chain import (
    ChannelDelay,
    CrossAxisSensitivity,
    ExponentialWindow,
    HighpassCorner,
    SecondOrderCorner,
    SensorGain,
)
from analysis.gap.fitting.fit import Likelihood
from analysis.gap.measurement import Configuration, Measurement, TesterPoints
from analysis.gap.simulation.baseline import Baseline, baseline_of
from analysis.gap.simulation.free_beam_modes import BeamModes, beam_modes_of
from analysis.gap.simulation.two_rigs import Simulation
from tests.analysis.gap.conftest import at_centre

SHEAR, COMPRESSION, ROTATION = 4e5 * (1 + 0.1j), 2.4e6 * (1 + 0.12j), 20.0 * (1 + 0.12j)


@pytest.fixture
def baseline(empty: Measurement) -> Baseline:
    return baseline_of(empty)


@pytest.fixture(scope="session")
def modes(empty: Measurement) -> BeamModes:
    return beam_modes_of(empty.drawing)


@pytest.fixture
def setting(empty: Measurement) -> Setting:
    each = empty.sets[0]
    first = np.zeros(len(each.inputs), dtype=np.intp)
    return Setting(each.inputs, each.frequency, np.array([each.peak_force]), first, first)


@pytest.fixture
def cylinders(empty: Measurement) -> Cylinders:
    of_one = np.array([SHEAR, COMPRESSION, ROTATION])[:, None, None]
    both = np.stack([of_one] * len(empty.drawing.joints))
    return Cylinders(both.real, both.imag)


@pytest.fixture
def mounting(baseline: Baseline) -> Mounting:
    return baseline.mounting(at_centre(baseline))


@pytest.fixture
def bench(baseline: Baseline, setting: Setting, mounting: Mounting) -> BeamBench:
    return baseline.beam(at_centre(baseline), setting, mounting)


def read(effect: Effect, empty: Measurement, modes: BeamModes, **own: float) -> Complex:
    """(rows, lines) of the first hammer set with one effect on top of the baseline at its centre."""
    simulation = Simulation(baseline_of(empty), modes, (effect,))
    scores = np.zeros(Likelihood(simulation).unknowns)
    for place, parameter in enumerate(effect.parameters, start=len(simulation.baseline.parameters)):
        if parameter.name in own:
            scores[place] = (own[parameter.name] - parameter.centre) / parameter.spread
    return Likelihood(simulation).predict(scores, derivatives=()).accelerances[0]


# --- which rig an effect can show in ---


def test_elastomer_and_leaning_act_in_both_rigs_and_every_instrument_in_one(empty: Measurement) -> None:
    both = {
        *("amplitude_dependence", "cubic_stiffness", "coulomb_friction", "frequency_dependence", "loss_law"),
        *("temperature_shift", "preload_stiffening", "conditioning_drift"),
        *("cylinder_angle", "support_position", "contact_patch", "vertical_offset"),
    }
    for effect in candidates(empty):
        in_both = acts_on(effect, "cylinders") or acts_on(effect, "mounting")
        assert in_both == (effect.id in both), effect.id
        if not in_both:
            in_beam = acts_on(effect, "joints") or acts_on(effect, "beam")
            assert in_beam != acts_on(effect, "tester"), effect.id


# --- the joints ---


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


def test_a_contact_patch_turns_with_a_twelfth_of_its_length_squared(cylinders: Cylinders, mounting: Mounting) -> None:
    spread = ContactPatch().mounting({"length": 0.03}, mounting)
    joints = joint_matrices(cylinders, mounting)
    added = joint_matrices(cylinders, spread) - joints
    assert np.allclose(added[..., 2, 2], joints[..., 1, 1] * 0.03**2 / 12, rtol=1e-9)
    added[..., 2, 2] = 0
    assert np.allclose(added, 0.0)


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


def test_a_steeper_cylinder_splits_k11_from_k22_and_shows_in_angled_pairs(
    empty: Measurement, baseline: Baseline, cylinders: Cylinders, mounting: Mounting, points: TesterPoints
) -> None:
    delta = np.radians(2.0)
    for effect in CylinderAngle.variants(empty):
        leaning = effect.mounting({"delta_deg": 2.0}, mounting)
        k = joint_matrices(cylinders, leaning)[0, 0, effect.joint]
        split = 2 * (COMPRESSION - SHEAR) * np.sin(2 * delta)
        assert k[1, 1] - k[0, 0] == pytest.approx(split, rel=1e-9)
        assert k[1, 1] + k[0, 0] == pytest.approx(2 * (SHEAR + COMPRESSION), rel=1e-9)
        angled = (points.configuration == Configuration.ANGLED) & (points.specimen == effect.joint)
        for mounted, share in ((leaning, np.sin(2 * delta)), (mounting, 0.0)):
            seen = baseline.weights(mounted, points)[angled] @ [SHEAR, COMPRESSION]
            expected = SHEAR + COMPRESSION + share * (COMPRESSION - SHEAR)
            assert np.allclose(seen, expected, rtol=1e-9)
        others = ~angled
        assert np.array_equal(baseline.weights(leaning, points)[others], baseline.weights(mounting, points)[others])
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


# --- the beam ---


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


# --- the measuring chain of the beam rig ---


def test_a_row_of_its_own_shows_bending_out_of_plane_that_the_others_do_not(
    empty: Measurement, modes: BeamModes
) -> None:
    (effect,) = BendingByRow.variants(empty)
    row = empty.sets[0].inputs.index(Dof(11, Direction.Y))
    change = read(effect, empty, modes, row_11y_1=0.05) - read(effect, empty, modes)
    assert np.all(np.delete(change, row, axis=0) == 0)
    peak = empty.sets[0].frequency[np.argmax(np.abs(change[row]))]
    assert peak == pytest.approx(effect.parameters[2].centre, abs=4)


def test_every_law_answers_for_points_that_were_not_struck(
    empty: Measurement, modes: BeamModes, baseline: Baseline
) -> None:
    unseen = tuple(Dof(node, Direction.Y) for node in (5, 8))
    first = np.zeros(len(unseen), dtype=np.intp)
    struck_at = Setting(unseen, empty.sets[0].frequency, np.array([100.0]), first, first)
    mounting = baseline.mounting(at_centre(baseline))
    for effect in candidates(empty):
        found = effect.beam(at_centre(effect), baseline.beam(at_centre(baseline), struck_at, mounting), struck_at)
        assert found.blow_offset.shape == found.lean.shape == (2,), effect.law


def test_a_gain_is_one_factor_on_all_rows(empty: Measurement, modes: BeamModes) -> None:
    once, more = (read(SensorGain(), empty, modes, gain=gain) for gain in (0.0, 0.04))
    assert np.allclose(more, 1.04 * once, rtol=1e-12)


def test_a_delay_turns_the_phase_back_in_proportion_to_frequency(empty: Measurement, modes: BeamModes) -> None:
    prompt, late = (read(ChannelDelay(), empty, modes, tau=tau) for tau in (0.0, 4e-5))
    expected = np.exp(-2j * np.pi * empty.sets[0].frequency * 4e-5)
    assert np.allclose(late / prompt, expected, rtol=1e-9)


def test_a_highpass_corner_halves_the_power_at_its_corner(bench: BeamBench, setting: Setting) -> None:
    at_corner = replace(bench, pole=np.array([2j * np.pi * 3.0, 2j * np.pi * 300.0]))
    first, second = (
        law.beam({"corner": 3.0}, at_corner, setting).chain[0] for law in (HighpassCorner(), SecondOrderCorner())
    )
    assert np.abs(first[0]) == pytest.approx(np.sqrt(0.5))
    assert np.abs(second[0]) == pytest.approx(np.sqrt(0.5))
    assert np.degrees(np.angle([first[0], second[0]])) == pytest.approx([45.0, 90.0])
    assert np.angle(first[1]) == pytest.approx(3.0 / 300.0, rel=1e-3)
    assert np.abs([first[1], second[1]]) == pytest.approx(1.0, abs=1e-4)


def test_a_window_evaluates_beside_the_axis_of_frequency(empty: Measurement, modes: BeamModes) -> None:
    """H is analytic, so a shift of the pole by s is one of i s in frequency: every mode gains s of half-width."""
    near = np.arange(70.0, 80.0, 0.05)
    shape = len(empty.sets[0].inputs), near.size
    fine = replace(
        empty.sets[0], frequency=near, accelerance=np.ones(shape, dtype=complex), deviation=np.full(shape, 1.0)
    )
    measurement = replace(empty, sets=(fine,))
    once, shifted = (read(ExponentialWindow(), measurement, modes, s=s) for s in (0.0, 0.02))
    by_pole = -1j * np.gradient(once, 2 * np.pi * near, axis=1)[:, 1:-1]
    assert np.allclose((shifted - once)[:, 1:-1] / 0.02, by_pole, rtol=0, atol=2e-3 * np.max(np.abs(by_pole)))


def test_a_window_that_is_stated_is_no_effect(empty: Measurement, modes: BeamModes) -> None:
    """What a window of 2 1/s does is explained by stating it, and by nothing else beside."""
    stated = replace(empty, sets=tuple(replace(each, decay=2.0) for each in empty.sets))
    with_effect, as_stated = (
        read(ExponentialWindow(), empty, modes, s=2.0),
        read(ExponentialWindow(), stated, modes, s=0.0),
    )
    np.testing.assert_allclose(as_stated, with_effect, rtol=1e-9)


# --- the blows ---


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
