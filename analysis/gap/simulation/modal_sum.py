"""Sums over the free modes of a beam at many lines; modes far above all lines are summed at a few lines only."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.measurement import Indices
from analysis.gap.simulation.free_beam_modes import modal_stiffness

FAR_ABOVE = 4.0
"""Multiple of the highest line, above which modes are summed at a few lines only."""
NODES = 6
"""Number of these lines: the polynomial through them is right to a millionth of what those modes add."""


@dataclass(frozen=True, eq=False)
class ModalSum:
    """The free modes of a beam at some lines.

    Attributes:
        parts: (N,) modal mass, damping and stiffness of each mode.
        angular_frequency: (N,) rad/s, ascending.
        pole: (lines,) 1/s.
        loss: (lines or 1,) structural loss factor beyond the free damping.
    """

    parts: tuple[Real, Real, Real]
    angular_frequency: Real
    pole: Complex
    loss: Real

    def receptance(self, rows: Real, columns: Real) -> Complex:
        """(lines, rows, columns) between `rows` (rows, N) and `columns` (columns, N) of modes, m/N."""
        low, high = self._compliance
        return np.asarray(self._summed(rows, columns, low[None], high[None])[0])

    def slopes(self, rows: Real, columns: Real, weights: Real) -> Complex:
        """(n, lines, rows, columns) minus the derivatives of `receptance` in n parameters.

        `weights` (n, N) are the derivatives of the modes' dynamic stiffness.
        """
        (low, high), count = self._compliance, self._split[0]
        return self._summed(rows, columns, low**2 * weights[:, :count, None], high**2 * weights[:, count:, None])

    @cached_property
    def _split(self) -> tuple[int, Indices, Real]:
        """Number of low modes, lines at which the others are summed, and (nodes, lines) that interpolates between them.

        Far below its frequency the compliance of a mode is a smooth function: a polynomial through a few lines.
        """
        frequency, every = np.abs(self.pole.imag), self.angular_frequency.size
        low = int(np.searchsorted(self.angular_frequency, FAR_ABOVE * np.max(frequency)))
        smooth = np.all(self.loss == np.ravel(self.loss)[0])  # over frequency, beside the modes
        if frequency.size <= 2 * NODES or low >= every or not smooth:
            return every, np.zeros(0, dtype=np.intp), np.zeros((0, frequency.size))
        order = np.argsort(frequency)
        cosine = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
        first, last = frequency[order[[0, -1]]]
        wanted = (first + last) / 2 + (last - first) / 2 * cosine
        nodes = np.unique(order[np.clip(np.searchsorted(frequency[order], wanted), 0, frequency.size - 1)])
        scaled = frequency / last
        powers = np.arange(nodes.size)
        basis = np.linalg.solve(scaled[nodes] ** powers[:, None], scaled ** powers[:, None])
        return low, nodes, np.asarray(basis)

    @cached_property
    def _compliance(self) -> tuple[Complex, Complex]:
        """(low, lines) of the low modes, and (N - low, nodes) of the others."""
        low, nodes, _ = self._split
        loss = np.broadcast_to(self.loss, self.pole.shape)
        below, above = (tuple(each[part] for each in self.parts) for part in (slice(low), slice(low, None)))
        return 1 / modal_stiffness(below, self.pole, loss), 1 / modal_stiffness(above, self.pole[nodes], loss[nodes])

    def _summed(self, rows: Real, columns: Real, low: Complex, high: Complex) -> Complex:
        """(n, lines, rows, columns) sums of `rows` times `columns` times a field of each mode.

        `low` (n, low, lines) are the fields of the low modes, `high` (n, N - low, nodes) those of the others.
        """
        count, nodes, basis = self._split
        found = _times(_products(rows[:, :count], columns[:, :count]), low)
        if nodes.size:
            found += _times(_products(rows[:, count:], columns[:, count:]), high) @ basis
        return np.ascontiguousarray(np.swapaxes(found, 1, 2)).reshape(len(found), -1, len(rows), len(columns))


def _products(rows: Real, columns: Real) -> Real:
    """(rows columns, N) products of every row with every column."""
    return np.asarray((rows[:, None] * columns).reshape(-1, rows.shape[-1]))


def _times(rows: Real, fields: Complex) -> Complex:
    """(..., rows, lines) real `rows` (..., rows, N) times complex `fields` (..., N, lines), the rows kept real."""
    return (rows @ np.ascontiguousarray(fields).view(np.float64)).view(np.complex128)
