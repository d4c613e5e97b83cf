"""Smooth errors of accelerances: the likelihood is that of their full covariance."""

import numpy as np
import pytest

from analysis.dof import Direction, Dof
from analysis.gap.measurement import HammerSet
from analysis.gap.model_error import SmoothErrors, smooth_errors

SCALE, CORRELATION = 0.01, 20.0
FREQUENCY = np.arange(10.0, 170.0, 2.0)


@pytest.fixture(scope="module")
def measured() -> HammerSet:
    random = np.random.default_rng(4)
    shape = 2, FREQUENCY.size
    resonance = 1 / (80.0**2 - FREQUENCY**2 + 400j)
    noise = random.standard_normal(shape) + 1j * random.standard_normal(shape)
    accelerance = resonance * np.array([[1e4], [-3e3]]) + 1e-3 * noise
    return HammerSet((Dof(1, Direction.Y), Dof(4, Direction.Y)), FREQUENCY, accelerance, np.full(shape, 2e-3), 100.0)


@pytest.fixture(scope="module")
def errors(measured: HammerSet) -> SmoothErrors:
    return smooth_errors(measured, CORRELATION)


def test_modes_make_the_covariance_that_is_stated(measured: HammerSet, errors: SmoothErrors) -> None:
    apart = FREQUENCY[:, None] - FREQUENCY
    for row in range(2):
        size = measured.from_neighbours[row] / measured.deviation[row]
        stated = size[:, None] * np.exp(-(apart**2) / (2 * CORRELATION**2)) * size.conj()
        shapes = errors.turn[row].conj()[:, None] * errors.modes[row]
        made = (shapes * errors.power[row]) @ shapes.conj().T
        assert np.linalg.norm(made - stated) < 0.02 * np.linalg.norm(stated)


def test_inner_products_and_determinant_are_those_of_the_full_covariance(errors: SmoothErrors) -> None:
    random, logarithm = np.random.default_rng(5), 0.0
    for row in range(2):
        shapes = errors.turn[row].conj()[:, None] * errors.modes[row]
        full = np.eye(FREQUENCY.size) + SCALE**2 * (shapes * errors.power[row]) @ shapes.conj().T
        left = random.standard_normal((3, FREQUENCY.size)) + 1j * random.standard_normal((3, FREQUENCY.size))
        expected = left.conj() @ np.linalg.solve(full, left.T)
        along = errors.along(row, left)
        found = left.conj() @ left.T - along.conj() @ (along * errors.share(row, SCALE)).T
        assert np.allclose(found, expected)
        whitened = errors.whitened(row, left, SCALE)
        assert np.allclose(whitened.conj() @ whitened.T, expected)
        logarithm += 2 * np.linalg.slogdet(full)[1]
    assert errors.log_determinant(SCALE) == pytest.approx(logarithm)


def test_without_smooth_errors_nothing_changes(errors: SmoothErrors) -> None:
    left = np.ones((1, FREQUENCY.size), dtype=complex)
    assert np.array_equal(errors.whitened(0, left, 0.0), left)
    assert errors.log_determinant(0.0) == 0.0


def test_an_error_is_a_share_of_what_neighbours_show_and_not_of_the_line_with_its_noise(measured: HammerSet) -> None:
    changed = measured.accelerance.copy()
    changed[:, 30] *= 3
    other = HammerSet(measured.inputs, FREQUENCY, changed, measured.deviation, 100.0)
    same = np.abs(other.from_neighbours - measured.from_neighbours) == 0
    assert np.array_equal(np.flatnonzero(~np.all(same, axis=0)), [29, 31])
    thinned = measured.lines(np.arange(0, FREQUENCY.size, 5))
    assert np.array_equal(thinned.from_neighbours, measured.from_neighbours[:, ::5])
