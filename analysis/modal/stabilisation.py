"""Which poles stay put as the model order rises: the stabilisation chart, read without clicking.

A pole of one order is stable when an earlier order, one or two below, has a pole closer to it than a fraction of
its own half bandwidth |Re lambda| (or of half a line spacing, where the lines are coarser than the peak). Stable
poles link up to columns. A column that is long enough and reaches the top of the chart is a candidate mode. The
likelihood decides about candidates afterwards (`estimation`); here nothing needs an order chosen by hand.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.frequency_response import Complex, Real
from analysis.modal.lscf import OrderPoles
from analysis.modal.modal_model import LARGEST_LOSS_FACTOR

_CLOSENESS = 0.3  # of the half bandwidth, between a pole and its predecessor
_SHORTEST_COLUMN = 5  # orders


@dataclass(frozen=True)
class Stabilisation:
    """The stabilisation chart, a point for each pole of each order.

    Attributes:
        order: (points,) model order.
        frequency: (points,) in Hz.
        loss_factor: (points,) dimensionless.
        stable: (points,) whether an earlier order has nearly the same pole.
        column: (points,) index of the candidate in `candidates` that the point belongs to, or -1.
        candidates: (columns,) poles in rad/s of the columns that reach the top, sorted by frequency.
    """

    order: NDArray[np.int64]
    frequency: Real
    loss_factor: Real
    stable: NDArray[np.bool_]
    column: NDArray[np.int64]
    candidates: Complex


def read_chart(
    orders: tuple[OrderPoles, ...], lowest: float, highest: float, line_spacing: float, decay: float = 0.0
) -> Stabilisation:
    """Link the poles of rising orders to columns and pick those that reach the top.

    Args:
        orders: poles of every order, rising.
        lowest, highest: frequencies in Hz; poles outside them are ignored.
        line_spacing: of the measured spectrum, Hz.
        decay: of the exponential window in 1/s, taken out of the poles of the chart.
    """
    columns: list[list[tuple[int, complex]]] = []  # of (order, pole)
    points: list[tuple[int, complex, int]] = []  # order, pole, index of its column
    for entry in orders:
        poles = entry.poles + decay
        square = -(poles**2)
        frequency = np.sqrt(np.abs(square.real)) / (2 * np.pi)
        within = (square.real > 0) & (frequency >= lowest) & (frequency <= highest)
        for pole in poles[within & (poles.real < 0) & (square.imag < LARGEST_LOSS_FACTOR * square.real)]:
            nearest = _column_of(complex(pole), entry.order, columns, line_spacing)
            if nearest is None:
                nearest = len(columns)
                columns.append([])
            columns[nearest].append((entry.order, complex(pole)))
            points.append((entry.order, complex(pole), nearest))
    top = orders[-1].order
    chosen = [k for k, column in enumerate(columns) if len(column) >= _SHORTEST_COLUMN and column[-1][0] >= top - 1]
    chosen.sort(key=lambda k: columns[k][-1][1].imag)
    poles = np.array([pole for _, pole, _ in points], dtype=complex)
    square = -(poles**2)
    return Stabilisation(
        order=np.array([order for order, _, _ in points], dtype=np.int64),
        frequency=np.sqrt(square.real) / (2 * np.pi),
        loss_factor=square.imag / square.real,
        stable=np.array([columns[k][0] != (order, pole) for order, pole, k in points], dtype=bool),
        column=np.array([chosen.index(k) if k in chosen else -1 for _, _, k in points], dtype=np.int64),
        candidates=np.array([columns[k][-1][1] for k in chosen], dtype=complex),
    )


def _column_of(pole: complex, order: int, columns: list[list[tuple[int, complex]]], line_spacing: float) -> int | None:
    """The nearest column that was alive one or two orders ago and has no pole of this order yet."""
    reach = _CLOSENESS * max(-pole.real, np.pi * line_spacing)
    best, nearest = reach, None
    for index, column in enumerate(columns):
        last_order, last_pole = column[-1]
        if order - 2 <= last_order < order and abs(last_pole - pole) < best:
            best, nearest = abs(last_pole - pole), index
    return nearest
