"""What accelerances determine of joint terms, with nothing assumed about the joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from analysis.frequency_response import Real
from analysis.inverse.joint_parameters import HALF
from analysis.inverse.observability import bounded_inverse
from analysis.inverse.response_likelihood import Information
from analysis.inverse.term_reasons import Reasons, too_wide, undetermined


@dataclass(frozen=True, eq=False)
class TermBound:
    """Cramer-Rao bounds of the terms of all joints, (12 joints, 12 joints), in the order of `regression.TERMS`.

    Attributes:
        as_drawn: where the bench is known exactly.
        within_tolerances: where it deviates by what its tolerances allow.
    """

    as_drawn: Real
    within_tolerances: Real

    def undetermined(self, values: Real, names: Sequence[str]) -> Reasons:
        """(12 joints,) why the data do not determine a term on its own, to a quarter of its value; empty where they do.

        A common factor, which gain, E and rho leave open, ties all terms together without making any a sum of others:
        so what is known in a sum only is judged with the bench as drawn.

        Args:
            values: (12 joints,) of the terms.
            names: (12 joints,) of the terms, as from `term_names`.
        """
        by_data = undetermined(self.as_drawn, values, names)
        by_bench = too_wide(self.within_tolerances, values, "the bench's tolerances leave")
        return np.where(by_data != "", by_data, by_bench)


def term_bound(information: Information, tolerance: Real, unit: Real) -> TermBound:
    """Bounds from the products of derivatives.

    Args:
        information: over upper terms of z, then active deviations.
        tolerance: (active, active) covariance of the latter.
        unit: (12 joints,) of the terms.
    """
    joints = unit.size // (2 * HALF)
    chain = block_diag(*joints * [np.hstack([np.eye(HALF), 1j * np.eye(HALF)])], np.eye(len(tolerance)))
    normal = np.real(chain.conj().T @ information.products @ chain)
    count = unit.size
    terms, across, others = normal[:count, :count], normal[:count, count:], normal[count:, count:]
    lost = np.zeros_like(terms)
    if tolerance.size:
        root = np.linalg.cholesky(tolerance)
        seen = across @ root
        lost = seen @ np.linalg.solve(root.T @ others @ root + np.eye(len(root)), seen.T)
    return TermBound(bounded_inverse(terms, unit), bounded_inverse(terms - lost, unit))
