"""Cases by random laws: smooth, never one of the catalogue's, with joints that follow each blow, and nuisances."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simlab.beam import Real
from simlab.case.blows import half_sine_spectrum
from simlab.case.bundle import floor_percent, percent, stated_setup, truth, write_case
from simlab.case.campaign import ROWS
from simlab.case.draw import Case, CaseKind, draw_case
from simlab.case.effects import CATALOGUE
from simlab.case.effects.base import CylinderState
from simlab.case.random_case import ALIKE, draw_random_case
from simlab.case.random_laws import OUTSIDE, RANDOM_LAWS
from simlab.case.random_laws.curves import GRID, curve, draw_curve, rising
from simlab.case.simulate import simulate
from simlab.coupling import Complex
from simlab.stand import BuiltCase, Stand

COARSE: Real = 2.0 * np.arange(1.0, 513.0)
GEOMETRIC = {
    "support_position",
    "vertical_offset",
    "youngs_modulus",
    "density",
    "exponential_window",
    "impact_position",
}
"""Effects whose form is what they are."""


def single(name: str, seed: int = 4) -> Case:
    return draw_random_case(seed, CaseKind.SINGLE, [name])


def test_every_effect_but_the_geometric_ones_has_a_random_law() -> None:
    assert set(RANDOM_LAWS) == set(CATALOGUE)
    assert {name for name, kind in RANDOM_LAWS.items() if kind is CATALOGUE[name]} == GEOMETRIC
    assert not set(OUTSIDE) & set(RANDOM_LAWS)


@pytest.mark.parametrize("name", sorted(set(RANDOM_LAWS) | set(OUTSIDE)))
def test_every_effect_moves_what_is_read_and_its_values_are_numbers_or_words(name: str) -> None:
    kind = CaseKind.NOVEL if name in OUTSIDE else CaseKind.SINGLE
    case = draw_random_case(5, kind, [name]).repeatable()
    with_it, without = (simulate(each, frequency=COARSE) for each in (case, replace(case, effects=())))
    moved = percent(without.accelerance, with_it.accelerance) + percent(without.stiffness, with_it.stiffness)
    assert moved > 0.01
    json.dumps(dict(case.effects[0].values), allow_nan=False)


@pytest.mark.parametrize("name", ["set_step", "level_gain", "phase_offset"])
def test_an_effect_that_tells_sets_apart_has_two_of_them(name: str) -> None:
    for seed in (16, 40):  # campaigns of one set
        assert len(draw_random_case(seed, CaseKind.NONE).campaign.setups) == 1
        case = draw_random_case(seed, CaseKind.NOVEL, [name]).repeatable()
        with_it, without = (simulate(each, frequency=COARSE) for each in (case, replace(case, effects=())))
        assert percent(without.accelerance, with_it.accelerance) > 0.01
        assert len({setup.offsets for setup in case.campaign.setups}) == 2


def test_a_seed_draws_the_same_case_and_the_seeds_draw_every_bench() -> None:
    assert single("joint_mass").effects[0].values == single("joint_mass").effects[0].values
    lengths = {draw_random_case(seed, CaseKind.NONE).campaign.drawing.beam.length for seed in range(12)}
    assert len(lengths) == 3
    assert len(draw_random_case(1, CaseKind.FIVE).effects) == 5
    for seed in range(40):
        names = {effect.name for effect in draw_random_case(seed, CaseKind.FIVE).effects}
        assert all(len(names & group) < 2 for group in ALIKE)
    with pytest.raises(ValueError, match="a single case has 1"):
        draw_random_case(1, CaseKind.SINGLE, ["joint_mass", "density"])


def test_a_rising_function_rises_from_nothing_to_all() -> None:
    values = draw_curve(np.random.default_rng(3), "it")
    found = rising(np.exp(curve(values, "it", GRID)), np.linspace(0.0, 1.0, 50))
    assert (found[0], found[-1]) == (0.0, 1.0)
    assert np.all(np.diff(found) > 0.0)


def test_cylinders_that_lean_apart_bring_the_tester_their_mean_lean() -> None:
    case = single("cylinder_angle").repeatable()
    own = case.effects[0]
    alike = replace(own, values=dict(own.values) | {"splay_deg": 0.0})
    apart, together, without = (
        simulate(replace(case, effects=effects), frequency=COARSE).stiffness for effects in ((own,), (alike,), ())
    )
    assert percent(without, apart) > 1.0
    assert percent(together, apart) < 0.01


def test_pressure_at_one_point_beside_a_joint_is_a_joint_there() -> None:
    """Compared with the transform of a stiffness matrix to another place on a rigid section."""
    own = single("contact_patch").effects[0]
    patch = replace(own, values=dict(own.values) | {"held": 0.04, "first": 0.05, "second": 0.05**2})
    joint = np.array([[5.0, 2.0, 0.1], [2.0, 7.0, 0.3], [0.1, 0.3, 0.02]]) * (1 + 0.1j)
    stiffness: Complex = np.asarray(np.kron(np.eye(2), joint)[None], dtype=np.complex128)
    moved = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.04 * 0.05], [0.0, 0.0, 1.0]])
    expected = np.kron(np.eye(2), moved.T @ joint @ moved)[None]
    case = single("contact_patch")
    np.testing.assert_allclose(patch.joints(stiffness, case.article, np.ones(1, dtype=complex)), expected, rtol=1e-12)


@pytest.mark.parametrize("name", ["amplitude_dependence", "coulomb_friction"])
def test_joints_follow_how_each_blow_moves_each_of_them(name: str) -> None:
    case = single(name).repeatable()
    built = BuiltCase.of(case)
    near, far = (row for row in ROWS if row.name in ("3y", "9y"))
    force = built.campaign.setups[0].peak_force
    strong = replace(case.campaign, setups=tuple(replace(each, peak_force=4 * force) for each in case.campaign.setups))
    stand, harder = Stand(built, COARSE), Stand(BuiltCase.of(replace(case, campaign=strong)), COARSE)
    loads = np.array([built.campaign.straight(row).in_plane(stand.modes) for row in (near, far)])
    soft = np.array(stand._felt(0, (near, far), loads, force))
    hard = np.array(harder._felt(0, (near, far), loads, 4 * force))
    # node 3 is beside joint I: a blow there moves it more than a blow at node 9 does, and joint II less
    assert soft[0, 0].max() > soft[1, 0].max()
    assert soft[0, 1].max() < soft[1, 1].max()
    assert np.all(hard > 2.5 * soft)
    assert 1e-8 < soft.min() < soft.max() < 1e-3


@pytest.mark.parametrize("amplitude", [50e-6, 100e-6, 500e-6])
def test_a_spring_that_softens_is_a_spring_at_any_amplitude(amplitude: float) -> None:
    """100 um is that of the long bench's tester; seed 16 had a negative stiffness there."""
    size = np.full(1, amplitude)
    state = CylinderState(True, "I", np.full(1, 50.0), size, np.ones(1), np.zeros(1))
    rubber: Complex = np.full((1, 3), 1e6 + 1e5j)
    drawn = [draw_random_case(seed, CaseKind.SINGLE, ["cubic_stiffness"]) for seed in range(60)]
    drawn += [draw_case(seed, CaseKind.SINGLE, ["cubic_stiffness"], 1.0) for seed in range(20)]
    for case in drawn:
        found = case.effects[0].cylinder(rubber, state)
        assert np.all(found.real > 0.19e6), case.effects[0].values
        assert np.all(found.imag == rubber.imag)


def test_a_joint_is_deformed_by_what_its_foundation_leaves_of_the_motion() -> None:
    """Against the force through the joint over its stiffness."""
    softening, foundation = (single(name).effects[0] for name in ("amplitude_dependence", "foundation_compliance"))
    values = dict(foundation.values) | {"k_1": 4e5, "f_1": 3000.0, "k_2": 1e9, "f_2": 3000.0, "joint": "I"}
    soft = replace(foundation, values=values)  # a spring beneath the joint, softer than it
    case = replace(single("amplitude_dependence").repeatable(), effects=(softening, soft))
    stand = Stand(BuiltCase.of(case), COARSE)
    row, force = ROWS[1], case.campaign.setups[0].peak_force
    load = stand._load(row, 0, case.campaign.straight(row)).in_plane(stand.modes)
    (felt,) = stand._felt(0, (row,), load[None], force)
    held = stand.support_stiffness(0, 1 / 8, force, felt)
    through = (held @ stand._beam.motion(load, held)[..., None])[..., 0]
    bare = Stand(BuiltCase.of(replace(case, effects=(softening,))), COARSE)
    alone = bare.support_stiffness(0, 1 / 8, force, felt)
    pulse = half_sine_spectrum(COARSE, force, case.campaign.pulse_width)
    deformation: Complex = np.asarray(np.linalg.solve(alone, through[..., None])[..., 0] * pulse[:, None])
    assert felt is not None
    np.testing.assert_allclose(stand._amplitudes(deformation), felt, rtol=0.01)


def test_a_window_of_the_records_changes_no_motion_of_a_joint() -> None:
    case = single("amplitude_dependence").repeatable()
    window = single("exponential_window").effects[0]
    straight = case.campaign.straight(ROWS[1])
    bare, windowed = (
        stand._felt(0, ROWS[1:2], straight.in_plane(stand.modes)[None], 100.0)
        for effects in (case.effects, (*case.effects, window))
        for stand in [Stand(BuiltCase.of(replace(case, effects=effects)), COARSE)]
    )
    np.testing.assert_array_equal(windowed, bare)


def test_set_ups_configurations_and_an_error_differ_as_much_as_is_stated() -> None:
    found = [draw_random_case(seed, CaseKind.NONE).campaign for seed in range(60)]
    nuisances = [each.nuisances for each in found if each.nuisances]
    assert len(nuisances) == len(found)
    ratios = [(each.stiffness - 1.0) / each.deviations["setup_scatter"] for each in nuisances]
    assert np.std(np.concatenate([each.ravel() for each in ratios])) == pytest.approx(0.9, abs=0.1)
    for campaign in found:
        own = campaign.nuisances
        assert own is not None
        stated = stated_setup(campaign)["tolerances"]
        assert isinstance(stated, dict)
        assert own.stated == ("model_error" in stated)
    assert 15 < sum(each.stated for each in nuisances) < 45


def test_the_error_is_smooth_over_its_coherence_and_as_large_as_it_says() -> None:
    own = draw_random_case(7, CaseKind.NONE).campaign.nuisances
    assert own is not None
    frequency: Real = 0.5 * np.arange(1.0, 2049.0)
    errors = np.array([own.error(row, 0, frequency) - 1.0 for row in range(9)])
    assert np.sqrt(np.mean(np.abs(errors) ** 2)) == pytest.approx(own.deviations["model_error"], rel=0.2)
    apart = round(own.coherence / 0.5)
    near, far = (
        np.mean(errors[:, lines:] * np.conj(errors[:, :-lines])).real / np.mean(np.abs(errors) ** 2)
        for lines in (2, 4 * apart)
    )
    assert near > 0.95
    assert abs(far) < 0.3


def test_the_error_is_one_function_at_whatever_lines_it_is_asked_for() -> None:
    """As for a record, which reaches to 2048 Hz, and for the instruments, whose lines lie elsewhere."""
    own = draw_random_case(7, CaseKind.NONE).campaign.nuisances
    assert own is not None
    lines: Real = 0.5 * np.arange(1.0, 2049.0)
    filed, size = own.error(3, 0, lines), own.deviations["model_error"]
    further = own.error(3, 0, 0.5 * np.arange(1.0, 16001.0))
    np.testing.assert_allclose(further[:2048], filed, atol=1e-12)
    assert np.sqrt(np.mean(np.abs(further[2048:] - 1.0) ** 2)) == pytest.approx(size, rel=0.3)
    np.testing.assert_allclose(own.error(3, 0, 3.0 * np.arange(1.0, 300.0)), filed[5:1794:6], atol=1e-12)
    between = own.error(3, 0, np.array([100.25]))
    assert abs(between[0] - (filed[199] + filed[200]) / 2) < 1e-3 * size


def test_the_floor_counts_new_set_ups_and_the_error() -> None:
    case = draw_random_case(8, CaseKind.NONE)
    own = case.campaign.nuisances
    assert own is not None
    floors = [floor_percent(each) for each in (case, case.repeatable())]
    assert floors[0] > np.hypot(floors[1], 100 * own.deviations["model_error"])


def test_a_truth_can_be_sealed(tmp_path: Path) -> None:
    case = draw_random_case(9, CaseKind.TRIPLE)
    found = truth(case)
    json.dumps(found, allow_nan=False)
    assert len(found["effects"]) == 3  # type: ignore[arg-type]  # a truth is JSON: its values are objects
    write_case(case, tmp_path)
    assert (tmp_path / "direct.csv").exists()
