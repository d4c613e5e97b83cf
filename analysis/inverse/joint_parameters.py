"""Real parameters of the joints in a fit, mapped to the dynamic stiffness z = k + i h of all joints.

Here the parameters are the terms of the matrices; `cylinder_parameters` has those of the cylinders.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from scipy.linalg import block_diag

from analysis.frequency_response import Complex, Real
from analysis.inverse.regression import TERMS, UPPER
from analysis.structure.joints import Joint

HALF = len(UPPER)
REACH = 0.3  # assumed error of a start value, relative to the size of the term
SHORT_LEVER = 0.01  # m; least size of a rotational stiffness: that of a translational one at this lever


class JointParameters(Protocol):
    """A description of joints by real parameters."""

    @property
    def names(self) -> tuple[str, ...]:
        """(joints,)."""

    @property
    def seen_from_drawing(self) -> bool:
        """Whether z is referred to the drawing's node, by a rigid lever, and not to the true position of the joint."""

    @property
    def labels(self) -> tuple[str, ...]:
        """(parameters,) names."""

    @property
    def prior_mean(self) -> Real:
        """(parameters,)."""

    @property
    def prior_deviation(self) -> Real:
        """(parameters,) standard deviations; infinite without prior knowledge."""

    def start(self, joints: Sequence[Joint]) -> Real:
        """(parameters,) nearest to `joints`."""

    def reach(self, values: Real) -> Real:
        """(parameters,) assumed error of start `values`; infinite where none is assumed."""

    def upper(self, values: Real) -> Complex:
        """(6 joints,) upper terms of z of all joints, joint by joint."""

    def slope(self, values: Real) -> Complex:
        """(6 joints, parameters) derivative of `upper`."""


def matrices(upper: Complex) -> Complex:
    """(joints, 3, 3) symmetric z of upper terms (6 joints,)."""
    terms = upper.reshape(-1, HALF)
    found = np.empty((len(terms), 3, 3), dtype=complex)
    for place, (p, q) in enumerate(UPPER):
        found[:, p, q] = found[:, q, p] = terms[:, place]
    return found


def upper_terms(joints: Sequence[Joint]) -> Complex:
    """(6 joints,) upper terms of the symmetric part of each joint's z."""
    parts = [(joint.dynamic_stiffness + joint.dynamic_stiffness.T) / 2 for joint in joints]
    return np.array([part[place] for part in parts for place in UPPER], dtype=complex)


def real_terms(upper: Complex) -> Real:
    """(12 joints, ...) real parts k, then imaginary parts h, joint by joint, of upper terms (6 joints, ...)."""
    by_joint = upper.reshape(-1, 1, HALF, *upper.shape[1:])
    return np.concatenate([by_joint.real, by_joint.imag], axis=1).reshape(-1, *upper.shape[1:])


@dataclass(frozen=True)
class SymmetricTerms:
    """All twelve terms of each joint, k11 ... k33 and h11 ... h33, without prior knowledge.

    Attributes:
        names: (joints,).
    """

    names: tuple[str, ...]
    seen_from_drawing: ClassVar[bool] = True

    @property
    def labels(self) -> tuple[str, ...]:
        """Names such as ``k11(I)``, joint by joint."""
        return tuple(f"{term}({name})" for name in self.names for term in TERMS)

    @property
    def prior_mean(self) -> Real:
        """Zeros."""
        return np.zeros(len(self.labels))

    @property
    def prior_deviation(self) -> Real:
        """Infinite."""
        return np.full(len(self.labels), np.inf)

    def start(self, joints: Sequence[Joint]) -> Real:
        """The terms of `joints`."""
        return real_terms(upper_terms(joints))

    def reach(self, values: Real) -> Real:
        """A share of the diagonal terms in their row and column."""
        size = np.abs(matrices(self.upper(values)).diagonal(axis1=1, axis2=2))
        size[:, 2] = np.maximum(size[:, 2], SHORT_LEVER**2 * np.max(size, axis=1))
        terms = np.array([[np.sqrt(row[p] * row[q]) for p, q in UPPER] for row in size])
        return REACH * np.tile(terms, 2).ravel()

    def upper(self, values: Real) -> Complex:
        """k + i h."""
        terms = values.reshape(-1, 2, HALF)
        return np.asarray(terms[:, 0] + 1j * terms[:, 1]).ravel()

    def slope(self, values: Real) -> Complex:  # noqa: ARG002 - the same everywhere
        """1 in each k and i in each h."""
        return np.asarray(block_diag(*len(self.names) * [np.hstack([np.eye(HALF), 1j * np.eye(HALF)])]))


@dataclass(frozen=True, eq=False, kw_only=True)
class HeldTerms(SymmetricTerms):
    """All terms, each with a Gaussian prior: a ridge for those that accelerances do not determine.

    Attributes:
        mean: (12 joints,).
        deviation: (12 joints,) one standard deviation.
    """

    mean: Real
    deviation: Real

    @property
    def prior_mean(self) -> Real:
        """As given."""
        return self.mean

    @property
    def prior_deviation(self) -> Real:
        """As given."""
        return self.deviation


def held_terms(joints: Sequence[Joint], share: float) -> HeldTerms:
    """Terms within a `share` of their size about those of `joints`.

    The size of a term is the geometric mean of the diagonal terms in its row and column, as for `reach`.
    """
    free = SymmetricTerms(tuple(joint.name for joint in joints))
    start = free.start(joints)
    return HeldTerms(free.names, mean=start, deviation=share / REACH * free.reach(start))
