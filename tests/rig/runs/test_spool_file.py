"""What was acknowledged is read back; a torn end is cut off, and every damaged bit is found."""

import errno
import os
import subprocess
import sys
from itertools import accumulate
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.runs.spool_file import FrameWriter, SpoolFrame, frame_of, read_frames
from store.errors import DamagedError

CONTENTS = st.lists(st.binary(max_size=60), min_size=1, max_size=6)


def read(path: Path) -> list[bytes]:
    """The content of every frame, until the file ends."""
    return [frame.content for frame in read_frames(path)]


def frames(contents: list[bytes]) -> list[bytes]:
    return [frame_of(number, content) for number, content in enumerate(contents)]


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("spool") / "records"


@given(contents=CONTENTS)
def test_what_was_appended_is_read_back(contents: list[bytes], path: Path) -> None:
    path.unlink(missing_ok=True)
    writer = FrameWriter(path)
    for number, content in enumerate(contents):
        writer.append(content)
        assert read(path) == contents[: number + 1]  # while it is written
    writer.close()
    assert path.read_bytes() == b"".join(frames(contents))


@given(contents=CONTENTS, data=st.data())
def test_a_file_that_is_cut_anywhere_keeps_every_whole_frame(
    contents: list[bytes], data: st.DataObject, path: Path
) -> None:
    ends = list(accumulate(map(len, frames(contents))))
    cut = data.draw(st.integers(0, ends[-1]), "cut")
    path.write_bytes(b"".join(frames(contents))[:cut])
    assert read(path) == contents[: sum(end <= cut for end in ends)]


@given(contents=CONTENTS, data=st.data())
def test_a_bit_that_is_flipped_anywhere_is_found_and_what_is_before_it_is_read(
    contents: list[bytes], data: st.DataObject, path: Path
) -> None:
    whole = bytearray(b"".join(frames(contents)))
    bit = data.draw(st.integers(0, 8 * len(whole) - 1), "bit")
    whole[bit // 8] ^= 1 << bit % 8
    path.write_bytes(whole)
    found = list[bytes]()
    with pytest.raises(DamagedError, match="does not fit its checksum"):
        found.extend(frame.content for frame in read_frames(path))
    before = sum(end <= bit // 8 for end in accumulate(map(len, frames(contents))))
    assert found == contents[:before]


def test_a_reader_goes_on_where_the_file_ended_before(path: Path) -> None:
    first, second = frames([b"first", b"second"])
    path.write_bytes(first + second[:9])
    (read_before,) = read_frames(path)
    assert read_before == SpoolFrame(0, b"first", len(first))
    assert list(read_frames(path, read_before)) == []
    path.write_bytes(first + second)
    assert list(read_frames(path, read_before)) == [SpoolFrame(1, b"second", len(first + second))]


def test_a_frame_out_of_order_is_damage(path: Path) -> None:
    path.write_bytes(frame_of(0, b"a") + frame_of(2, b"c"))
    with pytest.raises(DamagedError, match="record 1"):
        read(path)


FULL = """
import resource, signal, sys
from pathlib import Path
from rig.runs.spool_file import FrameWriter

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))
writer = FrameWriter(Path(sys.argv[1]))
writer.append(b"before")
try:
    writer.append(bytes(2000))
except OSError as error:
    print(error.strerror)
writer.append(b"after")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no limit on the size of a file")
def test_nothing_of_a_frame_that_did_not_fit_stays_in_the_file(path: Path) -> None:
    path.unlink(missing_ok=True)
    done = subprocess.run([sys.executable, "-c", FULL, path], capture_output=True, text=True, check=True)
    assert done.stdout == "File too large\n"
    assert read(path) == [b"before", b"after"]


def test_a_frame_that_could_not_be_flushed_does_not_hide_the_next_one(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_file: int) -> None:
        raise OSError(errno.EIO, "Input/output error")

    path.unlink(missing_ok=True)
    writer = FrameWriter(path)
    with monkeypatch.context() as broken:
        broken.setattr(os, "fsync", fail)
        with pytest.raises(OSError, match="Input/output error"):
            writer.append(b"perhaps")
    writer.append(b"the end")
    writer.close()
    assert read(path) == [b"perhaps", b"the end"]
