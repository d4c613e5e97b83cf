"""Frames of a spool: an append-only file in which a torn end is recognised, and so is every damaged byte.

A frame is a head (number of its bytes, its own number from 0, the CRC-32 of the bytes, the CRC-32 of these three) and
the bytes. A file that ends within a frame was torn by a lost process or a power cut: that frame was never acknowledged.
A frame of full length that does not fit a checksum is damaged.
"""

import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from store.errors import DamagedError

_FIELDS = struct.Struct("<QQI")
_CHECKED = struct.Struct("<QQII")


class SpoolDamagedError(DamagedError):
    """A frame does not fit its checksums."""


def frame_of(number: int, content: bytes) -> bytes:
    """The bytes of frame `number`."""
    fields = (len(content), number, zlib.crc32(content))
    return _CHECKED.pack(*fields, zlib.crc32(_FIELDS.pack(*fields))) + content


class FrameWriter:
    """Appends frames to a new file; a frame that `append` has returned from survives a power cut.

    Raises OSError where the file exists, or cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o640)
        self._number, self._end = 0, 0

    def append(self, content: bytes) -> None:
        """Write the next frame and flush it to the disk.

        Raises OSError where that fails. Nothing of a frame that does not fit stays in the file; one that could not be
        flushed stays, as it may have been read already.
        """
        frame = frame_of(self._number, content)
        left = memoryview(frame)
        os.lseek(self._file, self._end, os.SEEK_SET)
        try:
            while left:
                left = left[os.write(self._file, left) :]
        except OSError:
            os.ftruncate(self._file, self._end)
            raise
        self._number, self._end = self._number + 1, self._end + len(frame)
        os.fsync(self._file)

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)


@dataclass(frozen=True)
class SpoolFrame:
    """A frame that was read; the next one begins at byte `end` of the file."""

    number: int
    content: bytes
    end: int


def read_frames(path: Path, after: SpoolFrame | None = None) -> Iterator[SpoolFrame]:
    """The frames of a file after one that was read before, until the file ends; it may be written meanwhile.

    A frame that is not complete (yet, or for ever where its writer is gone) is not given. Raises SpoolDamagedError
    where a frame does not fit its checksums, OSError where the file cannot be read.
    """
    number, end = (0, 0) if after is None else (after.number + 1, after.end)
    with path.open("rb") as file:
        file.seek(end)
        while (content := _content(file, number, path)) is not None:
            end += _CHECKED.size + len(content)
            yield SpoolFrame(number, content, end)
            number += 1


def _content(file: BinaryIO, expected: int, path: Path) -> bytes | None:
    """The content of the next frame; None where it is not complete."""
    head = file.read(_CHECKED.size)
    if len(head) < _CHECKED.size:
        return None
    length, number, content_sum, head_sum = _CHECKED.unpack(head)
    if zlib.crc32(head[: _FIELDS.size]) != head_sum or number != expected:
        raise SpoolDamagedError(str(path), f"the head of record {expected} does not fit its checksum")
    content = file.read(length)
    if len(content) < length:
        return None
    if zlib.crc32(content) != content_sum:
        raise SpoolDamagedError(str(path), f"the content of record {expected} does not fit its checksum")
    return content
