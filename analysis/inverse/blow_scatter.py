"""Covariance of joints from the scatter of single blows, which hangs together from line to line.

The likelihood weighs lines as if each were in error by itself. A blow that is harder than the others, or beside its
mark, is off at all lines together, and two thousand lines do not average it out. So every blow's share in the average
is followed through the fit, to first order, and the squares of what it does are added up, as
`analysis.modal.modal_scatter` does for modes (H. White, Econometrica 48, 1980, with the blows for clusters).
"""

from __future__ import annotations

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.inverse.response_jacobian import deviation_columns, term_columns
from analysis.inverse.response_likelihood import ResponseLikelihood
from analysis.inverse.response_model import SupportedResponse


def information_from_scatter(
    likelihood: ResponseLikelihood, values: Real, response: SupportedResponse, scatter: Complex
) -> Real:
    """(parameters, parameters) covariance of the gradient J^t W r, which is J^t W J where lines are independent.

    Args:
        likelihood: that was maximised.
        values: (parameters,) where.
        response: the model's there.
        scatter: (rows, blows, lines) how far each blow moves the average of its row, (m/s^2)/N.
    """
    terms, deviations = term_columns(response), deviation_columns(response, likelihood.active)
    weighted = np.concatenate([terms, deviations]) / likelihood.deviation**2
    moved = np.einsum("crl,rbl->crb", weighted.conj(), scatter, optimize=True).reshape(len(weighted), -1)
    gradients = np.real(likelihood.chain(values).conj().T @ moved)
    return np.asarray(gradients @ gradients.T)
