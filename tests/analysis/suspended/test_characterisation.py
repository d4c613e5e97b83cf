from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.interval import Estimate
from analysis.modal.estimation import ModalEstimate, estimate_modes
from analysis.modal.modal_model import DampingKind
from analysis.modes import Modes, poles_from
from analysis.structure.beam import Beam, FreeBeam, Mesh, assemble
from analysis.structure.forward import accelerance, eigensolution
from analysis.structure.joints import Joint
from analysis.suspended.beam_update import BeamTolerances
from analysis.suspended.characterisation import FreeBeamResult, characterise_free_beam, rayleigh_damping
from analysis.suspended.free_modes import BeamSuspension

OMEGA = 2 * np.pi * np.array([160.0, 439.0, 856.0])


@given(alpha=st.floats(0.1, 20), beta=st.floats(1e-8, 1e-5), share=st.floats(1e-4, 0.05))
def test_rayleigh_damping_is_found_and_described(alpha: float, beta: float, share: float) -> None:
    ratios = alpha / (2 * OMEGA) + beta * OMEGA / 2
    found = rayleigh_damping(OMEGA, ratios, np.diag((share * ratios) ** 2))
    assert found.mass_factor.value == pytest.approx(alpha, rel=1e-6)
    assert found.stiffness_factor.value == pytest.approx(beta, rel=1e-6)
    assert found.describes is True
    assert found.worst_share < 1e-6
    assert "describes the damping" in found.text


def test_the_standard_errors_are_the_scatter_of_repeated_fits() -> None:
    truth = 5.0 / (2 * OMEGA) + 1e-6 * OMEGA / 2
    covariance = np.outer(0.02 * truth, 0.02 * truth) * (0.7 * np.eye(3) + 0.3)
    noise = np.random.default_rng(5).multivariate_normal(np.zeros(3), covariance, size=2000)
    fits = [rayleigh_damping(OMEGA, truth + each, covariance) for each in noise]
    for name in ("mass_factor", "stiffness_factor"):
        scatter = np.std([getattr(fit, name).value for fit in fits])
        assert getattr(fits[0], name).standard_error == pytest.approx(scatter, rel=0.05)
    assert np.mean([fit.chi_square for fit in fits]) == pytest.approx(1, abs=0.1)
    assert np.mean([fit.describes is True for fit in fits]) > 0.98


def test_the_damping_printed_in_table_1_is_not_rayleighs_if_it_is_known_to_a_few_per_cent() -> None:
    ratios = np.array([0.004, 0.001, 0.001])
    found = rayleigh_damping(OMEGA, ratios, np.diag((0.05 * ratios) ** 2))
    assert found.describes is False
    assert "does not describe" in found.text
    assert "mode by mode" in found.text


def test_neither_factor_is_negative() -> None:
    falling_too_fast = np.array([0.004, 0.0005, 0.0001])
    found = rayleigh_damping(OMEGA, falling_too_fast, np.diag([1e-8, 1e-8, 1e-8]))
    assert found.stiffness_factor.value == 0
    assert found.mass_factor.value > 0


def test_two_modes_leave_the_question_open() -> None:
    found = rayleigh_damping(OMEGA[:2], np.array([0.004, 0.001]), np.diag([1e-10, 1e-10]))
    assert found.describes is None
    assert "a third mode would test" in found.text


def test_one_mode_is_refused() -> None:
    with pytest.raises(AnalysisError, match="measure two or more"):
        rayleigh_damping(OMEGA[:1], np.array([0.004]), np.array([[1e-10]]))


POINTS = tuple(map(Dof.parse, ["1y", "3y", "4y", "5y", "6y", "7y", "8y", "9y", "11y"]))
DAMPING = (0.004, 0.001, 0.001)
HUNG_AT = (2, 10)
BOUNCE = 5.0  # Hz


@pytest.fixture(scope="module")
def nodes(paper_beam: Beam) -> Real:
    return np.linspace(0, paper_beam.length, 11)


@pytest.fixture(scope="module")
def true_bar(paper_beam: Beam) -> Beam:
    """Within the tolerances of the drawing."""
    return replace(paper_beam, youngs_modulus=1.004 * 207e9, density=0.998 * 7850.0, height=0.02543)


@pytest.fixture(scope="module")
def suspension(nodes: Real) -> BeamSuspension:
    return BeamSuspension(BOUNCE, standard_error=0.05, positions=tuple(nodes[node - 1] for node in HUNG_AT))


@pytest.fixture(scope="module")
def hanging(true_bar: Beam, nodes: Real) -> tuple[FreeBeam, list[Joint]]:
    free = assemble(true_bar, Mesh.through(nodes, 8), damping_ratios=DAMPING)
    spring = true_bar.density * true_bar.area * true_bar.length * (2 * np.pi * BOUNCE) ** 2 / 2
    return free, [Joint(str(node), node, np.diag([1.0, spring, 0]).astype(complex)) for node in HUNG_AT]


@pytest.fixture(scope="module")
def estimate(hanging: tuple[FreeBeam, list[Joint]]) -> ModalEstimate:
    """Modes from noisy accelerances of the beam in its springs."""
    free, springs = hanging
    clean = accelerance(free, springs, np.linspace(20.0, 1024.0, 2009), Dof.parse("3y"), POINTS)
    rng = np.random.default_rng(7)
    sigma = 0.003
    parts = sigma * rng.standard_normal((2, *clean.accelerance.shape))
    noisy = replace(
        clean,
        accelerance=clean.accelerance + parts[0] + 1j * parts[1],
        variance=np.full(clean.accelerance.shape, sigma**2),
    )
    return estimate_modes(noisy, band=(20.0, 1024.0), damping=DampingKind.VISCOUS)


@pytest.fixture(scope="module")
def result(estimate: ModalEstimate, paper_beam: Beam, nodes: Real, suspension: BeamSuspension) -> FreeBeamResult:
    return characterise_free_beam(estimate.modes, paper_beam, Mesh.through(nodes), suspension=suspension)


def exact_modes(free: FreeBeam, modes: int = 3) -> Modes:
    """Of the free beam, with errors that say little about them."""
    places = slice(3, 3 + modes)
    ratios = free.damping_rate[places] / (2 * np.sqrt(free.squared_frequency[places]))
    rows = [free.mesh.degree(point) for point in POINTS]
    frequency = free.frequency[places]
    errors = np.stack([1e-4 * frequency, np.full(modes, 1e-5)], axis=1).ravel()
    poles = 2 * np.pi * frequency * (-ratios + 1j * np.sqrt(1 - ratios**2))
    return Modes(poles, free.shapes[rows, places].T.astype(complex), POINTS, np.diag(errors**2))


def test_table_1_has_its_printed_theories_beside_the_experiment(paper_beam: Beam, nodes: Real) -> None:
    """On the paper's ten elements; the experiment is its own, 161, 441 and 858 Hz, with half of the last digit."""
    mesh = Mesh.through(nodes, 1)
    frequency, ratios = np.array([161.0, 441.0, 858.0]), np.array(DAMPING)
    drawn = assemble(paper_beam, mesh)
    shapes = drawn.shapes[[drawn.mesh.degree(point) for point in POINTS], 3:6].T.astype(complex)
    errors = np.stack([np.full(3, 0.3), np.full(3, 3e-4)], axis=1).ravel()
    printed = Modes(poles_from(frequency, 2 * ratios), shapes, POINTS, np.diag(errors**2))
    found = characterise_free_beam(printed, paper_beam, mesh)
    assert [row.mode for row in found.table] == [4, 5, 6]
    np.testing.assert_allclose([row.timoshenko for row in found.table], [160.06, 439.13, 855.68], atol=0.01)
    np.testing.assert_allclose([row.euler_bernoulli for row in found.table], [160.5, 442.5, 868.1], atol=0.1)
    for row, hertz, ratio in zip(found.table, frequency, ratios, strict=True):
        assert row.experiment is not None
        assert row.damping_ratio is not None
        assert row.experiment.value == pytest.approx(hertz, rel=2e-5)
        assert row.experiment.half_width() == pytest.approx(1.96 * 0.3, rel=1e-3)
        assert row.damping_ratio.value == pytest.approx(ratio, rel=1e-3)
    assert found.update.consistent  # the paper's beam explains its own experiment within ordinary tolerances
    # its damping: 0.4, 0.1 and 0.1 %, here to +-0.03 % each
    assert any("does not describe" in text for text in found.statements)


def test_frequencies_and_damping_of_the_free_bar_come_out_of_a_suspended_one_within_their_intervals(
    result: FreeBeamResult, hanging: tuple[FreeBeam, list[Joint]]
) -> None:
    free, springs = hanging
    assert result.elastic.numbers == (4, 5, 6)
    for row, hertz, ratio in zip(result.table, free.frequency[3:6], DAMPING, strict=True):
        assert row.experiment is not None
        assert row.damping_ratio is not None
        assert abs(row.experiment.value - hertz) < 4 * row.experiment.standard_error
        assert abs(row.damping_ratio.value - ratio) < 4 * row.damping_ratio.standard_error
        assert row.experiment.standard_error / hertz < 1e-4
        assert row.damping_ratio.standard_error / ratio < 0.02
    raised = np.abs(eigensolution(free, springs, 300.0, POINTS).poles[-1]) / (2 * np.pi) - free.frequency[3]
    assert result.elastic.suspension_shift[0] == pytest.approx(raised, rel=1e-3)
    assert raised > 4 * np.sqrt(result.elastic.frequency_covariance[0, 0])  # or the test would not see it


def test_the_true_bar_lies_within_the_intervals_of_the_update(result: FreeBeamResult, true_bar: Beam) -> None:
    assert result.update.consistent
    for name in ("youngs_modulus", "density", "length", "height", "width"):
        low, high = result.update.parameter(name).interval()
        assert low < getattr(true_bar, name) < high
    rigidity = result.update.combination({"youngs_modulus": 1, "width": 1, "height": 3, "length": -3})
    assert abs(rigidity.value / 12 / true_bar.stiffness_unit[0, 0] - 1) < 3 * rigidity.standard_error / rigidity.value


def test_the_updated_bar_is_ready_for_the_identification_of_joints(result: FreeBeamResult) -> None:
    free, ratios = result.free_beam, np.array(result.damping_ratios)
    np.testing.assert_allclose(free.frequency[3:6], [row.updated for row in result.table])
    np.testing.assert_allclose(free.frequency[3:6], result.elastic.frequency, rtol=3e-4)
    np.testing.assert_allclose(free.damping_rate[3:6], 2 * ratios * 2 * np.pi * free.frequency[3:6])
    proportional = free.shapes.T @ free.damping @ free.shapes
    np.testing.assert_allclose(np.diag(proportional)[3:6], free.damping_rate[3:6], rtol=1e-9)
    assert free.mesh.positions[-1] == free.beam.length


def test_damping_that_no_rayleigh_law_gives_is_said_to_need_its_ratios(result: FreeBeamResult) -> None:
    assert any("use the damping ratios mode by mode" in text for text in result.statements)


def test_a_suspension_that_is_not_known_is_said_to_be_in_the_result(
    estimate: ModalEstimate, paper_beam: Beam, nodes: Real
) -> None:
    found = characterise_free_beam(estimate.modes, paper_beam, Mesh.through(nodes))
    assert found.statements[0].startswith("the suspension is not known")
    assert np.all(found.elastic.suspension_shift == 0)


def test_a_measured_rigid_mode_is_said_to_hide_a_shift(paper_beam: Beam, nodes: Real) -> None:
    free = assemble(paper_beam, Mesh.through(nodes), damping_ratios=DAMPING)
    exact = exact_modes(free)
    bounce = poles_from(np.array([8.0]), np.array([0.1]))
    rigid = free.shapes[[free.mesh.degree(point) for point in POINTS], 1][None].astype(complex)
    assert exact.pole_covariance is not None
    modes = Modes(
        np.concatenate([bounce, exact.poles]),
        np.vstack([rigid, exact.shapes]),
        POINTS,
        np.diag([1e-4, 1e-6, *np.diag(exact.pole_covariance)]),
    )
    found = characterise_free_beam(modes, paper_beam, Mesh.through(nodes))
    assert found.elastic.suspension_modes == pytest.approx((8.0,), rel=0.01)
    assert "a rigid mode at 8.02 Hz was measured" in found.statements[0]
    assert "by up to 0.005 (relative)" in found.statements[0]


def test_a_stiff_suspension_is_complained_of(paper_beam: Beam, nodes: Real) -> None:
    mesh = Mesh.through(nodes)
    modes = exact_modes(assemble(paper_beam, mesh, damping_ratios=DAMPING))
    found = characterise_free_beam(
        modes, paper_beam, mesh, BeamTolerances(youngs_modulus=0.1), suspension=BeamSuspension(20.0)
    )
    assert any("use springs that bounce below 10%" in text for text in found.statements)


def test_a_mode_that_was_missed_has_no_damping_and_that_is_said(paper_beam: Beam, nodes: Real) -> None:
    mesh = Mesh.through(nodes)
    exact = exact_modes(assemble(paper_beam, mesh, damping_ratios=DAMPING))
    assert exact.pole_covariance is not None
    kept = [0, 2]
    modes = Modes(
        exact.poles[kept], exact.shapes[kept], POINTS, exact.pole_covariance[np.ix_([0, 1, 4, 5], [0, 1, 4, 5])]
    )
    found = characterise_free_beam(modes, paper_beam, mesh)
    assert [row.experiment is None for row in found.table] == [False, True, False]
    np.testing.assert_allclose(found.damping_ratios, [0.004, 0, 0.001], rtol=1e-6)
    assert any("mode 5 was not measured; its damping is taken to be zero" in text for text in found.statements)


def test_a_damping_ratio_below_its_error_is_neither_negative_nor_passed_over(paper_beam: Beam, nodes: Real) -> None:
    mesh = Mesh.through(nodes)
    exact = exact_modes(assemble(paper_beam, mesh, damping_ratios=(0.004, 0.001, 0.0)))
    modes = replace(exact, poles=exact.poles + np.array([0, 0, 1e-2]))  # the third decays upwards, by noise
    found = characterise_free_beam(modes, paper_beam, mesh)
    assert found.elastic.damping_ratio[2] < 0
    assert found.damping_ratios[2] == 0
    assert any("the damping ratio of mode 6" in text and "may be zero" in text for text in found.statements)


def test_one_mode_updates_the_bar_and_leaves_rayleigh_out(paper_beam: Beam, nodes: Real) -> None:
    mesh = Mesh.through(nodes)
    modes = exact_modes(assemble(paper_beam, mesh, damping_ratios=DAMPING), modes=1)
    found = characterise_free_beam(modes, paper_beam, mesh)
    assert not any("Rayleigh" in text for text in found.statements)
    assert len(found.table) == 3
    assert found.table[2].experiment is None
    assert found.update.consistent


def test_an_accelerometer_is_not_taken_for_density_and_a_balance_gives_both(
    paper_beam: Beam, true_bar: Beam, nodes: Real
) -> None:
    masses = {3: 0.03}
    modes = exact_modes(assemble(true_bar, Mesh.through(nodes), damping_ratios=DAMPING, point_masses=masses))
    mass = true_bar.density * true_bar.area * true_bar.length
    found = characterise_free_beam(
        modes,
        paper_beam,
        Mesh.through(nodes),
        BeamTolerances(0.02, 0.02, 0.0, 1e-4, 0.0),
        point_masses=masses,
        weighed=Estimate(mass, 1e-4 * mass),
    )
    # height is a twin of both; what the balance and the frequencies fix is rho h and E h^3
    per_area = found.update.combination({"density": 1, "height": 1})
    assert per_area.value == pytest.approx(true_bar.density * true_bar.height, rel=3e-4)
    rigidity = found.update.combination({"youngs_modulus": 1, "height": 3})
    assert rigidity.value == pytest.approx(true_bar.youngs_modulus * true_bar.height**3, rel=1e-3)
    assert rigidity.standard_error / rigidity.value < 1e-3
