"""Normal equations of rows of accelerances and of the tester, with noise and smooth errors.

The block of a row holds its own unknowns, and the information of the row about errors that all rows of its point have
in common. `joint` marginalises these errors.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.dof import Dof
from analysis.frequency_response import Complex, Real
from analysis.gap.fitting.model_error import Row, RowErrors, common_covariance, product
from analysis.gap.measurement import Rig
from analysis.inverse.levenberg_marquardt import Linearised


@dataclass(frozen=True, eq=False)
class NormalBlock:
    """The normal equations of one row of accelerances, or of all points of the tester, in some of the unknowns.

    Attributes:
        rig: that it is read on.
        set_number, row: indices of the row; -1 in the tester.
        point: struck; None in the tester.
        unknowns: (n,) indices of the unknowns that it depends on.
        normal: (n, n) J^t J.
        descent: (n,) J^t r.
        chi_square: r^t r.
        data: number of real and imaginary parts.
        errors: smooth errors of the row, whose own part is marginalised in the above; None without them.
        common: (n + 1, 2, coefficients) information of J and r about the errors in common with its point, for `joint`.
    """

    rig: Rig
    set_number: int
    row: int
    point: Dof | None
    unknowns: NDArray[np.intp]
    normal: Real
    descent: Real
    chi_square: float
    data: int
    errors: RowErrors | None = None
    common: Real | None = None

    @classmethod
    def of(cls, rig: Rig, place: Row, point: Dof | None, unknowns: Sequence[int], whole: Complex) -> NormalBlock:
        """A block from whitened derivatives and the whitened residual, (n + 1, values), without smooth errors."""
        parts = as_parts(whole)
        products = parts @ parts.T
        normal, descent, chi_square = products[:-1, :-1], products[:-1, -1], float(products[-1, -1])
        return cls(rig, *place, point, np.array(unknowns), normal, descent, chi_square, parts.shape[1])

    def under(self, errors: RowErrors, own: Real, common: Real) -> NormalBlock:
        """This block of noise alone, under smooth errors that take these parts of J and r (`RowErrors.taken`)."""
        return self.less(own, errors, common if common.size else None)

    def less(self, taken: Real, errors: RowErrors | None = None, common: Real | None = None) -> NormalBlock:
        """This block without the squares of a part (n + 1, ...) of J and r, and with these errors."""
        part = taken.reshape(len(taken), -1)
        products = part @ part.T
        return replace(
            self,
            normal=self.normal - products[:-1, :-1],
            descent=self.descent - products[:-1, -1],
            chi_square=self.chi_square - float(products[-1, -1]),
            errors=errors,
            common=common,
        )


def joint(blocks: Sequence[NormalBlock]) -> NormalBlock:
    """One block for rows of one point, with the errors that they have in common marginalised."""
    errors = tuple(each.errors for each in blocks if each.errors is not None and each.common is not None)
    if len(blocks) == 1 and not errors:
        return blocks[0]
    there = np.zeros(1 + max(int(each.unknowns.max()) for each in blocks), dtype=bool)
    for each in blocks:
        there[each.unknowns] = True
    unknowns, rank = np.flatnonzero(there), np.cumsum(there) - 1
    places = [np.append(rank[each.unknowns], unknowns.size) for each in blocks]
    normal, descent = np.zeros((unknowns.size, unknowns.size)), np.zeros(unknowns.size)
    for each, place in zip(blocks, places, strict=True):
        normal[np.ix_(place[:-1], place[:-1])] += each.normal
        descent[place[:-1]] += each.descent
    chi_square, data = sum(each.chi_square for each in blocks), sum(each.data for each in blocks)
    found = NormalBlock(blocks[0].rig, -1, -1, blocks[0].point, unknowns, normal, descent, chi_square, data)
    if not errors:
        return found
    root, _ = common_covariance(errors)
    said = np.zeros((unknowns.size + 1, 2, len(root)))
    for each, place in zip(blocks, places, strict=True):
        said[place] += each.common
    return found.less(product(said, root))


def normal_equations(blocks: Sequence[NormalBlock], values: Real) -> Linearised:
    """The sum of the normal equations of all blocks, given by `Likelihood.blocks`, and of the prior."""
    normal, descent, cost = np.eye(values.size), -values.copy(), float(values @ values)
    for block in map(joint, by_point(blocks)):
        normal[np.ix_(block.unknowns, block.unknowns)] += block.normal
        descent[block.unknowns] += block.descent
        cost += block.chi_square
    return Linearised(cost, descent, normal)


def beyond(whole: NormalBlock, rest: NormalBlock) -> NormalBlock:
    """The difference of the normal equations of all rows of a point and of some of them."""
    place = np.searchsorted(whole.unknowns, rest.unknowns)
    normal, descent = whole.normal.copy(), whole.descent.copy()
    normal[np.ix_(place, place)] -= rest.normal
    descent[place] -= rest.descent
    chi_square, data = whole.chi_square - rest.chi_square, whole.data - rest.data
    return replace(whole, normal=normal, descent=descent, chi_square=chi_square, data=data)


def by_point(blocks: Iterable[NormalBlock]) -> list[list[NormalBlock]]:
    """Blocks that have smooth errors in common, together."""
    found = dict[Dof | Row | None, list[NormalBlock]]()
    for each in blocks:
        found.setdefault((each.set_number, each.row) if each.common is None else each.point, []).append(each)
    return list(found.values())


def as_parts(values: Complex) -> Real:
    """(..., 2 n) real and imaginary parts of (..., n)."""
    return np.ascontiguousarray(values).view(np.float64)
