"""Averaging of the longitudinal shape components, as Section 3 does before the identification.

The beam is taken for rigid along its axis: all x components of a mode become one number, the mean of
their magnitudes at the mean of their phases. That removes the scatter between them, and with it the
elastic strain, which carries the difference of the two joints' axial forces: the price is a bias, on
the paper's bench 8 % in k12 of joint I.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.dof import Direction, Dof
from analysis.frequency_response import Complex


def averaged(shapes: Complex, measured: Sequence[Dof]) -> Complex:
    """(modes, measured) `shapes` at `measured` with the x components averaged in magnitude and phase."""
    columns = _along_beam(measured)
    result = np.array(shapes, dtype=complex)
    if columns.size > 1:
        result[:, columns] = _mean(result[:, columns])[:, None]
    return result


def averaged_change(shapes: Complex, change: Complex, measured: Sequence[Dof]) -> Complex:
    """(modes, directions, measured) first-order change of `averaged` for a `change` of `shapes` (modes, measured)."""
    columns = _along_beam(measured)
    result = np.array(change, dtype=complex)
    if columns.size > 1:
        components = shapes[:, None, columns]
        magnitude = np.maximum(np.abs(components), np.finfo(float).tiny)
        relative = np.conj(components) * change[..., columns] / magnitude
        turn = np.mean(relative.imag / magnitude, axis=-1)
        growth = np.mean(relative.real, axis=-1)
        mean = _mean(shapes[:, columns])[:, None]
        unit = mean / np.maximum(np.abs(mean), np.finfo(float).tiny)
        result[..., columns] = (growth * unit + 1j * turn * mean)[..., None]
    return result


def _along_beam(measured: Sequence[Dof]) -> NDArray[np.intp]:
    return np.array([i for i, dof in enumerate(measured) if dof.direction is Direction.X], dtype=np.intp)


def _mean(components: Complex) -> Complex:
    """(modes,) mean magnitude at the mean phase; phases are counted from the first component's."""
    first = components[:, :1]
    phase = np.angle(first[:, 0]) + np.mean(np.angle(components * first.conj()), axis=1)
    return np.asarray(np.mean(np.abs(components), axis=1) * np.exp(1j * phase))
