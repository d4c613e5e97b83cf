"""How well a model predicts data that are left out: rows of each hammer set, and series of the tester, one at a time.

Evidence tells how well a model predicts all data from its priors alone; this density, how well each part from the
others (A. Gelman, J. Hwang, A. Vehtari, Statistics and Computing 24, 2014, 997-1016). The model is linear about its
fit, so that leaving a part out is a subtraction from the normal equations, after a step to the best fit at this
overdispersion.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.evidence.residual_structure import series
from analysis.gap.fitting.fit import Fit
from analysis.inverse.levenberg_marquardt import Linearised

Part = tuple[np.ndarray, Real, Real, float]
"""Indices of unknowns (n,), J^t J (n, n), J^t r (n,) and r^t r of one part."""


def density_of(parts: Iterable[Part], there: Linearised, overdispersion: float = 1.0) -> float:
    """Log density of all parts, each given the others, up to a constant that all models of the same data share.

    Args:
        parts: of the data.
        there: the normal equations of all data where the parts were taken, with chi-square divided by T.
        overdispersion: T, by which chi-square is divided.
    """
    whole = there.normal
    # If only one part tells about a parameter, the last steps, which a search saves, change its density much.
    step = np.linalg.solve(whole, there.descent)
    _, all_parts = np.linalg.slogdet(whole)
    total = 0.0
    for unknowns, normal, descent, chi_square in parts:
        others, own = whole.copy(), step[unknowns]
        others[np.ix_(unknowns, unknowns)] -= normal / overdispersion
        pull = np.zeros(len(others))
        pull[unknowns] = (descent - normal @ own) / overdispersion
        left = chi_square - float(own @ (2 * descent - normal @ own))
        # (1 - J N^-1 J^t)^-1 = 1 + J (N - J^t J)^-1 J^t is the precision of the part given the others
        _, without = np.linalg.slogdet(others)
        total -= (left / overdispersion + float(pull @ np.linalg.solve(others, pull)) + all_parts - without) / 2
    return total


def parts_of(found: Fit) -> tuple[Part, ...]:
    """The parts of the data: each row of the beam rig and each series of the tester."""
    return tuple(_parts(found))


def _parts(found: Fit) -> Iterator[Part]:
    for number, each in enumerate(found.likelihood.measurement.sets):
        for row in range(len(each.inputs)):
            for block in found.left_out([(number, row)]):
                yield block.unknowns, block.normal, block.descent, block.chi_square
    points = found.likelihood.measurement.points
    if points is None:
        return
    predicted = found.likelihood.predict(found.scores)
    columns = predicted.stiffness_by_shared / points.deviation
    left = (points.stiffness - predicted.stiffness) / points.deviation
    shared = np.arange(len(columns))
    for members in series(points).values():
        own, rest = columns[:, members], left[members]
        normal, descent = np.real(own.conj() @ own.T), np.real(own.conj() @ rest)
        yield shared, normal, descent, float(np.vdot(rest, rest).real)
