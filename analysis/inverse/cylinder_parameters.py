"""Joints by the stiffnesses of their cylinders, Eqs. (8)-(11): fewer parameters than terms of the matrices.

The matrix of a joint is linear in a, b, c, d of its cylinders, and their inclinations are known. Where the data do not
separate terms of the matrices, such as k11 of two joints on a beam that hardly stretches, the cylinders relate them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.linalg import block_diag

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.inverse.joint_parameters import HALF, REACH, upper_terms
from analysis.structure.joints import Joint

CYLINDER_TERMS = ("a", "b", "c", "d")
"""Shear, compression, rotation, and coupling of rotation with shear of Eq. (8); N/m, N/m, N m, N."""
COUNT = 2 * len(CYLINDER_TERMS)  # real and imaginary parts of a joint's four terms, followed by two inclinations
PRIOR_DEVIATION = (np.inf, np.inf, np.inf, 1e3)
"""For the real and the imaginary parts of a, b, c, d, about zero. Coupling d and rotation c of opposed cylinders have
the same effect on k33; d within 1000 N leaves c uncertain by about 10 N m, and without a bound c is undetermined."""


@dataclass(frozen=True)
class CylinderPair:
    """Construction of a joint: a lower and an upper cylinder of one kind.

    Attributes:
        name: of the joint.
        inclinations: (2,) theta of the lower and the upper cylinder as drawn, rad.
        eccentricity: of both, m; the lower counts as minus it.
    """

    name: str
    inclinations: tuple[float, float]
    eccentricity: float

    def terms(self, leaning: Real) -> tuple[Real, Real]:
        """(6, 4) upper terms for a unit of a, b, c, d, with the cylinders `leaning` (2,) off the drawing, rad.

        Returns:
            The terms, and (2, 6, 4) their derivatives in the two inclinations.
        """
        lower, upper = (
            _terms_of_cylinder(nominal + off, offset)
            for nominal, off, offset in zip(
                self.inclinations, leaning, (-self.eccentricity, self.eccentricity), strict=True
            )
        )
        return lower[0] + upper[0], np.array([lower[1], upper[1]])


@dataclass(frozen=True)
class CylinderParameters:
    """Complex a, b, c, d of each joint's cylinders, and how far each of them leans off the drawing.

    Attributes:
        pairs: (joints,) in the order of the joints.
        inclination: standard deviation of each inclination, rad; zero holds them as drawn.
    """

    pairs: tuple[CylinderPair, ...]
    inclination: float = 0.0
    seen_from_drawing: ClassVar[bool] = False

    @property
    def names(self) -> tuple[str, ...]:
        """(joints,)."""
        return tuple(pair.name for pair in self.pairs)

    @property
    def labels(self) -> tuple[str, ...]:
        """Names such as ``Re a(I)`` and ``leaning of the lower cylinder(I)``, joint by joint."""
        names = [f"{part} {term}" for part in ("Re", "Im") for term in CYLINDER_TERMS]
        names += [f"leaning of the {which} cylinder" for which in ("lower", "upper")] if self.inclination else []
        return tuple(f"{name}({pair.name})" for pair in self.pairs for name in names)

    @property
    def prior_mean(self) -> Real:
        """Zeros."""
        return np.zeros(len(self.labels))

    @property
    def prior_deviation(self) -> Real:
        """Prior deviations of the cylinders' parts, and the tolerance of their inclinations."""
        return self._joined([(PRIOR_DEVIATION, PRIOR_DEVIATION, self.inclination) for _ in self.pairs])

    def start(self, joints: Sequence[Joint]) -> Real:
        """Least squares for a, b, c with d zero, cylinders as drawn, translations and rotation apart.

        Raises:
            AnalysisError: the joints are not those of the pairs.
        """
        if tuple(joint.name for joint in joints) != self.names:
            raise AnalysisError(
                f"cylinders are given for joints {', '.join(self.names)}, matrices for "
                f"{', '.join(joint.name for joint in joints)}; give both in one order"
            )
        parts = []
        for pair, upper in zip(self.pairs, upper_terms(joints).reshape(-1, HALF), strict=True):
            terms, _ = pair.terms(np.zeros(2))
            translations = [0, 1, 3]
            a, b = np.linalg.lstsq(terms[translations, :2].astype(complex), upper[translations])[0]
            c = (upper[5] - terms[5, 0] * a - terms[5, 1] * b) / terms[5, 2]
            values = np.array([a, b, c, 0.0])
            parts.append((values.real, values.imag, 0.0))
        return self._joined(parts)

    def reach(self, values: Real) -> Real:
        """A share of each cylinder's terms; infinite for those that start at zero."""
        sizes = REACH * np.abs(self._split(values)[0])
        sizes[sizes == 0] = np.inf
        return self._joined([(size, size, np.inf) for size in sizes])

    def upper(self, values: Real) -> Complex:
        """(6 joints,) upper terms, Eq. (11)."""
        parts = zip(self.pairs, *self._split(values), strict=True)
        return np.concatenate([pair.terms(leaning)[0] @ cylinder for pair, cylinder, leaning in parts])

    def slope(self, values: Real) -> Complex:
        """(6 joints, parameters) derivative of `upper`."""
        blocks = []
        for pair, cylinder, leaning in zip(self.pairs, *self._split(values), strict=True):
            terms, in_leaning = pair.terms(leaning)
            block = np.hstack([terms, 1j * terms])
            blocks.append(np.hstack([block, (in_leaning @ cylinder).T]) if self.inclination else block)
        return np.asarray(block_diag(*blocks))

    def _split(self, values: Real) -> tuple[Complex, Real]:
        """(joints, 4) a, b, c, d and (joints, 2) leaning."""
        rows = values.reshape(len(self.pairs), -1)
        leaning = rows[:, COUNT:] if self.inclination else np.zeros((len(rows), 2))
        return np.asarray(rows[:, : COUNT // 2] + 1j * rows[:, COUNT // 2 : COUNT]), leaning

    def _joined(self, parts: Sequence[tuple[Real | tuple[float, ...], Real | tuple[float, ...], float]]) -> Real:
        """(parameters,) of the real parts, the imaginary parts and one number for both inclinations of each joint."""
        ends = 2 if self.inclination else 0
        return np.concatenate([[*real, *imaginary, *ends * [leaning]] for real, imaginary, leaning in parts])


def _terms_of_cylinder(inclination: float, eccentricity: float) -> tuple[Real, Real]:
    """(6, 4) upper terms of Eq. (9) for a unit of a, b, c, d, and their derivative in the inclination."""
    c, s = np.cos(inclination), np.sin(inclination)
    e = eccentricity

    def upper(k11: Real, k12: Real, k22: Real, d1: float, d2: float, c33: float) -> Real:
        """Terms at the beam's axis from those at the end of the cylinder."""
        d = np.array([0, 0, 0, 1])
        k13, k23 = d1 * d - e * k11, d2 * d - e * k12
        k33 = c33 * np.array([0, 0, 1, 0]) - 2 * e * d1 * d + e**2 * k11
        return np.array([k11, k12, k13, k22, k23, k33])

    a, b = np.eye(4)[:2]
    terms = upper(c**2 * a + s**2 * b, c * s * (a - b), s**2 * a + c**2 * b, c, s, 1.0)
    turning = upper(2 * c * s * (b - a), (c**2 - s**2) * (a - b), 2 * c * s * (a - b), -s, c, 0.0)
    return terms, turning
