"""An identified joint: its matrices, their 95 % intervals, and which terms are observable."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from analysis.frequency_response import Real
from analysis.interval import Z95, quantile
from analysis.inverse.regression import UPPER, Regression
from analysis.inverse.undetermined_terms import Reason, Reasons, Unobservable, reasons_array
from analysis.structure.joints import Joint

ROUNDING = 1e-9  # a term below this share of its diagonal terms counts as zero
HALF = len(UPPER)

Scalar = TypeVar("Scalar", np.float64, np.object_)


@dataclass(frozen=True, eq=False)
class IdentifiedJoint:
    """A joint identified by any method. Rows and columns: x, y, rotation; N/m, N, N m.

    Attributes:
        name, node: of the joint.
        stiffness, damping: (3, 3) k and h.
        covariance: (12, 12) of [k11, k12, k13, k22, k23, k33, h11, ...].
        k_ci95, h_ci95: (3, 3, 2) 95 % intervals.
        loss_factor: (3, 3) h / k, nan where k cannot be distinguished from zero.
        loss_factor_ci95: (3, 3, 2) by Fieller's theorem; nan with `loss_factor`.
        why_not: (3, 3) why the stiffness is not observable: it is not distinguished from zero, or the data alone do not
            determine it, see `undetermined_terms.undetermined`; None where it is observable.
    """

    name: str
    node: int
    stiffness: Real
    damping: Real
    covariance: Real
    k_ci95: Real
    h_ci95: Real
    loss_factor: Real
    loss_factor_ci95: Real
    why_not: Reasons

    @property
    def observable(self) -> NDArray[np.bool_]:
        """(3, 3) whether the data determine a term."""
        return np.array([[why is None for why in row] for row in self.why_not], dtype=np.bool_)

    @property
    def not_observable(self) -> dict[str, Reason]:
        """Reason by name, such as "k12" and "k21", for every element that is not observable."""
        return {f"k{p + 1}{q + 1}": why for (p, q), why in np.ndenumerate(self.why_not) if why is not None}

    @property
    def joint(self) -> Joint:
        """The joint for a forward prediction."""
        return Joint(self.name, self.node, np.asarray(self.stiffness + 1j * self.damping))

    @property
    def best_covariance(self) -> Real:
        """(12, 12) the one to store, with all known errors."""
        return self.covariance


@dataclass(frozen=True, eq=False)
class JointEstimate(IdentifiedJoint):
    """A joint as identified from modes, Section 5.

    `covariance` is that of the paper's regression, Section 7: residual scatter alone, with every equation counted
    three times, which is too small. Each interval is the wider of two: Student's from the residual scatter, every
    equation counted once, and the normal one from `propagated_covariance`.

    Attributes:
        propagated_covariance: (12, 12) from the covariance of the measured modes; None where they have none.
        regression: residuals of Fig. 5, s^2 and R^2.
    """

    propagated_covariance: Real | None
    regression: Regression

    @property
    def best_covariance(self) -> Real:
        """(12, 12) the propagated one where there is one."""
        return self.covariance if self.propagated_covariance is None else self.propagated_covariance


def square(upper: NDArray[Scalar]) -> NDArray[Scalar]:
    """(3, 3, ...) symmetric matrix of the upper triangle's terms (6, ...)."""
    matrix = np.empty((3, 3, *upper.shape[1:]), dtype=upper.dtype)
    for value, (p, q) in zip(upper, UPPER, strict=True):
        matrix[p, q] = matrix[q, p] = value
    return matrix


def estimate(
    name: str, node: int, regression: Regression, propagated: Real | None, undetermined: Reasons
) -> JointEstimate:
    """Matrices and intervals of one joint from its regression.

    Args:
        name, node: of the joint.
        propagated: (12, 12) covariance from that of the modes, or None.
        undetermined: (12,) why the modes alone do not determine a term; None where they do.
    """
    count = len(regression.terms)
    covariances = [(regression.covariance_of_independent_equations, quantile(np.full(count, regression.freedom)))]
    if propagated is not None:
        covariances.append((propagated, np.full(count, Z95)))
    common = joint_from_terms(name, node, regression.terms, regression.covariance, covariances, undetermined)
    return JointEstimate(**vars(common), propagated_covariance=propagated, regression=regression)


def joint_from_terms(
    name: str,
    node: int,
    terms: Real,
    covariance: Real,
    widths: Sequence[tuple[Real, Real]],
    undetermined: Reasons,
) -> IdentifiedJoint:
    """Matrices and intervals of one joint from its terms.

    Args:
        name, node: of the joint.
        terms: (12,) upper triangles of k and h.
        covariance: (12, 12) of the terms, to store.
        widths: covariances (12, 12) and quantiles (12,); the widest interval counts.
        undetermined: (6,) or more: why the data alone do not determine a stiffness; None where they do.
    """
    half = np.max([t * np.sqrt(np.diag(c)) for c, t in widths], axis=0)
    limits = np.stack([terms - half, terms + half], axis=-1)

    diagonal = np.sqrt(np.abs(np.diag(square(terms[:HALF]))))
    floor = ROUNDING * np.array([diagonal[p] * diagonal[q] for p, q in UPPER])
    real = np.abs(terms[:HALF]) > np.maximum(half[:HALF], floor)
    ratio, ratio_limits = _loss_factors(terms, widths)
    ratio, ratio_limits = np.where(real, ratio, np.nan), np.where(real[:, None], ratio_limits, np.nan)

    return IdentifiedJoint(
        name=name,
        node=node,
        stiffness=square(terms[:HALF]),
        damping=square(terms[HALF:]),
        covariance=covariance,
        k_ci95=square(limits[:HALF]),
        h_ci95=square(limits[HALF:]),
        loss_factor=square(ratio),
        loss_factor_ci95=square(ratio_limits),
        why_not=square(_why_not(terms[:HALF], half[:HALF], real, undetermined[:HALF])),
    )


def _why_not(terms: Real, half: Real, real: NDArray[np.bool_], undetermined: Reasons) -> Reasons:
    """(6,) why a stiffness is not observable, by its own interval where the data would suffice; None where it is."""
    wide = 2 * half > np.abs(terms)
    own = (None if fits else Unobservable.WIDER_THAN_VALUE for fits in ~wide)
    by_interval = [why if away else Unobservable.INCLUDES_ZERO for why, away in zip(own, real, strict=True)]
    return reasons_array([data or each for data, each in zip(undetermined, by_interval, strict=True)])


def ratio_interval(numerator: float, denominator: float, covariance: Real, width: float) -> tuple[float, float] | None:
    """Interval of a ratio by Fieller's theorem (J. Roy. Stat. Soc. B 16, 1954, 175-185).

    Args:
        numerator: estimate.
        denominator: estimate.
        covariance: (2, 2) of numerator and denominator.
        width: quantile of Student's or the normal distribution.

    Returns:
        Lower and upper end, or None where the denominator cannot be distinguished from zero.
    """
    (v_n, v_nd), (_, v_d) = covariance * width**2
    free = denominator**2 - v_d
    if free <= 0:
        return None
    middle = (numerator * denominator - v_nd) / free
    inner = v_n * denominator**2 - 2 * numerator * denominator * v_nd + v_d * numerator**2 - (v_n * v_d - v_nd**2)
    half = np.sqrt(max(inner, 0.0)) / free
    return float(middle - half), float(middle + half)


def _loss_factors(terms: Real, covariances: Sequence[tuple[Real, Real]]) -> tuple[Real, Real]:
    """(6,) h / k and (6, 2) the widest interval; nan where some interval of k includes zero."""
    ratio, limits = np.full(HALF, np.nan), np.full((HALF, 2), np.nan)
    for place in range(HALF):
        k, h = terms[place], terms[HALF + place]
        pair = np.ix_([HALF + place, place], [HALF + place, place])
        both = [place, HALF + place]
        intervals = [ratio_interval(h, k, covariance[pair], float(np.max(t[both]))) for covariance, t in covariances]
        bounded = [interval for interval in intervals if interval is not None]
        if len(bounded) == len(intervals):
            ratio[place] = h / k
            limits[place] = min(low for low, _ in bounded), max(high for _, high in bounded)
    return ratio, limits
