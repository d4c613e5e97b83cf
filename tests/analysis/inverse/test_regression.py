import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from analysis.inverse.regression import TERMS, equations, solve, symmetry, weights


def motion(seed: int, modes: int = 4) -> NDArray[np.complex128]:
    rng = np.random.default_rng(seed)
    return rng.standard_normal((modes, 3)) + 1j * rng.standard_normal((modes, 3))


def full_matrix(seed: int) -> NDArray[np.complex128]:
    rng = np.random.default_rng(seed + 1)
    return rng.standard_normal((3, 3)) + 1j * rng.standard_normal((3, 3))


@given(seed=st.integers(0, 10**6))
def test_every_equation_holds_for_the_matrix_that_made_the_forces(seed: int) -> None:
    u, z = motion(seed), full_matrix(seed)  # not symmetric
    coefficients, right = equations(u, -u @ z.T)
    np.testing.assert_allclose(coefficients @ np.concatenate([z.real.ravel(), z.imag.ravel()]), right, atol=1e-10)


def test_a_row_is_equation_28_or_29_written_out() -> None:
    u, f = motion(1), motion(2)
    coefficients, right = equations(u, f)
    rows = coefficients.reshape(4, 2, 3, 3, 2, 3, 3)
    mode, p, q, other = 2, 1, 0, 2
    product = np.conj(u[mode, q]) * u[mode, other]
    assert np.isclose(rows[mode, 0, p, q, 0, p, other], 2 * product.real)
    assert np.isclose(rows[mode, 0, p, q, 1, p, other], 2 * (1j * product).real)
    assert np.isclose(rows[mode, 1, p, q, 0, p, other], -2 * (1j * product).real)
    assert np.isclose(rows[mode, 1, p, q, 1, p, other], 2 * product.real)
    assert rows[mode, 0, p, q, 0, p - 1, other] == 0
    b = -2 * (1j * np.conj(u[mode, q]) * f[mode, p]).real
    assert np.isclose(right.reshape(4, 2, 3, 3)[mode, 1, p, q], -b)


def test_weighting_makes_the_greatest_magnitude_of_each_row_unity_and_drops_rounding() -> None:
    u = motion(3)
    u[0, 2] = 1e-18
    coefficients, _ = equations(u, motion(4))
    weighted = weights(coefficients)[:, None] * coefficients
    greatest = np.max(np.abs(weighted), axis=1).reshape(4, 2, 3, 3)
    np.testing.assert_allclose(greatest[1:], 1.0)
    assert np.all(greatest[0, :, :, 2] == 0)
    np.testing.assert_allclose(greatest[0, :, :, :2], 1.0)


def test_symmetry_spreads_the_upper_triangle() -> None:
    spread = symmetry() @ np.arange(12)
    k, h = spread.reshape(2, 3, 3)
    np.testing.assert_array_equal(k, [[0, 1, 2], [1, 3, 4], [2, 4, 5]])
    np.testing.assert_array_equal(h, k + 6)
    assert TERMS[:6] == ("k11", "k12", "k13", "k22", "k23", "k33")


def test_honest_standard_errors_match_the_scatter_of_noisy_forces_and_section_7s_do_not() -> None:
    rng = np.random.default_rng(9)
    u, z = motion(5, modes=6), full_matrix(5)
    z = z + z.T
    runs = [
        solve(u, -u @ z.T + 0.01 * (rng.standard_normal(u.shape) + 1j * rng.standard_normal(u.shape)))
        for _ in range(400)
    ]
    scatter = np.std([run.terms for run in runs], axis=0)
    honest = np.sqrt(np.mean([np.diag(run.covariance_of_independent_equations) for run in runs], axis=0))
    printed = np.sqrt(np.mean([np.diag(run.covariance) for run in runs], axis=0))
    assert 0.8 < np.median(scatter / honest) < 1.2
    np.testing.assert_allclose(honest / printed, 2.0)
