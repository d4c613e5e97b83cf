"""Arrays in a binary column: numpy's own .npy bytes, with a CRC-32 behind them.

Any client reads them with ``numpy.load(io.BytesIO(column))``, which ignores the four bytes at the end.
"""

from __future__ import annotations

import io
import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from store.errors import DamagedError, StoreError

_CRC = struct.Struct("<I")


def encode_array(array: NDArray[Any], where: str, *, finite: bool = True) -> bytes:
    """Bytes of a numeric array that `decode_array` checks; `where` names it in the error.

    Raises:
        StoreError: the array does not hold numbers, or holds NaN or infinity where it has to be `finite`.
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
    """The array of `encode_array`, with its dtype and shape.

    Raises:
        DamagedError: the checksum differs; the message starts with `where`.
    """
    content, crc = column[: -_CRC.size], column[-_CRC.size :]
    if len(crc) != _CRC.size or _CRC.pack(zlib.crc32(content)) != crc:
        raise DamagedError(where, "the stored array is damaged (checksum differs)")
    return np.asarray(np.lib.format.read_array(io.BytesIO(content), allow_pickle=False))
