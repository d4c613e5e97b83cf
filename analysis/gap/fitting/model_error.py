"""Coherent error of accelerances: a relative error of each row that is smooth over frequency, in the likelihood.

The error of a row is H(f) e(f), H its accelerance, with a complex Gaussian process e of standard deviation s and
correlation exp(-(f - f')^2 / (2 l^2)) (C. E. Rasmussen, C. K. I. Williams, Gaussian Processes, 2006). A part of it is
the row's own, and a part is common to all rows that were struck at the same point: the error of a sensor at one place,
or of the simulation, is there in every set. e has the variance s^2 (1 - c) + s^2 c with a common share c.

e is a sum of K smooth functions with independent coefficients. Own errors of a whitened row are left out along the
eigenvectors of its modes, computed once for a length l. Common coefficients are unknowns that the rows of a point
share: what each row says of them is added up, and they are then marginalised. Both are exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.measurement import HammerSet

APART = 0.7
"""Distance of knots, in lengths of correlation."""
SMALLEST = 1e-12
"""Eigenvalue, over the largest of a row, below which a smooth function does not count."""

Row = tuple[int, int]
"""Indices of a hammer set and of a row in it."""


@dataclass(frozen=True, eq=False)
class ErrorModes:
    """Smooth errors of one row, of a standard deviation of one.

    Modes are orthonormal shapes of the whitened row, turned so that its accelerance is real: weights times basis times
    rotation.

    Attributes:
        weight: (lines,) conjugate of the accelerance over its standard deviation.
        basis: (lines, knots) smooth functions, of all rows of a set.
        of_knots: (K, knots) amplitude along each mode that each coefficient makes; its rows are orthogonal.
        power: (K,) of each mode, the sum of their squares.
    """

    weight: Complex
    basis: Real
    of_knots: Real
    power: Real

    @cached_property
    def rotation(self) -> Real:
        """(knots, K) that makes modes of the weighted basis."""
        return np.asarray(self.of_knots.T / self.power)

    @cached_property
    def turn(self) -> Complex:
        """(lines,) by which the row is turned so that its accelerance is real."""
        size = np.abs(self.weight)
        return np.asarray(np.where(size > 0, self.weight / np.where(size > 0, size, 1.0), 1.0))

    @cached_property
    def modes(self) -> Real:
        """(lines, K), for rows that are taken along them many times."""
        return np.asarray(np.abs(self.weight)[:, None] * self.basis @ self.rotation)

    def errors(self, scale: float, common: float) -> RowErrors:
        """Errors with standard deviation `scale`; rows of a point have the share `common` of variance in common."""
        power = scale**2 * (1 - common) * self.power
        knots = self.of_knots if common else self.of_knots[:, :0]
        return RowErrors(self, power, scale * np.sqrt(common) * knots / np.sqrt(1 + power)[:, None])


@dataclass(frozen=True, eq=False)
class RowErrors:
    """Smooth errors of one row.

    Attributes:
        shapes: of them.
        power: (K,) variance of each mode that the row's own errors make.
        common: (K, n) amplitudes that coefficients of the errors common to the point make along the modes, whitened
            for own errors; n is 0 where there are none.
    """

    shapes: ErrorModes
    power: Real
    common: Real

    def along(self, values: Complex) -> Real:
        """(n, 2, K) amplitudes of the modes in whitened `values` (n, lines), real and imaginary part."""
        return product(_parts(values * self.shapes.turn), self.shapes.modes)

    def along_once(self, values: Complex) -> Real:
        """Amplitudes as of `along`, for a single use: the modes themselves are then not computed."""
        return product(_parts(values * self.shapes.weight), self.shapes.basis, self.shapes.rotation)

    @cached_property
    def share(self) -> Real:
        """(K,) share of each amplitude's square that own errors explain, 0 to 1."""
        return np.asarray(self.power / (1 + self.power))

    @cached_property
    def _share_of_amplitude(self) -> Real:
        return np.asarray(np.sqrt(self.share))

    @cached_property
    def _to_common(self) -> Real:
        return np.asarray(self.common / np.sqrt(1 + self.power)[:, None])

    def of_common(self, along: Real) -> Real:
        """(n, 2, coefficients) information about the common coefficients in amplitudes (n, 2, K)."""
        return product(along, self._to_common)

    def taken(self, along: Real) -> tuple[Real, Real]:
        """(n, 2, K) part of amplitudes that own errors explain, as roots of squares, and `of_common` of the rest."""
        return along * self._share_of_amplitude, self.of_common(along)

    def taken_from(self, values: Complex) -> tuple[Real, Real]:
        """Parts as of `taken`, from whitened `values` (n, lines)."""
        if np.any(self.power):
            return self.taken(self.along(values))
        return np.zeros((len(values), 2, 0)), product(_parts(values * self.shapes.turn), self._all_common)

    @cached_property
    def _all_common(self) -> Real:
        return np.asarray(self.shapes.modes @ self._to_common)

    def without(self, values: Complex, along: Real) -> Complex:
        """(n, lines) values less amplitudes (n, 2, K) of the modes."""
        taken = product(along, self.shapes.modes.T)
        return np.asarray(values - self.shapes.turn.conj() * (taken[:, 0] + 1j * taken[:, 1]))

    @cached_property
    def precision(self) -> Real:
        """(n, n) precision of the common coefficients by this row alone."""
        return np.asarray(self.common.T @ self.common)


@dataclass(frozen=True, eq=False)
class PointErrors:
    """Smooth errors of all rows that were struck at one point.

    Attributes:
        rows: set and row of each.
        errors: of each.
    """

    rows: tuple[Row, ...]
    errors: tuple[RowErrors, ...]

    @cached_property
    def _taken(self) -> Real:
        """(n, n) matrix from the sum of `RowErrors.of_common` to the coefficients that whitening removes."""
        precision, vectors = np.linalg.eigh(np.sum([each.precision for each in self.errors], axis=0))
        root = np.sqrt(1 + np.maximum(precision, 0.0))
        return np.asarray(vectors / (root * (1 + root)) @ vectors.T)  # (1 - 1 / root) / precision

    @cached_property
    def log_determinant(self) -> float:
        """Log determinant of the covariance of the rows, in real and imaginary parts, over that of noise alone."""
        own = sum(float(np.sum(np.log1p(each.power))) for each in self.errors)
        return 2 * (own + (common_covariance(self.errors)[1] if self.errors[0].common.size else 0.0))

    def explained(self, left: Sequence[Complex]) -> float:
        """The part of the square of whitened rows (lines,) each that smooth errors explain."""
        rows = [errors.taken_from(row[None]) for errors, row in zip(self.errors, left, strict=True)]
        found = sum(float(np.vdot(own, own)) for own, _ in rows)
        if self.errors[0].common.size:
            said = np.sum([common[0] for _, common in rows], axis=0) @ common_covariance(self.errors)[0]
            found += float(np.vdot(said, said))
        return found

    def whitened(self, values: Sequence[Complex]) -> list[Complex]:
        """(n, lines) values of each row, whitened for noise, whitened for smooth errors too."""
        along = [errors.along(each) for errors, each in zip(self.errors, values, strict=True)]
        less = [each * (1 - np.sqrt(1 - errors.share)) for errors, each in zip(self.errors, along, strict=True)]
        if self.errors[0].common.size:
            pairs = zip(self.errors, along, strict=True)
            said = product(np.sum([errors.of_common(each) for errors, each in pairs], axis=0), self._taken)
            less = [own + product(said, errors.common.T) for errors, own in zip(self.errors, less, strict=True)]
        return [errors.without(each, own) for errors, each, own in zip(self.errors, values, less, strict=True)]


def _parts(values: Complex) -> Real:
    """(n, 2, lines) real and imaginary parts of (n, lines)."""
    return np.stack([values.real, values.imag], axis=1)


def product(parts: Real, *matrices: Real) -> Real:
    """(n, 2, M) of real and imaginary parts (n, 2, N) and matrices (N, ...), (..., M), one after the other."""
    flat = parts.reshape(2 * len(parts), parts.shape[-1])
    for matrix in matrices:
        flat = flat @ matrix
    return np.asarray(flat.reshape(len(parts), 2, flat.shape[-1]))


@lru_cache(maxsize=256)
def common_covariance(rows: tuple[RowErrors, ...]) -> tuple[Real, float]:
    """Posterior of the coefficients that some rows of one point have in common, given these rows.

    The first value is (n, n), the root C of the covariance C C^t; the second is the log determinant of the precision.
    """
    precision = np.sum([each.precision for each in rows], axis=0)
    factor = np.linalg.cholesky(precision + np.eye(len(precision)))
    return np.asarray(np.linalg.inv(factor).T), 2 * float(np.sum(np.log(np.diag(factor))))


@lru_cache(maxsize=16)
def smooth_errors(
    sets: tuple[HammerSet, ...], scale: float, correlation: float, common: float
) -> tuple[PointErrors, ...]:
    """Smooth errors of every row of some hammer sets, by point; kept, as every fit needs them.

    Args:
        sets: of one accelerometer.
        scale: standard deviation s.
        correlation: length l, Hz.
        common: share c of the variance s^2 that all rows of a point have in common.
    """
    band = min(float(each.frequency[0]) for each in sets), max(float(each.frequency[-1]) for each in sets)
    shapes = [_shapes(each, correlation, band) for each in sets]
    found = []
    for point in dict.fromkeys(dof for each in sets for dof in each.inputs):
        rows = tuple((n, row) for n, each in enumerate(sets) for row, dof in enumerate(each.inputs) if dof == point)
        shared = common if len(rows) > 1 else 0.0
        found.append(PointErrors(rows, tuple(shapes[n][row].errors(scale, shared) for n, row in rows)))
    return tuple(found)


@lru_cache(maxsize=128)
def _shapes(each: HammerSet, correlation: float, band: tuple[float, float]) -> tuple[ErrorModes, ...]:
    """Modes of the errors of each row of a hammer set, with the knots of a band."""
    basis = _basis(each.frequency, correlation, band)
    weights = each.from_neighbours.conj() / each.deviation
    return tuple(ErrorModes(weight, basis, *_decomposed(np.abs(weight)[:, None] * basis)) for weight in weights)


def _basis(frequency: Real, correlation: float, band: tuple[float, float]) -> Real:
    """(lines, knots) Gaussians that make a process of unit variance and of the length of correlation l.

    Their width is l / sqrt(2). With knots l apart, they miss a hundredth of the process, more than the noise of a
    good measurement; with knots `APART`, they miss less than a thousandth.
    """
    step = APART * correlation
    knots = np.arange(band[0] - 2 * step, band[1] + 3 * step, step)
    basis = np.exp(-(((frequency[:, None] - knots) / correlation) ** 2))
    return np.asarray(basis / np.sqrt(np.sum(basis**2, axis=1))[:, None])


def _decomposed(weighted: Real) -> tuple[Real, Real]:
    """(K, knots) and (K,) the singular values of (lines, knots) times its right singular vectors, and their squares."""
    lines, knots = weighted.shape
    if knots < lines:
        power, right = np.linalg.eigh(weighted.T @ weighted)
        kept = power > SMALLEST * max(power[-1], 1e-300)
        return (right[:, kept] * np.sqrt(power[kept])).T, power[kept]
    power, left = np.linalg.eigh(weighted @ weighted.T)
    kept = power > SMALLEST * max(power[-1], 1e-300)
    return left[:, kept].T @ weighted, power[kept]
