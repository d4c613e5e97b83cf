"""Smooth errors of accelerances: the likelihood is that of their full covariance, within a row and from set to set."""

import pickle
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Direction, Dof
from analysis.frequency_response import Complex, Real
from analysis.gap.fitting.model_error import PointErrors, smooth_errors
from analysis.gap.measurement import HammerSet

SCALE, CORRELATION = 0.01, 20.0
FREQUENCY = np.arange(10.0, 170.0, 2.0)
FIRST, FOURTH, SIXTH = (Dof(node, Direction.Y) for node in (1, 4, 6))
COMMON = (0.0, 0.6, 1.0)


def a_set(inputs: tuple[Dof, ...], seed: int, frequency: Real = FREQUENCY, noise: float = 2e-3) -> HammerSet:
    """With a resonance, and noise of its own."""
    random, shape = np.random.default_rng(seed), (len(inputs), frequency.size)
    resonance = 1 / (80.0**2 - frequency**2 + 400j)
    accelerance = resonance * np.array([[1e4], [-3e3], [2e3j]])[: len(inputs)]
    accelerance = accelerance + noise / 2 * (random.standard_normal(shape) + 1j * random.standard_normal(shape))
    return HammerSet(inputs, frequency, accelerance, np.full(shape, noise), 100.0)


SETS = (a_set((FIRST, FOURTH), 4), a_set((FOURTH, FIRST, SIXTH), 5, FREQUENCY[3:], 1e-3), a_set((FIRST,), 6))
"""Struck at points in an order of their own, with lines and noise of their own."""


def stated(rows: Sequence[tuple[int, int]], common: float, sets: Sequence[HammerSet] = SETS) -> Complex:
    """The covariance of whitened rows, by the formula of the process."""
    frequency = np.concatenate([sets[n].frequency for n, _ in rows])
    size = np.concatenate([sets[n].from_neighbours[row] / sets[n].deviation[row] for n, row in rows])
    own = np.concatenate([np.full(sets[n].frequency.size, place) for place, (n, _) in enumerate(rows)])
    process = np.exp(-((frequency[:, None] - frequency) ** 2) / (2 * CORRELATION**2))
    share = np.where(own[:, None] == own, 1.0, common)
    return np.asarray(np.eye(size.size) + SCALE**2 * size[:, None] * share * process * size.conj())


def errors_of(common: float, sets: tuple[HammerSet, ...] = SETS) -> tuple[PointErrors, ...]:
    return smooth_errors(sets, SCALE, CORRELATION, common)


def test_rows_that_were_struck_at_one_point_belong_together() -> None:
    assert [point.rows for point in errors_of(0.5)] == [((0, 0), (1, 1), (2, 0)), ((0, 1), (1, 0)), ((1, 2),)]


def test_smooth_errors_are_computed_once_for_a_set_and_its_copies() -> None:
    assert errors_of(0.5, pickle.loads(pickle.dumps(SETS))) is errors_of(0.5)


def test_amplitudes_are_the_same_with_and_without_the_modes() -> None:
    values = np.asarray(np.random.default_rng(2).standard_normal((3, FREQUENCY.size, 2)) @ (1, 1j), dtype=complex)
    errors = errors_of(0.5)[0].errors[0]
    assert errors.along_once(values) == pytest.approx(errors.along(values), abs=1e-6)


@pytest.mark.parametrize("common", COMMON)
def test_whitening_and_determinant_are_those_of_the_full_covariance(common: float) -> None:
    random = np.random.default_rng(5)
    for point in errors_of(common):
        left = [random.standard_normal((3, 2, SETS[n].frequency.size)) for n, _ in point.rows]
        values = [each[:, 0] + 1j * each[:, 1] for each in left]
        whole, full = np.concatenate(values, axis=1), stated(point.rows, common)
        expected = whole.conj() @ np.linalg.solve(full, whole.T)
        whitened = np.concatenate(point.whitened(values), axis=1)
        assert np.allclose(whitened.conj() @ whitened.T, expected, rtol=0.0, atol=0.01 * np.abs(expected).max())
        noise = float(np.linalg.norm(whole[0]) ** 2)
        assert noise - point.explained([each[0] for each in values]) == pytest.approx(
            float(np.linalg.norm(whitened[0]) ** 2), rel=1e-9
        )
        assert point.log_determinant == pytest.approx(2 * np.linalg.slogdet(full)[1], rel=0.01)


@pytest.mark.parametrize("common", COMMON)
def test_whitened_errors_of_this_covariance_are_white(common: float) -> None:
    random = np.random.default_rng(7)
    point = errors_of(common)[0]
    root, ends = np.linalg.cholesky(stated(point.rows, common)), [SETS[n].frequency.size for n, _ in point.rows]
    drawn = random.standard_normal((4000, len(root))) + 1j * random.standard_normal((4000, len(root)))
    white = np.concatenate(point.whitened(np.split(drawn @ root.T, np.cumsum(ends)[:-1], axis=1)), axis=1)
    assert np.mean(np.abs(white) ** 2) / 2 == pytest.approx(1.0, abs=0.005)
    covariance = white.conj().T @ white / (2 * len(white))
    assert np.max(np.abs(covariance - np.eye(len(root)))) < 0.1  # six standard deviations of chance


@pytest.mark.parametrize(
    ("true", "assumed", "ratio"), [(1.0, 1.0, 1.0), (0.0, 0.0, 1.0), (0.6, 0.6, 1.0), (1.0, 0.0, 1.7)]
)
def test_a_standard_error_is_what_an_estimate_scatters_by_where_the_share_is_right(
    true: float, assumed: float, ratio: float
) -> None:
    """Of a gain that falls with frequency. Three sets with one error, taken as three, know it 1.7 times too well."""
    random, sets = np.random.default_rng(8), tuple(a_set((FIRST,), seed) for seed in (1, 2, 3))
    (point,) = errors_of(assumed, sets)
    root = np.linalg.cholesky(stated(point.rows, true, sets))
    drawn = random.standard_normal((2000, len(root))) + 1j * random.standard_normal((2000, len(root)))
    effect = [(each.from_neighbours / each.deviation) * (1 - each.frequency / 170.0) for each in sets]
    column = np.concatenate(point.whitened(effect), axis=1)[0]
    left = np.concatenate(point.whitened(np.split(drawn @ root.T, 3, axis=1)), axis=1)
    precision = float(np.linalg.norm(column) ** 2)
    estimate = np.real(left @ column.conj()) / precision
    assert np.std(estimate) * np.sqrt(precision) == pytest.approx(ratio, rel=0.07)
    if true == assumed:
        assert np.mean(np.abs(left) ** 2) / 2 == pytest.approx(1.0, abs=0.01)


def test_tiny_errors_change_nothing() -> None:
    for point in smooth_errors(SETS, 1e-9, CORRELATION, 0.5):
        left = [np.ones((1, SETS[n].frequency.size), dtype=complex) for n, _ in point.rows]
        assert all(np.allclose(one, other) for one, other in zip(point.whitened(left), left, strict=True))
        assert point.log_determinant == pytest.approx(0.0, abs=1e-6)


def test_an_error_is_a_share_of_what_neighbours_show_and_not_of_the_line_with_its_noise() -> None:
    measured = SETS[0]
    changed = measured.accelerance.copy()
    changed[:, 30] *= 3
    other = replace(measured, accelerance=changed)
    same = np.abs(other.from_neighbours - measured.from_neighbours) == 0
    assert np.array_equal(np.flatnonzero(~np.all(same, axis=0)), [29, 31])
    thinned = measured.lines(np.arange(0, FREQUENCY.size, 5))
    assert np.array_equal(thinned.from_neighbours, measured.from_neighbours[:, ::5])
