"""Simulated readings: which rig an effect shows in, what its law says, and labelled examples where there are any."""

import json
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

from simlab.article import INCLINATIONS_DEG, JOINT_NAMES, SimulatedArticle, SimulatedJoint
from simlab.beam import Real, SimulatedBeam, free_modes
from simlab.case.bundle import percent
from simlab.case.campaign import CONFIGURATIONS, MEASURED, ROWS, WITHHELD
from simlab.case.draw import EFFECTS, NOVELTIES, Case, CaseKind, draw_case
from simlab.case.effects import CATALOGUE
from simlab.case.effects import NOVELTIES as NOVEL_KINDS
from simlab.case.effects.base import CylinderState
from simlab.case.effects.elastomer import REFERENCE_AMPLITUDE
from simlab.case.random_case import draw_random_case
from simlab.case.simulate import Simulated, simulate
from simlab.coupling import Complex
from simlab.elastomer import LinearCylinder
from simlab.stand import BuiltCase, Stand
from tests.recordings import find_recording

BOTH_RIGS = {
    "amplitude_dependence",
    "cubic_stiffness",
    "coulomb_friction",
    "frequency_dependence",
    "loss_law",
    "cylinder_angle",
}
TESTER_ONLY = {
    "temperature_shift",
    "preload_stiffening",
    "conditioning_drift",
    "frame_compliance",
    "fixture_inertia",
    "frame_resonance",
    "transducer_lag",
    "tester_ripple",
}
SEED = 12
LINES = np.arange(4.0, 1025.0, 4.0)


@lru_cache
def baseline() -> Simulated:
    return simulate(draw_case(SEED, CaseKind.NONE), frequency=LINES)


def single(name: str, size: float = 1.0, seed: int = SEED) -> Case:
    kind = CaseKind.SINGLE if name in EFFECTS else CaseKind.NOVEL
    return draw_case(seed, kind, [name], size)


def with_law(name: str, law: str) -> Case:
    """A case of full size with the law asked for."""
    kind = CaseKind.SINGLE if name in EFFECTS else CaseKind.NOVEL
    cases = (draw_case(seed, kind, [name], 1.0) for seed in range(60))
    return next(case for case in cases if case.effects[0].law == law)


@pytest.mark.parametrize(
    "case",
    [
        draw_case(101, CaseKind.NONE),
        *(
            draw_random_case(1, CaseKind.NOVEL, [name]).repeatable()
            for name in ("hung_mass", "rotary_damper", "mid_span_spring", "crack", "absorber")
        ),
    ],
    ids=lambda case: case.effects[0].name if case.effects else "none",
)
def test_a_longer_series_changes_no_case_by_as_much_as_its_noise(case: Case) -> None:
    built = BuiltCase.of(case)
    beam = built.article.beam
    longer = replace(built, article=replace(built.article, beam=replace(beam, terms=beam.terms + 12)))
    (found, _), (exact, _) = (Stand(each, LINES).read(0) for each in (built, longer))
    assert np.max(np.abs(found - exact)) < 1e-4  # (m/s^2)/N; the noise of a line is 1e-3


@pytest.mark.parametrize("name", [*EFFECTS, *NOVELTIES])
def test_an_effect_shows_in_the_rigs_it_belongs_to_and_in_no_other(name: str) -> None:
    seen = simulate(single(name), frequency=LINES)
    inverse = percent(baseline().accelerance, seen.accelerance)
    direct = percent(baseline().stiffness, seen.stiffness)
    shows_direct = name in BOTH_RIGS or name in TESTER_ONLY
    assert (inverse > 0.1) == (name not in TESTER_ONLY), f"{inverse} %"
    assert (direct > 0.5) == shows_direct, f"{direct} %"
    if not shows_direct:
        np.testing.assert_array_equal(seen.stiffness, baseline().stiffness)
    if name in TESTER_ONLY:
        np.testing.assert_array_equal(seen.accelerance, baseline().accelerance)


@pytest.mark.parametrize("name", EFFECTS)
def test_a_smaller_size_of_an_effect_shows_less(name: str) -> None:
    case = single(name, 0.5)
    smaller = replace(case, effects=single(name, 0.1).effects)
    shows = [
        percent(baseline().accelerance, seen.accelerance) + percent(baseline().stiffness, seen.stiffness)
        for seen in (simulate(smaller, frequency=LINES), simulate(case, frequency=LINES))
    ]
    assert 0.0 < shows[0] < shows[1]


def test_without_effects_a_case_reads_as_one_that_has_none() -> None:
    seen = simulate(single("joint_mass"), without_effects=True, frequency=LINES)
    np.testing.assert_array_equal(seen.accelerance, baseline().accelerance)
    np.testing.assert_array_equal(seen.stiffness, baseline().stiffness)


def test_two_effects_are_both_there() -> None:
    pair = draw_case(SEED, CaseKind.PAIR, ["sensor_gain", "frame_compliance"], 1.0)
    gain = next(effect for effect in pair.effects if effect.name == "sensor_gain").number("gain")
    seen = simulate(pair, frequency=LINES)
    np.testing.assert_allclose(seen.accelerance, baseline().accelerance * (1 + gain), rtol=1e-12)
    assert percent(baseline().stiffness, seen.stiffness) > 10


def test_the_tester_reads_b_2a_and_k22_of_a_leaning_joint() -> None:
    case, seen = draw_case(SEED, CaseKind.NONE), baseline()
    points = case.campaign.points
    for i, name in enumerate(JOINT_NAMES):
        joint = case.article.joints[name]
        cylinder = joint.cylinders[0]
        lean = np.radians(joint.lean_deg)
        shear, compression = cylinder.shear, cylinder.compression
        k22 = 2 * (shear * np.cos(np.pi / 4 + lean) ** 2 + compression * np.sin(np.pi / 4 + lean) ** 2)
        for configuration, expected in zip(CONFIGURATIONS, (compression, 2 * shear, k22), strict=True):
            here = (points.specimen == i) & (points.configuration == CONFIGURATIONS.index(configuration))
            assert here.sum() == 120
            np.testing.assert_allclose(seen.stiffness[here], case.campaign.tester_gain * expected, rtol=1e-12)


@pytest.mark.parametrize("law", ["kraus", "contacts", "power"])
def test_an_amplitude_law_is_the_baseline_at_its_reference_and_softens(law: str) -> None:
    effect = with_law("amplitude_dependence", law).effects[0]
    amplitude = np.array([1e-6, REFERENCE_AMPLITUDE, 50e-6])
    seen = seen_in_tester(amplitude, np.full(3, 50.0))
    cylinder = np.tile(np.array([4e5 + 4e4j, 2e6 + 2e5j, 20 + 2j]), (3, 1))
    changed = effect.cylinder(cylinder, seen)
    if effect.values["felt"] == "component":
        np.testing.assert_allclose(changed[1], cylinder[1], rtol=1e-12)
    assert np.all(np.diff(changed.real, axis=0) < 0)
    assert np.all(changed.imag > 0)


@pytest.mark.parametrize("law", ["fractional_zener", "prony4", "springpot"])
def test_a_frequency_law_ties_stiffness_and_loss_as_causality_does(law: str) -> None:
    effect = with_law("frequency_dependence", law).effects[0]

    def factor(frequency: Real) -> Complex:
        ones = np.ones((frequency.size, 3), dtype=np.complex128)
        return effect.cylinder(ones, seen_in_tester(np.full(frequency.size, 1e-5), frequency))[:, 0]

    # Kramers and Kronig, k' from k'', between two frequencies that the grid passes half a step away
    step = np.log(10.0) / 500
    low, high = 10.0, 100.0
    grid = low * np.exp((np.arange(-4000, 5000) + 0.5) * step)
    kernel = 1 / (grid**2 - high**2) - 1 / (grid**2 - low**2)
    gained = -2 / np.pi * np.sum(grid**2 * factor(grid).imag * kernel) * step
    before, after = factor(np.array([low, high])).real
    assert after > before
    np.testing.assert_allclose(gained, after - before, rtol=2e-3)


def test_a_conditioning_drift_follows_the_order_of_the_test() -> None:
    case = with_law("conditioning_drift", "linear")
    drift = simulate(case).stiffness / simulate(case, without_effects=True).stiffness
    np.testing.assert_allclose(drift, 1 - 0.1 * case.campaign.points.order, rtol=1e-12)


def test_a_delay_turns_the_phase_in_proportion_to_frequency() -> None:
    case = with_law("channel_delay", "delay")
    turned = simulate(case).accelerance / simulate(case, without_effects=True).accelerance
    expected = np.exp(-2j * np.pi * case.campaign.frequency * 50e-6)
    np.testing.assert_allclose(turned, np.broadcast_to(expected, turned.shape), rtol=1e-9)


@pytest.mark.parametrize("name", ["out_of_plane_bending", "highpass_corner"])
def test_a_window_weights_all_that_the_record_holds(name: str) -> None:
    """Against the record itself: what an effect adds to it, weighted by exp(-s t)."""
    window = single("exponential_window").effects[0]
    spacing, lines = 0.1, 20_480
    frequency: Real = spacing * np.arange(1.0, lines + 1)
    added = []
    for others in ((), (window,)):
        with_it, without = (
            Stand(BuiltCase.of(replace(single(name), effects=effects)), frequency).read(0, MEASURED[-1:])[0][0]
            for effects in ((*single(name).effects, *others), others)
        )
        added.append(with_it - without)
    record = np.fft.irfft(np.concatenate([[0.0], added[0]]))
    time = np.arange(2 * lines) / (2 * lines * spacing)
    # the last half second is what the band's end spreads to before the blow
    weight = np.exp(-window.number("s") * np.where(time > time[-1] - 0.5, time - time[-1], time))
    expected = np.fft.rfft(record * weight)[1:]
    band = (frequency > 20.0) & (frequency < 1000.0)
    np.testing.assert_allclose(added[1][band], expected[band], atol=5e-3 * np.abs(expected[band]).max())


def free_squares(article: SimulatedArticle, cut: tuple[float, float], loss: float) -> Real:
    """(3,) omega^2 of the free beam's first bending modes by Hermite elements, softened by `loss` over `cut`, m."""
    beam = article.beam
    ends = np.unique(np.concatenate([np.linspace(0.0, beam.length, 61), cut]))
    stiffness, mass = np.zeros((2, 2 * ends.size, 2 * ends.size))
    for i, (start, end) in enumerate(pairwise(ends)):
        h, softened = end - start, 1.0 - loss * (cut[0] < (start + end) / 2 < cut[1])
        bending = softened * beam.youngs_modulus * beam.width * beam.height**3 / 12 / h**3
        own = slice(2 * i, 2 * i + 4)
        stiffness[own, own] += bending * np.array(
            [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
             [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]
        )  # fmt: skip
        mass[own, own] += beam.density * beam.area * h / 420 * np.array(
            [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
             [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]
        )  # fmt: skip
    return np.asarray(eigh(stiffness, mass, eigvals_only=True)[2:5])


@pytest.mark.parametrize("seed", [1, 5, 9])
def test_a_cut_softens_the_beam_by_as_much_as_it_says(seed: int) -> None:
    """Against finite elements: a series without kinks at the ends of the cut saw three quarters of it."""
    case = draw_random_case(seed, CaseKind.NOVEL, ["crack"])
    (crack,) = case.effects
    article = BuiltCase.of(case).article
    modes = free_modes(article.beam)
    (softened,) = crack.attachments(modes, article, np.ones(1, dtype=np.complex128))
    whole = np.diag(modes.angular_frequency**2)
    cut = whole + softened.shapes.T @ softened.stiffness.real @ softened.shapes
    bending = np.any(modes.series["y"], axis=(0, 1))
    found = 1.0 - np.linalg.eigvalsh(cut[np.ix_(bending, bending)])[2:5] / modes.angular_frequency[bending][2:5] ** 2
    half = crack.number("length") / 2
    ends = (crack.number("x") - half, crack.number("x") + half)
    expected = 1.0 - free_squares(article, ends, crack.number("loss")) / free_squares(article, ends, 0.0)
    np.testing.assert_allclose(found, expected, rtol=0.04, atol=1e-4)


def test_a_misplaced_row_moves_along_its_slope_and_leaves_the_others() -> None:
    case = single("impact_position", 0.02)
    seen, straight = (simulate(case, without_effects=without, frequency=LINES) for without in (False, True))
    for i, row in enumerate(ROWS):
        shift = float(case.effects[0].values.get(f"shift_{row.node}", 0.0)) if row.direction == "y" else 0.0
        expected = straight.accelerance[:, i] + shift * straight.slope[:, i]
        np.testing.assert_allclose(seen.accelerance[:, i], expected, rtol=2e-3, atol=2e-5)


def test_a_leaning_blow_on_an_end_face_is_at_that_face() -> None:
    seen = simulate(with_law("impact_angle", "all"), frequency=LINES)
    along = [row.direction == "x" for row in seen.rows]
    assert np.all(seen.slope[:, along] == 0.0)
    assert np.all(np.abs(seen.slope[:, ~np.array(along)]).max(axis=-1) > 0.0)


def test_a_roving_drift_leaves_the_rows_that_nobody_strikes() -> None:
    seen = simulate(single("roving_drift"), frequency=LINES)
    asked_for = slice(len(MEASURED), None)
    np.testing.assert_allclose(seen.accelerance[:, asked_for], baseline().accelerance[:, asked_for], rtol=1e-9)


def test_distortion_rises_with_amplitude_where_the_stiffness_changes_with_it() -> None:
    case = with_law("cubic_stiffness", "quadratic")
    seen, points = simulate(case), case.campaign.points
    large, small = points.amplitude_pp_mm == 0.1, points.amplitude_pp_mm == 0.01
    assert seen.distortion[large].min() > seen.distortion[small].max()
    np.testing.assert_allclose(baseline().distortion, 0.15)


def seen_in_tester(amplitude: Real, frequency: Real) -> CylinderState:
    return CylinderState(True, "I", frequency, amplitude, np.ones_like(amplitude), np.zeros_like(amplitude))


def example(name: str) -> tuple[Case, dict[str, Any], Complex]:
    """A labelled example as a case, its truth and its withheld accelerances at 1, 3, ... of our lines."""
    truth = json.loads(find_recording(f"examples/truth/{name}.json").read_text(encoding="utf-8"))
    setup = json.loads(find_recording(f"examples/{name}/setup.json").read_text(encoding="utf-8"))
    base, drawn = truth["baseline"], draw_case(1, CaseKind.NONE)
    beam = replace(SimulatedBeam(), youngs_modulus=207e9 * base["E"], density=7850 * base["rho"])
    joints = {}
    for i, joint in enumerate(JOINT_NAMES):
        cylinder = LinearCylinder(
            shear=base["a"][i] * (1 + 1j * base["ga"][i]),
            compression=base["b"][i] * (1 + 1j * base["gb"][i]),
            rotation=base["c"][i] * (1 + 1j * base["gb"][i]),
        )
        joints[joint] = SimulatedJoint(
            base["joint_x"][i], (cylinder, cylinder), INCLINATIONS_DEG[joint], lean_deg=base["angle"][i]
        )
    setups = tuple(
        replace(drawn.campaign.setups[0], peak_force=s["peak"], gain=s["gain"], offsets=tuple(s["dx"]))
        for s in truth["lab"]["sets"]
    )
    campaign = replace(drawn.campaign, node_positions=tuple(setup["node_positions"]), setups=setups)
    stored = np.load(find_recording(f"examples/truth/{name}.npz"))
    case = replace(drawn, article=SimulatedArticle(beam, joints, base["sensor_x"]), campaign=campaign)
    return case, truth, stored["H"].astype(np.complex128)


@pytest.mark.parametrize("name", ["none", "frame", "novel_2"])
def test_an_example_without_an_effect_on_its_withheld_rows_is_met(name: str) -> None:
    case, _, stored = example(name)
    ours = simulate(case).accelerance[0, len(MEASURED) :, 1:-1:2]
    # the examples' own mesh is off by 0.08 %
    assert percent(ours, stored[:, : ours.shape[1]]) < 0.12


@pytest.mark.parametrize(
    ("name", "effect"),
    [("foundation", "foundation_compliance"), ("sensor_mass", "accelerometer_mass"), ("novel_1", "absorber")],
)
def test_an_example_with_a_known_effect_is_met_closer_than_its_noise(name: str, effect: str) -> None:
    case, truth, stored = example(name)
    parameters = dict(truth["parameters"][effect])
    kind = (CATALOGUE | NOVEL_KINDS)[effect]
    law = parameters.pop("law", "both_directions")
    with_effect = simulate(replace(case, effects=(kind(1.0, law, parameters),)))
    ours = with_effect.accelerance[0, len(MEASURED) : len(MEASURED) + len(WITHHELD), 1:-1:2]
    assert percent(ours, stored[: len(WITHHELD), : ours.shape[1]]) < truth["noise_percent"]
