"""Predicted accelerances with their uncertainty."""

from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex, FrequencyResponses, Real
from analysis.interval import quantile


@dataclass(frozen=True, eq=False)
class ResponseBand:
    """Accelerances with the uncertainty of their model to first order, without the noise of a measurement.

    Attributes:
        responses: the prediction, (m/s^2)/N.
        real_deviation, imaginary_deviation, magnitude_deviation: (rows, lines) standard deviations, (m/s^2)/N.
    """

    responses: FrequencyResponses
    real_deviation: Real
    imaginary_deviation: Real
    magnitude_deviation: Real

    @property
    def magnitude_ci95(self) -> Real:
        """(rows, lines, 2) 95 % interval of the magnitude, not below zero."""
        magnitude = np.abs(self.responses.accelerance)
        half = float(quantile(np.inf)) * self.magnitude_deviation
        return np.maximum(np.stack([magnitude - half, magnitude + half], axis=-1), 0.0)


def propagated_band(responses: FrequencyResponses, columns: Complex, covariance: Real) -> ResponseBand:
    """The band that follows from a covariance of the parameters.

    Args:
        columns: (parameters, rows, lines) derivatives of its accelerances.
        covariance: (parameters, parameters).
    """
    scale = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    factor = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    accelerance = responses.accelerance
    size = np.maximum(np.abs(accelerance), np.finfo(float).tiny)
    towards = accelerance.conj() / size
    variances = np.zeros((3, *accelerance.shape))
    for direction in factor.T:
        change = np.tensordot(direction, columns, axes=1)
        variances += np.square([change.real, change.imag, (towards * change).real])
    return ResponseBand(responses, *np.sqrt(variances))
