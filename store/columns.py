"""NaN in arrays is NULL in columns: on both databases, and in the same places."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from store.errors import StoreError


def or_null(value: float) -> float | None:
    """A number for a column: NaN, which stands for not known, becomes NULL."""
    return None if math.isnan(value) else float(value)


def or_nan(value: float | None) -> float:
    """A number from a column: NULL becomes NaN."""
    return math.nan if value is None else value


def finite(value: float, where: str) -> float:
    """A number that has to be known.

    Raises:
        StoreError: it is NaN or infinite; the message starts with `where`.
    """
    if not math.isfinite(value):
        raise StoreError(f"{where}: {value} is not a finite number")
    return float(value)


def with_shape(array: NDArray[np.float64] | None, shape: tuple[int, ...], where: str) -> NDArray[np.float64]:
    """The array, or one of NaN where it is None.

    Raises:
        StoreError: it has another shape.
    """
    if array is None:
        return np.full(shape, np.nan)
    if array.shape != shape:
        raise StoreError(f"{where} has shape {array.shape}, expected {shape}")
    return array
