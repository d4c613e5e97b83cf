"""Measured accelerances against predicted ones, row by row."""

from __future__ import annotations

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real


def frac(first: Complex, second: Complex) -> Real:
    """(rows,) frequency response assurance criterion |a^H b|^2 / (a^H a b^H b) of complex responses over their lines.

    W. Heylen and S. Lammens, Proc. Int. Conf. on Identification in Engineering Systems, Swansea 1996. One factor on a
    whole row does not lower it.

    Args:
        first: (rows, lines).
        second: (rows, lines).

    Raises:
        AnalysisError: they differ in shape, or a row is zero.
    """
    if first.shape != second.shape:
        raise AnalysisError(f"responses of shape {first.shape} and {second.shape} cannot be compared")
    sizes = np.sum(np.abs(first) ** 2, axis=-1) * np.sum(np.abs(second) ** 2, axis=-1)
    if np.any(sizes == 0):
        raise AnalysisError("a row of zeros has no frequency response assurance criterion")
    return np.asarray(np.abs(np.sum(first.conj() * second, axis=-1)) ** 2 / sizes)
