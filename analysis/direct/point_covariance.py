"""Covariance of measured points, and the weight of a point in a least squares fit.

Every point has [k, h] with errors of its own and errors that it shares with other points, such as that of a correction.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.frequency_response import Real

ROUNDING = 1e-9  # least error of a point, relative to its magnitude; an exact point would have an infinite weight
FEWEST_DEGREES = 4.0  # least degrees of freedom for a weight; with fewer the expected square is infinite


def shared_covariance(errors: Mapping[str, complex]) -> Real:
    """(2, 2) covariance of [k, h] from errors by their independent sources, in the square of their unit."""
    parts = np.array([[error.real, error.imag] for error in errors.values()]).reshape(-1, 2)
    return np.asarray(parts.T @ parts)


def own_covariance(point: DynamicStiffness) -> Real:
    """(2, 2) covariance of [k, h], (N/m)^2, without the errors that the point shares with others."""
    return np.asarray(point.covariance - shared_covariance(point.shared_errors))


def with_shared_error(point: DynamicStiffness, source: str, error: complex) -> DynamicStiffness:
    """The point with one more error that others share: change of k + i h by one standard deviation of `source`."""
    shared = {**point.shared_errors, source: point.shared_errors.get(source, 0j) + error}
    return replace(point, covariance=own_covariance(point) + shared_covariance(shared), shared_errors=shared)


def error_covariance(point: DynamicStiffness) -> Real:
    """(2, 2) covariance of [k, h] for weights, (N/m)^2, without the errors that the point shares with others.

    A covariance from few blocks is as often too small as too large. A square divided by it is larger on average than
    divided by the true one: nu / (nu - 3) times for two components (Hotelling's T^2). So it is raised by that factor.
    """
    freedom = max(point.degrees_of_freedom, FEWEST_DEGREES)
    student = 1.0 if math.isinf(freedom) else freedom / (freedom - 3)
    return np.asarray(student * own_covariance(point) + (ROUNDING * point.magnitude) ** 2 * np.eye(2))


def whitening(point: DynamicStiffness) -> Real:
    """(2, 2) W, 1 over N/m, so that W [k, h] of repeats has unit covariance."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(error_covariance(point))))


def joint_covariance(points: Sequence[DynamicStiffness]) -> Real:
    """(2 points, 2 points) covariance of [k_1, h_1, k_2, h_2, ...], (N/m)^2, with the errors that the points share."""
    sources = sorted({source for point in points for source in point.shared_errors})
    shared = np.array([[point.shared_errors.get(source, 0.0) for source in sources] for point in points], dtype=complex)
    columns = np.stack([shared.real, shared.imag], axis=1).reshape(2 * len(points), len(sources))
    covariance: Real = columns @ columns.T
    for index, point in enumerate(points):
        block = slice(2 * index, 2 * index + 2)
        covariance[block, block] = point.covariance
    return covariance


def complex_factor(factor: complex) -> Real:
    """(2, 2) matrix that multiplies [real, imaginary] by `factor`."""
    return np.array([[factor.real, -factor.imag], [factor.imag, factor.real]])
