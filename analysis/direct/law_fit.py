"""Fit of an elastomer law and of the discrepancy about it to measured points.

Generalised least squares in the logarithms of the parameters, from several starts, with the discrepancy's covariance
added to the errors of the points. The size of the discrepancy maximises the probability of the points with the
parameters integrated out. Shape parameters have wide priors from filled rubbers: three amplitudes do not determine the
law far below the smallest, and intervals have to widen there.

A specimen without filler is linear: neither its law nor its discrepancy depends on amplitude. A specimen counts as
linear if points of several amplitudes make that law far more probable (`ODDS_OF_FILLER`). The discrepancy of a filled
one, which few amplitudes do not determine, would make the intervals of a linear one many times too wide.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cho_solve, solve_triangular
from scipy.optimize import least_squares, minimize

from analysis.direct.constitutive import LawParameter, dynamic_stiffness
from analysis.direct.discrepancy import PRIOR_MEDIANS, OperatingPoints, covariance, interleaved, log_prior
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.elastomer_law import ElastomerLaw, MeasuredPoints
from analysis.direct.point_covariance import complex_factor, error_covariance
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real

PRIOR: Mapping[LawParameter, tuple[float, float]] = {
    LawParameter.K_INF: (1e6, 1e6),
    LawParameter.NETWORK: (1.0, 3.0),
    LawParameter.LOSS_FLOOR: (0.05, 3.0),
    LawParameter.LOSS_PEAK: (0.15, 3.0),
    LawParameter.AMPLITUDE: (22e-6, 4.5),
    LawParameter.EXPONENT: (0.55, 1.4),
    LawParameter.RELAXATION: (0.2, 5.0),
    LawParameter.SHORT_TIME: (1.0, 5.0),
    LawParameter.TIME: (0.01, 10.0),
    LawParameter.ORDER: (0.4, 1.7),
}
"""Median, and the factor that is one standard deviation of the logarithm: k_0 / k_inf of 1.3 to 4, x_c of 5 to 100 um,
m of 0.4 to 0.75 and a of 0.25 to 0.7 lie within about one; k_inf may be anything."""

STARTS: tuple[Mapping[LawParameter, float], ...] = (
    {},
    {LawParameter.AMPLITUDE: 8e-6},
    {LawParameter.AMPLITUDE: 60e-6, LawParameter.EXPONENT: 0.8},
    {LawParameter.TIME: 0.001, LawParameter.ORDER: 0.6},
    {LawParameter.TIME: 0.1, LawParameter.SHORT_TIME: 0.2, LawParameter.ORDER: 0.7},
    {LawParameter.AMPLITUDE: 8e-6, LawParameter.TIME: 0.05, LawParameter.RELAXATION: 0.05},
)
"""Starting values of the search that differ from the priors' medians."""

FIRST_MISFIT = 0.02  # relative error of each point in the first fit
SETTLED = 0.1  # largest change of the logarithms of the discrepancy's size in the last round
MOST_ROUNDS = 10
WIDEST = 5.0  # deviations of the prior within which a parameter is sought: no material is near, no power overflows
FINEST = 1e-6  # least relative error of a point; with none the matrix of equal points has no inverse
ROUNDED = 1e-10  # of the discrepancy's variance, that each point has for itself: above the rounding of 1,000 points
FEWEST_POINTS = 6
ODDS_OF_FILLER = 100.0  # that a mount's rubber is filled, before it is measured
NONE = -40.0  # logarithm of a parameter that a linear specimen does not have
_MEDIANS = np.log([PRIOR[parameter][0] for parameter in LawParameter])
_DEVIATIONS = np.log([PRIOR[parameter][1] for parameter in LawParameter])
_LINEAR_MEDIANS = _MEDIANS.copy()
_LINEAR_MEDIANS[[LawParameter.NETWORK, LawParameter.LOSS_PEAK]] = NONE


def fit_elastomer_law(points: Sequence[DynamicStiffness]) -> ElastomerLaw:
    """The law through `points` at any frequencies and amplitudes; errors that they share are propagated.

    Time grows with the cube of the number of points: 120 take a tenth of a second.

    Raises:
        AnalysisError: fewer than six points, a stiffness that is not positive, or points that no law can follow.
    """
    if len(points) < FEWEST_POINTS:
        raise AnalysisError(f"{len(points)} points do not determine a law; measure {FEWEST_POINTS} at least")
    for point in points:
        if not point.stiffness > 0:
            raise AnalysisError(f"k at {point.frequency:g} Hz is {point.stiffness:g} N/m; a law needs it positive")
    try:
        return _fit(_Data.of(points), points)
    except (np.linalg.LinAlgError, ValueError, FloatingPointError) as error:
        raise AnalysisError(
            f"no law goes through these {len(points)} points ({error}); check their stiffness, phase and stated errors"
        ) from error


def _fit(data: _Data, points: Sequence[DynamicStiffness]) -> ElastomerLaw:
    found = data.most_probable()
    if np.ptp(data.conditions.amplitude) > 0:
        linear = replace(data, conditions=replace(data.conditions, linear=True))
        without = linear.most_probable()
        if without.improbability + math.log(ODDS_OF_FILLER) < found.improbability:
            data, found = linear, without
    discrepancy, logarithms = found.discrepancy, found.logarithms
    factor = data.factor(discrepancy)
    law, slopes = data.law(logarithms)
    residual = interleaved(data.measured - law)
    inverse = np.asarray(cho_solve((factor, True), np.eye(len(factor))))
    alone = solve_triangular(np.linalg.cholesky(data.errors), residual, lower=True)
    return ElastomerLaw(
        logarithms=logarithms,
        covariance=np.asarray(np.linalg.inv(data.information(logarithms, factor))),
        reference=data.reference,
        discrepancy=discrepancy,
        chi_square=float(alone @ alone),
        degrees_of_freedom=2 * len(points) - len(LawParameter),
        points=MeasuredPoints(data.conditions, inverse, residual, slopes, data.shared),
        corrections=tuple(
            record for record in points[0].corrections if all(record in point.corrections for point in points)
        ),
    )


@dataclass(frozen=True, eq=False)
class _Found:
    """The (10,) logarithms and (2, 2) discrepancy of most evidence, and minus the logarithm of that evidence."""

    logarithms: Real
    discrepancy: Real
    improbability: float


@dataclass(frozen=True, eq=False)
class _Data:
    """Points as arrays, and their least squares problem with the priors."""

    conditions: OperatingPoints
    measured: Complex  # (points,) ln k_d
    errors: Real  # (2 points, 2 points) covariance of [ln |k_d|, loss angle] in turn, without shared errors
    shared: Mapping[str, Real]  # (2 points,)
    reference: float  # Hz

    @property
    def medians(self) -> Real:
        """(10,) logarithms, of the priors."""
        return _LINEAR_MEDIANS if self.conditions.linear else _MEDIANS

    @classmethod
    def of(cls, points: Sequence[DynamicStiffness]) -> _Data:
        sources = sorted({source for point in points for source in point.shared_errors})
        errors = np.zeros((2 * len(points), 2 * len(points)))
        for index, point in enumerate(points):
            own, turn = slice(2 * index, 2 * index + 2), complex_factor(1 / point.complex_stiffness)
            errors[own, own] = _not_below(turn @ error_covariance(point) @ turn.T, FINEST**2)
        frequency = np.array([point.frequency for point in points])
        stiffness = np.array([point.complex_stiffness for point in points])
        return cls(
            conditions=OperatingPoints(np.array([point.amplitude_pp / 2 for point in points]), frequency),
            measured=np.log(stiffness),
            errors=errors,
            shared={
                source: interleaved(np.array([point.shared_errors.get(source, 0j) for point in points]) / stiffness)
                for source in sources
            },
            reference=float(np.exp(np.mean(np.log(frequency)))),
        )

    def start(self, chosen: Mapping[LawParameter, float]) -> Real:
        """Logarithms of the priors' medians, except for the values `chosen`, scaled to the mean of the points."""
        logarithms = self.medians.copy()
        for parameter, value in chosen.items():
            logarithms[parameter] = math.log(value)
        found, _ = self.law(logarithms)
        logarithms[LawParameter.K_INF] += float(np.mean((self.measured - found).real))
        return logarithms

    def law(self, logarithms: Real) -> tuple[Complex, Real]:
        """(points,) ln k_d by the law, and (2 points, 10) its derivatives."""
        inside = self._inside(logarithms)
        law, slopes = dynamic_stiffness(inside, self.conditions.amplitude, self.conditions.frequency, self.reference)
        return np.log(law), interleaved(slopes / law[:, None]) * (inside == logarithms)

    def _inside(self, logarithms: Real) -> Real:
        """The logarithms, none farther from the prior than any material."""
        return np.clip(logarithms, self.medians - WIDEST * _DEVIATIONS, self.medians + WIDEST * _DEVIATIONS)

    @cached_property
    def correlation(self) -> Real:
        """(2, points, points) of the discrepancies at the points."""
        return self.conditions.correlation(self.conditions)

    def factor(self, discrepancy: Real) -> Real:
        """(2 points, 2 points) lower Cholesky factor of the covariance of errors and discrepancy together.

        Points of a linear specimen that differ in amplitude alone have the same discrepancy. Where it is large beside
        their errors, rounding would leave a matrix that has no factor.
        """
        common = covariance(self.correlation, discrepancy)
        own = self.errors + ROUNDED * np.max(np.diag(common)) * np.eye(len(common))
        return np.asarray(np.linalg.cholesky(own + common))

    def fit(self, start: Real, factor: Real) -> Real:
        """Logarithms of least cost near `start`."""

        def columns(logarithms: Real) -> Real:
            _, slopes = self.law(logarithms)
            return np.concatenate([solve_triangular(factor, slopes, lower=True), np.diag(1 / _DEVIATIONS)])

        found = least_squares(
            lambda logarithms: self._residual(logarithms, factor), start, jac=columns, method="lm", x_scale="jac"
        )
        return self._inside(np.asarray(found.x))

    def cost(self, logarithms: Real, factor: Real) -> float:
        """Sum of squares, the priors' included."""
        residual = self._residual(logarithms, factor)
        return float(residual @ residual)

    def most_probable(self) -> _Found:
        """The law and its discrepancy.

        Each round finds the most probable discrepancy for the law linearised about the logarithms, then the logarithms
        of least cost for that discrepancy.
        """
        # independent points lead to the minimum from far away; their common discrepancy helps only near it
        apart = np.diag(np.sqrt(np.diag(self.errors) + FIRST_MISFIT**2))
        logarithms = min(
            (self.fit(self.start(start), apart) for start in STARTS), key=lambda found: self.cost(found, apart)
        )
        size = np.log(PRIOR_MEDIANS).ravel()
        for _ in range(MOST_ROUNDS):
            before = size
            size = minimize(
                self._improbability_about(logarithms),
                before,
                method="Nelder-Mead",
                options={"xatol": SETTLED, "fatol": 0.1},
            ).x
            logarithms = self.fit(logarithms, self.factor(self._deviations(size)))
            if np.max(np.abs(size - before)) < SETTLED:
                break
        return _Found(logarithms, self._deviations(size), self._improbability_about(logarithms)(size))

    def _deviations(self, size: Real) -> Real:
        """(2, 2) standard deviations of a discrepancy from their (4,) logarithms; none over amplitude if linear."""
        return np.asarray(np.exp(size).reshape(2, 2) * [[not self.conditions.linear], [True]])

    def _improbability_about(self, logarithms: Real) -> Callable[[Real], float]:
        """Minus the logarithm of the evidence for a discrepancy of (4,) logarithmic size, the law linear about
        `logarithms`.

        The parameters are integrated out, which is exact for a linear law.
        """
        law, slopes = self.law(logarithms)
        columns = np.column_stack([slopes, interleaved(self.measured - law)])
        from_prior = (self.medians - logarithms) / _DEVIATIONS

        def improbability(size: Real) -> float:
            factor = self.factor(self._deviations(size))
            whitened = solve_triangular(factor, columns, lower=True)
            by_parameter, residual = whitened[:, :-1], whitened[:, -1]
            information = by_parameter.T @ by_parameter + np.diag(_DEVIATIONS**-2)
            descent = by_parameter.T @ residual + from_prior / _DEVIATIONS
            cost = residual @ residual + from_prior @ from_prior - descent @ np.linalg.solve(information, descent)
            spread = 2 * np.sum(np.log(np.diag(factor))) + np.linalg.slogdet(information)[1]
            return float(0.5 * (cost + spread)) - log_prior(np.exp(size).reshape(2, 2))

        return improbability

    def information(self, logarithms: Real, factor: Real) -> Real:
        """(10, 10) inverse covariance of the logarithms."""
        _, slopes = self.law(logarithms)
        columns = solve_triangular(factor, slopes, lower=True)
        return np.asarray(columns.T @ columns + np.diag(_DEVIATIONS**-2))

    def _residual(self, logarithms: Real, factor: Real) -> Real:
        law, _ = self.law(logarithms)
        measured = solve_triangular(factor, interleaved(law - self.measured), lower=True)
        return np.concatenate([measured, (logarithms - self.medians) / _DEVIATIONS])


def _not_below(covariance: Real, least: float) -> Real:
    """A (2, 2) covariance with `least` added; rounding beside large shared errors may leave one that is below zero."""
    size, axes = np.linalg.eigh((covariance + covariance.T) / 2)
    return np.asarray((axes * (np.maximum(size, 0.0) + least)) @ axes.T)
