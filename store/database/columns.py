"""Numbers and arrays in columns, the same on both databases.

NaN in an array is NULL in a column of numbers. An array in a binary column is numpy's own .npy bytes with a CRC-32
behind them; any client reads it with ``numpy.load(io.BytesIO(column))``, which ignores the four bytes at the end.
"""

import io
import math
import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from store.errors import DamagedError, StoreError

_CRC = struct.Struct("<I")


def or_null(value: float) -> float | None:
    """A number for a column: NaN, which stands for not known, becomes NULL."""
    return None if math.isnan(value) else float(value)


def or_nan(value: float | None) -> float:
    """A number from a column: NULL becomes NaN."""
    return math.nan if value is None else value


def finite(value: float, where: str) -> float:
    """The number; StoreError, whose message starts with `where`, if it is NaN or infinite."""
    if not math.isfinite(value):
        raise StoreError(f"{where}: {value} is not a finite number")
    return float(value)


def with_shape(array: NDArray[np.float64] | None, shape: tuple[int, ...], where: str) -> NDArray[np.float64]:
    """The array, or one of NaN where it is None; StoreError if it has another shape."""
    if array is None:
        return np.full(shape, np.nan)
    if array.shape != shape:
        raise StoreError(f"{where} has shape {array.shape}, expected {shape}")
    return array


def encode_array(array: NDArray[Any], where: str, *, finite: bool = True) -> bytes:
    """Bytes of a numeric array that `decode_array` checks; `where` names it in the error.

    Raises StoreError if the array does not hold numbers, or holds NaN or infinity where it has to be `finite`.
    """
    if array.dtype.kind not in "iufcb":
        raise StoreError(f"{where}: an array of {array.dtype} cannot be stored")
    if finite and not np.all(np.isfinite(array)):
        raise StoreError(f"{where}: holds values that are not finite numbers")
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.ascontiguousarray(array), allow_pickle=False)
    content = stream.getvalue()
    return content + _CRC.pack(zlib.crc32(content))


def decode_array(column: bytes, where: str) -> NDArray[Any]:
    """The array of `encode_array`; DamagedError, whose message starts with `where`, if the checksum differs."""
    content, crc = column[: -_CRC.size], column[-_CRC.size :]
    if len(crc) != _CRC.size or _CRC.pack(zlib.crc32(content)) != crc:
        raise DamagedError(where, "the stored array is damaged (checksum differs)")
    return np.asarray(np.lib.format.read_array(io.BytesIO(content), allow_pickle=False))


def encode_covariance(array: NDArray[np.float64] | None, where: str) -> bytes | None:
    """As `encode_array`; a covariance may be infinite where the data do not determine a component."""
    return None if array is None else encode_array(array, where, finite=False)


def decode_optional(column: bytes | None, where: str) -> NDArray[Any] | None:
    """As `decode_array`; None for NULL."""
    return None if column is None else decode_array(column, where)
