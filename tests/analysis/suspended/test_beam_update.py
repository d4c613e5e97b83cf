from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import FrequencyResponses, Real
from analysis.interval import Estimate
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.inverse.tolerances import Tolerances
from analysis.structure.beam import Beam, Mesh, Theory, assemble
from analysis.structure.forward import accelerance
from analysis.suspended.beam_identifiability import MODULUS_BY_DENSITY, SLENDER, confounded_pairs, statements
from analysis.suspended.beam_update import (
    PARAMETERS,
    BeamTolerances,
    BeamUpdate,
    Material,
    free_frequencies,
    material_of,
    update_beam,
)
from analysis.suspended.free_modes import ElasticModes
from simlab import beam as simlab_beam

STEEL = Beam(0.914, 0.0254, 0.0508, 207e9, 0.3, 7850.0)
BENDING = (3, 4, 5)


def frequencies_of(beam: Beam, theory: Theory, masses: dict[int, float], places: tuple[int, ...] = BENDING) -> Real:
    mesh = Mesh.through(beam.length * np.array([0.0, 0.06, 0.3, 0.5, 0.77, 1.0]), 2)
    return free_frequencies(beam, mesh, places, theory, masses)[0]


@settings(max_examples=15, deadline=None)
@given(
    slenderness=st.floats(0.01, 0.15),
    poisson_ratio=st.floats(0.0, 0.45),
    theory=st.sampled_from(Theory),
    mass=st.floats(0.0, 0.2),
)
def test_slopes_are_those_of_a_high_order_difference(
    slenderness: float, poisson_ratio: float, theory: Theory, mass: float
) -> None:
    beam = replace(STEEL, height=slenderness * STEEL.length, poisson_ratio=poisson_ratio)
    mesh = Mesh.through(beam.length * np.array([0.0, 0.06, 0.3, 0.5, 0.77, 1.0]), 2)
    masses = {2: mass, 5: mass / 2}
    _, slopes = free_frequencies(beam, mesh, BENDING, theory, masses)
    step = 2e-3
    around = frequencies_of(beam, theory, masses, (*BENDING, BENDING[-1] + 1))
    assume(np.all(np.diff(np.log(around)) > 10 * step))  # modes whose order the steps change have no slope here
    for column, name in enumerate(PARAMETERS):
        up2, up, down, down2 = (
            np.log(frequencies_of(replace(beam, **{name: getattr(beam, name) * np.exp(k * step)}), theory, masses))
            for k in (2, 1, -1, -2)
        )
        differences = (8 * (up - down) - (up2 - down2)) / (12 * step)
        np.testing.assert_allclose(slopes[:, column], differences, atol=3e-8)  # rounding of f over the step


def test_the_slopes_of_a_longitudinal_mode_are_those_of_a_rod() -> None:
    mesh = Mesh.through(np.linspace(0, STEEL.length, 11), 2)
    wave = np.sqrt(STEEL.youngs_modulus / STEEL.density) / (2 * STEEL.length)
    places = tuple(range(3, 12))
    found, slopes = free_frequencies(STEEL, mesh, places)
    rod = int(np.argmin(np.abs(found - wave)))
    assert found[rod] == pytest.approx(wave, rel=2e-3)
    np.testing.assert_allclose(slopes[rod], [0.5, -0.5, -1, 0, 0], atol=1e-9)


@settings(max_examples=15, deadline=None)
@given(
    modulus=st.floats(0.3, 3.0),
    density=st.floats(0.3, 3.0),
    length=st.floats(0.5, 2.0),
    height=st.floats(0.5, 2.0),
    width=st.floats(0.5, 2.0),
)
def test_frequencies_of_a_slender_bar_follow_the_root_of_e_by_rho_times_height_by_length_squared(
    modulus: float, density: float, length: float, height: float, width: float
) -> None:
    slender = replace(STEEL, height=1e-3 * STEEL.length)
    other = Beam(
        slender.length * length,
        slender.height * height,
        slender.width * width,
        slender.youngs_modulus * modulus,
        0.3,
        slender.density * density,
    )
    ratio = frequencies_of(other, Theory.TIMOSHENKO, {}) / frequencies_of(slender, Theory.TIMOSHENKO, {})
    # shear and rotary inertia lower mode 6 by (h/L)^2 times 34: Timoshenko's first correction
    np.testing.assert_allclose(ratio, np.sqrt(modulus / density) * height / length**2, rtol=6e-4)


def test_shear_and_rotary_inertia_make_a_stocky_bar_follow_its_height_less_than_a_slender_one() -> None:
    mesh = Mesh.through(np.linspace(0, STEEL.length, 11), 2)
    slopes = free_frequencies(STEEL, mesh, BENDING)[1]
    assert np.all(np.diff(slopes[:, 3]) < 0)
    assert 0.95 < slopes[2, 3] < 0.98
    np.testing.assert_allclose(slopes[:, 2] + slopes[:, 3], -1, atol=1e-12)  # of h and L, only h/L and 1/L
    np.testing.assert_allclose(
        free_frequencies(STEEL, mesh, BENDING, Theory.EULER_BERNOULLI)[1], [[0.5, -0.5, -2, 1, 0]] * 3, atol=1e-9
    )


BEAM = Beam(0.914, 0.0254, 0.0508, 207e9, 0.3, 7850.0)
NODES = np.array([0.0, 0.06, 0.2, 0.4, 0.6, 0.8, 0.94, 1.0])
EXACT = 1e-8  # relative error of frequencies that are as good as exact
ONLY_MATERIAL = BeamTolerances(0.005, 0.003, 0.0, 0.0, 0.0, frequency=0.0)
CALLIPERS = BeamTolerances(frequency=0.0)


def mesh_of(beam: Beam) -> Mesh:
    return Mesh.through(NODES * beam.length, 1)


def seen(frequency: Real, error: float = EXACT) -> ElasticModes:
    """Measured elastic modes 4, 5, ... with this relative error of every frequency."""
    count = frequency.size
    errors = np.stack([error * frequency, np.full(count, 1e-5)], axis=1).ravel()
    return ElasticModes(
        numbers=tuple(range(4, 4 + count)),
        frequency=frequency,
        damping_ratio=np.full(count, 0.001),
        covariance=np.diag(errors**2),
        suspension_shift=np.zeros(count),
        suspension_modes=(),
        others=(),
    )


def frequencies(beam: Beam, modes: int = 3, theory: Theory = Theory.TIMOSHENKO) -> Real:
    return free_frequencies(beam, mesh_of(beam), range(3, 3 + modes), theory)[0]


def weight(beam: Beam) -> float:
    return beam.density * beam.area * beam.length


def changed(**relative: float) -> Beam:
    return replace(BEAM, **{name: getattr(BEAM, name) * (1 + share) for name, share in relative.items()})


def update(true: Beam, tolerances: BeamTolerances, weighed: Estimate | None = None) -> BeamUpdate:
    return update_beam(seen(frequencies(true)), BEAM, mesh_of(BEAM), tolerances, weighed=weighed)


relative = st.floats(-0.01, 0.01)


@settings(max_examples=20, deadline=None)
@given(modulus=relative, density=relative)
def test_e_by_rho_is_recovered_from_exact_frequencies_while_e_and_rho_alone_stay_at_their_tolerances(
    modulus: float, density: float
) -> None:
    true = changed(youngs_modulus=modulus, density=density)
    found = update(true, ONLY_MATERIAL)
    ratio = found.combination(MODULUS_BY_DENSITY)
    assert ratio.value == pytest.approx(true.youngs_modulus / true.density, rel=3e-8)
    assert ratio.standard_error / ratio.value < 3 * EXACT
    # two parameters of which only the difference is known: the best split is by their variances
    of_modulus, of_density = 0.005**2, 0.003**2
    difference = np.log((1 + modulus) / (1 + density))
    assert np.log(found.beam.youngs_modulus / BEAM.youngs_modulus) == pytest.approx(
        difference * of_modulus / (of_modulus + of_density), abs=1e-7
    )
    alone = np.sqrt(1 / (1 / of_modulus + 1 / of_density))
    for name in ("youngs_modulus", "density"):
        estimate = found.parameter(name)
        assert estimate.standard_error / estimate.value == pytest.approx(alone, rel=1e-6)
    assert found.correlation("youngs_modulus", "density") == pytest.approx(1, abs=1e-9)
    assert confounded_pairs(found)[0].cosine == pytest.approx(-1, abs=1e-12)


@settings(max_examples=20, deadline=None)
@given(modulus=relative, density=relative)
def test_a_balance_tells_the_density_from_youngs_modulus(modulus: float, density: float) -> None:
    true = changed(youngs_modulus=modulus, density=density)
    found = update(true, ONLY_MATERIAL, weighed=Estimate(weight(true), EXACT))
    assert found.beam.youngs_modulus == pytest.approx(true.youngs_modulus, rel=1e-7)
    assert found.beam.density == pytest.approx(true.density, rel=1e-7)


@settings(max_examples=20, deadline=None)
@given(modulus=relative, height=relative)
def test_a_stocky_bar_tells_its_height_from_its_modulus_if_frequencies_and_theory_are_exact(
    modulus: float, height: float
) -> None:
    true = changed(youngs_modulus=modulus, height=height)
    only_two = BeamTolerances(0.01, 0.0, 0.0, 0.01 * BEAM.height, 0.0, frequency=0.0)
    found = update(true, only_two)
    for name in PARAMETERS:
        assert getattr(found.beam, name) == pytest.approx(getattr(true, name), rel=2e-6)
    assert found.misfit == pytest.approx(np.zeros(3), abs=1e-8)


@settings(max_examples=15, deadline=None)
@given(st.tuples(relative, relative, relative, relative, relative))
def test_whatever_the_bar_the_combination_of_a_slender_one_is_known_and_the_frequencies_come_back(
    shares: tuple[float, float, float, float, float],
) -> None:
    true = changed(**dict(zip(PARAMETERS, shares, strict=True)))
    generous = BeamTolerances(0.01, 0.01, 0.01 * BEAM.length, 0.01 * BEAM.height, 0.01 * BEAM.width, frequency=1e-5)
    found = update(true, generous)
    np.testing.assert_allclose(found.frequency, frequencies(true), rtol=3e-5)
    np.testing.assert_allclose(found.frequency, frequencies(found.beam), rtol=1e-10)
    slender = found.combination(SLENDER)
    true_slender = np.prod([getattr(true, name) ** power for name, power in SLENDER.items()])
    assert abs(slender.value - true_slender) < 4 * slender.standard_error
    assert slender.standard_error / slender.value < 1e-3  # of 0.02 beforehand
    assert found.mesh.positions[-1] == pytest.approx(found.beam.length, rel=1e-14)


def test_intervals_cover_and_chi_square_is_one_a_datum_when_bars_scatter_as_their_tolerances_say() -> None:
    rng = np.random.default_rng(20261)
    tolerances, error = BeamTolerances(frequency=1e-4), 5e-5
    prior = tolerances.relative(BEAM)
    runs, covered, chi_square = 600, np.zeros(len(PARAMETERS)), []
    for _ in range(runs):
        shares = np.exp(prior * rng.standard_normal(prior.size)) - 1
        true = changed(**dict(zip(PARAMETERS, shares.tolist(), strict=True)))
        data = frequencies(true) * np.exp(np.hypot(error, tolerances.frequency) * rng.standard_normal(3))
        found = update_beam(seen(data, error), BEAM, mesh_of(BEAM), tolerances)
        chi_square.append(found.chi_square)
        for place, name in enumerate(PARAMETERS):
            low, high = found.parameter(name).interval()
            covered[place] += low <= getattr(true, name) <= high
    three_deviations = 3 * np.sqrt(0.95 * 0.05 / runs)
    assert np.all(np.abs(covered / runs - 0.95) < three_deviations)
    assert np.mean(chi_square) == pytest.approx(3, abs=3 * np.sqrt(6 / runs))


def test_the_covariance_is_the_inverse_of_fisher_information_and_prior() -> None:
    found = update_beam(seen(frequencies(BEAM), 2e-4), BEAM, mesh_of(BEAM), BeamTolerances(frequency=1e-4))
    prior = BeamTolerances().relative(BEAM)
    information = found.slopes.T @ found.slopes / (4e-8 + 1e-8) + np.diag(1 / prior**2)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(information), rtol=1e-7, atol=1e-14)


def test_an_exact_drawing_that_is_right_leaves_nothing_to_do() -> None:
    found = update(BEAM, CALLIPERS)
    np.testing.assert_allclose(found.deviations_used, 0, atol=1e-6)
    assert found.chi_square < 1e-6
    assert found.consistent


def test_a_bar_computed_by_other_means_is_recovered_within_its_interval() -> None:
    """By a Ritz series instead of elements, on the default mesh."""
    true = changed(youngs_modulus=0.007)
    simulated = simlab_beam.SimulatedBeam(
        true.length, true.height, true.width, true.youngs_modulus, true.poisson_ratio, true.density
    )
    data = simlab_beam.free_modes(simulated).frequency[3:6]
    only_modulus = BeamTolerances(0.01, 0.0, 0.0, 0.0, 0.0)
    found = update_beam(seen(data), BEAM, Mesh.through(np.linspace(0, BEAM.length, 11)), only_modulus)
    low, high = found.parameter("youngs_modulus").interval()
    assert low < true.youngs_modulus < high
    assert (high - low) / true.youngs_modulus < 6e-4
    assert found.consistent


def test_the_six_modes_of_a_recorded_free_beam_are_those_of_a_slender_bar_to_a_third_of_a_percent() -> None:
    """Hz, what three tools find in a published record; material and dimensions are not told, so they are loose."""
    recorded = np.array([51.5, 142.18, 278.66, 460.39, 687.16, 958.5])
    drawn = replace(BEAM, length=1.0, height=0.01)
    loose = BeamTolerances(youngs_modulus=0.3, height=0.002, frequency=0.002)
    found = update_beam(seen(recorded, 1e-4), drawn, Mesh.through(np.linspace(0, 1, 11)), loose)
    assert np.max(np.abs(found.misfit)) < 0.0033
    assert found.consistent


def test_point_masses_are_not_taken_for_density() -> None:
    masses = {3: 0.03, 7: 0.01}
    true = changed(youngs_modulus=0.004)
    data = free_frequencies(true, mesh_of(true), (3, 4, 5), point_masses=masses)[0]
    found = update_beam(seen(data), BEAM, mesh_of(BEAM), ONLY_MATERIAL, point_masses=masses)
    assert found.combination(MODULUS_BY_DENSITY).value == pytest.approx(true.youngs_modulus / true.density, rel=1e-4)
    without = update_beam(seen(data), BEAM, mesh_of(BEAM), ONLY_MATERIAL)
    assert not without.consistent


def test_a_bar_beyond_its_tolerances_is_said_to_disagree() -> None:
    found = update(changed(height=0.02), BeamTolerances())
    assert not found.consistent
    assert found.p_value < 1e-4
    sentence = statements(found)[0]
    assert sentence.startswith("frequencies and tolerances disagree, so no interval here can be relied on")
    assert "the best beam has its Young's modulus +3.4 tolerances off" in sentence  # the twin with the wider tolerance


def test_a_measurement_within_its_tolerances_is_not_said_to_disagree() -> None:
    assert not any("disagree" in text for text in statements(update(changed(height=0.001), BeamTolerances())))


def test_what_frequencies_do_not_say_is_said() -> None:
    said = " | ".join(statements(update(BEAM, BeamTolerances())))
    assert "show as the ratio E / rho" in said
    assert "weigh the beam" in said
    assert "width does not show in these frequencies" in said
    assert "Young's modulus and density (cosine -1.0000" in said
    weighed = statements(update(BEAM, BeamTolerances(), weighed=Estimate(weight(BEAM), 1e-3)))
    assert not any("weigh the beam" in text for text in weighed)
    exact = " | ".join(statements(update(BEAM, replace(BeamTolerances(), width=0.0))))
    assert "width was taken to be exact" in exact


def test_nothing_loose_is_refused() -> None:
    with pytest.raises(AnalysisError, match="every tolerance of the beam is zero"):
        update(BEAM, BeamTolerances(0, 0, 0, 0, 0))


def test_frequencies_without_any_error_are_refused() -> None:
    with pytest.raises(AnalysisError, match="state a tolerance of frequency"):
        update_beam(seen(frequencies(BEAM), 0.0), BEAM, mesh_of(BEAM), CALLIPERS)


@pytest.mark.parametrize("value", [-0.1, float("inf"), float("nan")])
def test_an_impossible_tolerance_is_refused_by_name(value: float) -> None:
    with pytest.raises(AnalysisError, match="tolerance height is"):
        BeamTolerances(height=value)


if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

RATIOS = (0.004, 0.001, 0.001)
FREQUENCY = np.arange(20.0, 1025.0, 4.0)
NOISE = 0.003
STATED = Tolerances(sensor_gain=0.005, youngs_modulus=0.005, density=0.003)


@dataclass(frozen=True)
class Test:
    """The beam as it is, as drawn, and what its free frequencies and a balance say."""

    __test__ = False

    true: Beam
    drawn: Beam
    nodes: Real
    update: BeamUpdate


@pytest.fixture(scope="module")
def suspended(paper_beam: Beam, bench: Bench) -> Test:
    """A beam two per cent stiffer than drawn, and a little off in size and density."""
    nodes = bench.free_beam.mesh.positions[list(bench.free_beam.mesh.named)]
    true = replace(paper_beam, youngs_modulus=1.02 * 207e9, density=0.998 * 7850.0, height=1.0015 * paper_beam.height)
    frequency = assemble(true, Mesh.through(nodes, 16)).frequency[3:6]
    errors = np.stack([1e-5 * frequency, np.full(3, 1e-5)], axis=1).ravel()
    none = np.zeros(3)
    seen = ElasticModes((4, 5, 6), frequency, np.array(RATIOS), np.diag(errors**2), none, (), ())
    weighed = Estimate(true.density * true.area * true.length, 5e-4)
    mesh = Mesh.through(nodes, 8)
    return Test(true, paper_beam, nodes, update_beam(seen, paper_beam, mesh, BeamTolerances(), weighed=weighed))


@pytest.fixture(scope="module")
def material(suspended: Test) -> Material:
    return material_of(suspended.update)


@pytest.fixture(scope="module")
def measured(suspended: Test, bench: Bench) -> FrequencyResponses:
    """The true beam on its joints."""
    free = assemble(suspended.true, Mesh.through(suspended.nodes, 16), damping_ratios=RATIOS)
    exact = accelerance(free, bench.joints, FREQUENCY, Dof.parse("3y"), bench.inputs)
    parts = np.random.default_rng(5).standard_normal((2, *exact.accelerance.shape))
    return replace(
        exact,
        accelerance=exact.accelerance + NOISE * (parts[0] + 1j * parts[1]),
        variance=np.full(exact.accelerance.shape, NOISE**2),
    )


def fitted(suspended: Test, bench: Bench, measured: FrequencyResponses, beam: Beam, tolerances: Tolerances) -> JointFit:
    free = assemble(beam, Mesh.through(suspended.nodes, 12), damping_ratios=RATIOS)
    return identify_from_responses(free, measured, bench.joints, tolerances=tolerances)


def errors(fit: JointFit, bench: Bench) -> tuple[Real, Real]:
    """(4,) relative errors of k12 and k22 of both joints, and half-widths of their intervals."""
    error, half = [], []
    for joint in bench.joints:
        found, true = fit.joints[joint.name], joint.dynamic_stiffness.real
        for place in ((0, 1), (1, 1)):
            error.append(found.stiffness[place] / true[place] - 1)
            half.append(np.ptp(found.k_ci95[place]) / 2 / abs(true[place]))
    return np.array(error), np.array(half)


def test_the_bar_bends_and_weighs_as_the_true_one(suspended: Test, material: Material) -> None:
    true, drawn = suspended.true, suspended.drawn
    bends, weighs = (
        (beam.youngs_modulus * beam.height**3, beam.density * beam.height) for beam in (true, material.of(drawn))
    )
    assert weighs == pytest.approx(bends, rel=2e-4)
    assert material.density.standard_error / material.density.value == pytest.approx(5e-4 / 9.3, rel=0.1)
    # one by one they are known to no more than their tolerances
    assert suspended.update.parameter("density").standard_error > 10 * material.density.standard_error


def test_without_a_balance_modulus_and_density_share_their_error(suspended: Test) -> None:
    update = suspended.update
    seen = np.exp(np.log(update.frequency) + update.misfit)
    covariance = np.kron(np.diag((1e-5 * seen) ** 2), np.diag([1.0, 0.0])) + np.kron(np.eye(3), np.diag([0.0, 1e-10]))
    none = np.zeros(3)
    modes = ElasticModes((4, 5, 6), seen, np.array(RATIOS), covariance, none, (), ())
    mesh = Mesh.through(suspended.nodes, 8)
    material = material_of(update_beam(modes, suspended.drawn, mesh, BeamTolerances()))
    relative = material.youngs_modulus.standard_error / material.youngs_modulus.value
    assert 0.003 < relative < 0.01
    assert material.correlation > 0.999


def test_joints_are_right_on_a_bar_two_per_cent_stiffer_than_drawn(
    suspended: Test, material: Material, measured: FrequencyResponses, bench: Bench
) -> None:
    as_stated, _ = errors(fitted(suspended, bench, measured, suspended.drawn, STATED), bench)
    modulus, density = (each.standard_error / each.value for each in (material.youngs_modulus, material.density))
    known = replace(STATED, youngs_modulus=modulus, density=density, material_correlation=material.correlation)
    found, half = errors(fitted(suspended, bench, measured, material.of(suspended.drawn), known), bench)
    assert np.max(np.abs(as_stated)) > 0.005
    assert np.max(np.abs(found)) < 0.001
    assert np.all(np.abs(found) < 1.5 * half)
    assert np.max(half[[1, 3]]) < 0.001  # k22: weighed, the beam is a standard of stiffness, and gain counts no longer
