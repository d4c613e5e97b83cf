"""What a prior on the joints does to their terms: the bias that it puts on each, and how much of each comes from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Real


@dataclass(frozen=True, eq=False)
class PriorEffect:
    """Of the terms of all joints, (12 joints,), in the order of `regression.TERMS`.

    Attributes:
        bias: to first order, for joints that are as they were found. Where the prior decides alone this is nil, as the
            term then is where the prior has it.
        share: of the variance, 0 to 1. It is what remains where joints are as far from the prior's mean as it says,
            while the rest comes from noise: 0 where the data decide, 1 where the prior does.
    """

    bias: Real
    share: Real


def prior_effect(slope: Real, curvature: Real, covariance: Real, weight: Real, off: Real) -> PriorEffect:
    """Bias and share of a Gaussian prior.

    With F the information of the data and R that of the prior the estimate is off by -(F + R)^-1 R (theta - theta0),
    and its covariance is C F C + C R C with C = (F + R)^-1 (A. E. Hoerl, R. W. Kennard, Technometrics 12, 1970, for R
    alike in all directions); where lines err together, what they say takes the place of the middle F.

    Args:
        slope: (terms, parameters) derivative of the terms.
        curvature: (parameters, parameters) C.
        covariance: (parameters, parameters) of the estimate; C itself where the data's errors are those of F.
        weight: (parameters, parameters) R; nil for what the prior in question is not about.
        off: (parameters,) theta - theta0.
    """
    reach = slope @ curvature
    of_prior = np.einsum("tp,pq,tq->t", reach, weight, reach)
    whole = np.einsum("tp,pq,tq->t", slope, covariance, slope)
    return PriorEffect(-reach @ weight @ off, np.asarray(np.clip(of_prior / whole, 0.0, 1.0)))
