"""Covariance of joints from the scatter of single blows, which hangs together from line to line.

The likelihood weighs lines as if each were in error by itself. A blow that is harder than the others, or beside its
mark, is off at all lines together, and two thousand lines do not average it out. So every blow's share in the average
is followed through the fit, to first order, and the squares of what it does are added up, as
`analysis.modal.modal_scatter` does for modes (H. White, Econometrica 48, 1980, with the blows for clusters).

Ten blows tell their scatter to a quarter only, and some terms hang on the blows of one or two points. So each term has
the degrees of freedom of the blows that its variance comes from, and Student's interval (R. M. Bell, D. F. McCaffrey,
Survey Methodology 28, 2002, with Satterthwaite's approximation).
"""

from __future__ import annotations

import numpy as np

from analysis.frequency_response import Complex, Real, blows_behind
from analysis.interval import combined_degrees_of_freedom
from analysis.inverse.response_jacobian import deviation_columns, term_columns
from analysis.inverse.response_likelihood import ResponseLikelihood
from analysis.inverse.response_model import SupportedResponse


def information_from_scatter(
    likelihood: ResponseLikelihood, values: Real, response: SupportedResponse, scatter: Complex
) -> Real:
    """(rows, parameters, parameters) covariance of each row's part of the gradient J^t W r.

    Where lines are independent the parts add up to J^t W J.

    Args:
        likelihood: that was maximised.
        values: (parameters,) where.
        response: the model's there.
        scatter: (rows, blows, lines) how far each blow moves the average of its row, (m/s^2)/N.
    """
    terms, deviations = term_columns(response), deviation_columns(response, likelihood.active)
    weighted = np.concatenate([terms, deviations]) / likelihood.deviation**2
    moved = np.einsum("crl,rbl->rcb", weighted.conj(), scatter, optimize=True)
    gradients = np.real(likelihood.chain(values).conj().T @ moved)
    return np.asarray(gradients @ gradients.transpose(0, 2, 1))


def degrees_of_freedom(slope: Real, of_rows: Real, covariance: Real, scatter: Complex) -> Real:
    """(terms,) behind the variance of each term.

    Args:
        slope: (terms, parameters) derivative of the terms.
        of_rows: (rows, parameters, parameters) what the blows of each row add to the covariance of the parameters.
        covariance: (parameters, parameters) all of it; what is not from blows is known beforehand.
        scatter: (rows, blows, lines); blows that a row lacks are zero.
    """
    parts = np.einsum("tp,rpq,tq->tr", slope, of_rows, slope)
    beforehand = np.einsum("tp,pq,tq->t", slope, covariance, slope) - np.sum(parts, axis=1)
    known = [*(blows_behind(scatter) - 1).tolist(), np.inf]
    return np.array(
        [combined_degrees_of_freedom([*rows, rest], known) for rows, rest in zip(parts, beforehand, strict=True)]
    )
