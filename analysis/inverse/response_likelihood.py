"""Likelihood of measured accelerances for given joints and deviations of the bench from its drawing.

Errors are Gaussian, independent between lines and of known variance, per real and imaginary part. Chi-square is
-2 log likelihood and includes the priors of the parameters.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.inverse.frequency_laws import FARTHEST
from analysis.inverse.joint_parameters import HALF, JointParameters, matrices
from analysis.inverse.levenberg_marquardt import NOWHERE, Linearised, Trial
from analysis.inverse.response_jacobian import deviation_columns, term_columns
from analysis.inverse.response_model import CondensedBeam, ResponseModel, SupportedResponse
from analysis.inverse.tolerances import COMMON, SENSOR, Deviations, law_places


@dataclass(frozen=True, eq=False)
class Information:
    """Normal equations of accelerances in upper terms of z and in deviations, both as if complex.

    Attributes:
        products: (columns, columns) J^H W J over the columns of z's upper terms, then of the active deviations.
        descent: (columns,) J^H W r.
        chi_square: r^H W r.
    """

    products: Complex
    descent: Complex
    chi_square: float

    def scaled(self, factor: float) -> Information:
        """The same with the noise's variance divided by `factor`."""
        return Information(factor * self.products, factor * self.descent, factor * self.chi_square)


@dataclass(frozen=True, eq=False)
class ResponseLikelihood:
    """A sum of squares over joint parameters, then deviations of the bench.

    Attributes:
        model: the experiment.
        measured: (rows, lines) accelerances, (m/s^2)/N.
        deviation: (rows, lines) their standard deviation, per real and imaginary part.
        parameters: of the joints.
        tolerance: (4 + 5 joints + 2 rows, the same) prior covariance of the bench's deviations; zero holds a deviation
            at zero.
    """

    model: ResponseModel
    measured: Complex
    deviation: Real
    parameters: JointParameters
    tolerance: Real

    def __post_init__(self) -> None:
        expected = (len(self.model.inputs), self.model.frequency.size)
        if self.measured.shape != expected or self.deviation.shape != expected:
            raise AnalysisError(f"accelerances and their deviation must have shape (rows, lines) = {expected}")
        if not np.all(self.deviation > 0):
            raise AnalysisError("the standard deviation of the accelerances must be above zero at every line")

    @property
    def data(self) -> int:
        """Number of real and imaginary parts."""
        return 2 * self.measured.size

    @property
    def active(self) -> NDArray[np.bool_]:
        """(4 + 5 joints + 2 rows,) which deviations of the bench are parameters."""
        return np.diag(self.tolerance) > 0

    @cached_property
    def numbers(self) -> dict[int, int]:
        """Number of the parameter of each deviation that is one, by its place in `Deviations`."""
        first = len(self.parameters.labels)
        return {place: number for number, place in enumerate(np.flatnonzero(self.active).tolist(), first)}

    @property
    def active_tolerance(self) -> Real:
        """(active, active) prior covariance of the deviations that are parameters."""
        return self.tolerance[np.ix_(self.active, self.active)]

    @cached_property
    def prior(self) -> tuple[Real, Real]:
        """(parameters,) means, and (parameters, parameters) the inverse of the covariance."""
        mean = np.concatenate([self.parameters.prior_mean, np.zeros(int(np.sum(self.active)))])
        of_joints = np.diag(1 / np.square(self.parameters.prior_deviation))
        return mean, block_diag(of_joints, np.linalg.inv(self.active_tolerance))

    @cached_property
    def as_drawn(self) -> CondensedBeam:
        """The free beam of a bench exactly as drawn."""
        return self.model.condensed(Deviations.none(len(self.model.joint_nodes), len(self.model.inputs)))

    def within(self, highest: float, inflation: float) -> ResponseLikelihood:
        """The likelihood up to `highest` Hz, its standard deviation raised by a share of the measured accelerances."""
        part = self._at_lines(self.model.frequency <= highest)
        return replace(part, deviation=np.hypot(part.deviation, inflation * np.abs(part.measured)))

    def thinned(self, most: int) -> ResponseLikelihood:
        """The likelihood on every n-th line, with the least n that leaves at most `most` lines."""
        lines = np.arange(self.model.frequency.size)
        return self._at_lines(lines % -(-lines.size // most) == 0)

    def _at_lines(self, keep: NDArray[np.bool_]) -> ResponseLikelihood:
        return replace(
            self,
            model=replace(self.model, frequency=self.model.frequency[keep]),
            measured=self.measured[:, keep],
            deviation=self.deviation[:, keep],
        )

    def deviations(self, values: Real) -> Deviations:
        """The deviations of the bench for parameters (parameters,)."""
        found = np.zeros(len(self.tolerance))
        found[self.active] = values[len(self.parameters.labels) :]
        return Deviations(found, len(self.model.joint_nodes))

    def response(self, values: Real) -> SupportedResponse:
        """The model's, for parameters (parameters,)."""
        free = self.model.condensed(self.deviations(values)) if np.any(self.active) else self.as_drawn
        return free.evaluate_on(matrices(self.upper(values)))

    def upper(self, values: Real) -> Complex:
        """(6 joints,) upper terms of z of all joints at their true positions; at 100 Hz if they depend on frequency."""
        own = self.parameters.upper(values[: len(self.parameters.labels)])
        return np.asarray(self._moved(self.deviations(values))[0] @ own)

    def at(self, values: Real) -> Trial:
        """Chi-square with priors at parameters (parameters,); `NOWHERE` for an impossible bench."""
        deviations = self.deviations(values)
        no_beam = min(deviations.gain, deviations.youngs_modulus, deviations.density) <= -1
        if no_beam or np.max(np.abs(deviations.joint_laws)) > FARTHEST:
            return NOWHERE
        mean, weight = self.prior
        response = self.response(values)
        left = (self.measured - response.accelerance) / self.deviation
        off = values - mean
        cost = float(np.vdot(left, left).real + off @ weight @ off)
        return Trial(cost, partial(self._linearised, values, response))

    def information(self, response: SupportedResponse) -> Information:
        """Products of the whitened derivatives about `response`."""
        weight = 1 / self.deviation
        terms, deviations = term_columns(response), deviation_columns(response, self.active)
        weighted = np.concatenate([terms, deviations]) * weight
        columns: Complex = np.asarray(weighted, dtype=complex).reshape(len(weighted), -1)
        left = ((self.measured - response.accelerance) * weight).ravel()
        conjugate = columns.conj()
        return Information(
            np.asarray(conjugate @ columns.T), np.asarray(conjugate @ left), float(np.vdot(left, left).real)
        )

    def square_roots(self, values: Real, response: SupportedResponse) -> tuple[Real, Real]:
        """Rows whose squares add up to the normal matrix: (any, parameters) of the data, and of the prior.

        Where a peak is a million times the noise, the prior is lost in the rounding of the normal matrix. But only the
        prior determines the common scale of joints, E, density and gain; the data contain no information about it.
        """
        columns = np.concatenate([term_columns(response), deviation_columns(response, self.active)]) / self.deviation
        slope = np.tensordot(self.chain(values).T, columns, axes=1).reshape(values.size, -1)
        of_data = np.linalg.qr(np.concatenate([slope.real, slope.imag], axis=1).T, mode="r")
        size, axes = np.linalg.eigh(self._kink_curvature(response))
        of_kinks = np.sqrt(np.maximum(size, 0.0))[:, None] * axes.T
        of_tolerances = np.linalg.cholesky(np.linalg.inv(self.active_tolerance)).T
        of_prior = block_diag(np.diag(1 / self.parameters.prior_deviation), of_tolerances)
        return np.concatenate([of_data, of_kinks]), np.asarray(of_prior)

    def chain(self, values: Real) -> Complex:
        """(columns, parameters) derivative of z's upper terms and of the active deviations in the parameters."""
        count = len(self.parameters.labels)
        moved, slopes = self._moved(self.deviations(values))
        found: Complex = block_diag(moved @ self.parameters.slope(values[:count]), np.eye(int(np.sum(self.active))))
        in_places = np.zeros((len(self.tolerance), len(moved)), dtype=complex)
        in_places[len(COMMON) : len(COMMON) + len(slopes)] = slopes @ self.parameters.upper(values[:count])
        found[: len(moved), count:] = in_places[self.active].T
        return found

    def _moved(self, deviations: Deviations) -> tuple[Real, Real]:
        """Map from the parameters' upper terms to those at the true positions of the joints: (6 joints, 6 joints).

        Terms of matrices as parameters refer to the drawing's node, by a rigid lever: the position of a joint and its
        k23 are then nearly independent, and otherwise strongly correlated along a curve.

        Returns:
            The map, and (joints, 6 joints, 6 joints) its derivatives in the joints' positions.
        """
        places = deviations.joint_positions
        maps, slopes = np.zeros((2, len(places), HALF, HALF))
        maps[:] = np.eye(HALF)
        if self.parameters.seen_from_drawing:
            maps[:, 2, 1] = maps[:, 4, 3] = -places
            maps[:, 5, 4], maps[:, 5, 3] = -2 * places, places**2
            slopes[:, 2, 1] = slopes[:, 4, 3] = -1
            slopes[:, 5, 4], slopes[:, 5, 3] = -2, 2 * places
        own = np.zeros((len(places), len(places) * HALF, len(places) * HALF))
        for joint, slope in enumerate(slopes):
            at = slice(HALF * joint, HALF * (joint + 1))
            own[joint, at, at] = slope
        return np.asarray(block_diag(*maps)), own

    def _linearised(self, values: Real, response: SupportedResponse) -> Linearised:
        found, chain, (mean, weight) = self.information(response), self.chain(values), self.prior
        off = values - mean
        return Linearised(
            cost=found.chi_square + float(off @ weight @ off),
            descent=np.real(chain.conj().T @ found.descent) - weight @ off,
            normal=np.real(chain.conj().T @ found.products @ chain) + weight + self._kink_curvature(response),
        )

    def _kink_curvature(self, response: SupportedResponse) -> Real:
        """(parameters, parameters) second derivatives of the model that matter: of blows right at the accelerometer.

        The residual moves such a blow towards the kink of the beam under it or away from it. If it moves it towards the
        kink, the curvature keeps it there. Without this term steps would jump from one side to the other.
        """
        model, deviations = self.model, response.condensed.deviations
        bend = (model.kink_slope(deviations) * model.kink_bend(deviations))[1:]
        left = (self.measured - response.accelerance) / self.deviation**2
        pressed = np.real(left @ (model.poles**2).conj()) * (1 + deviations.gain)
        found = np.zeros((len(self.tolerance), len(self.tolerance)))
        first = law_places(len(model.joint_nodes)).stop
        for row in np.flatnonzero(bend):
            apart = np.zeros(len(found))
            apart[SENSOR], apart[first + int(row)] = -1.0, 1.0
            found += max(float(bend[row] * pressed[row]), 0.0) * np.outer(apart, apart)
        joints = len(self.parameters.labels)
        return np.pad(found[np.ix_(self.active, self.active)], (joints, 0))
