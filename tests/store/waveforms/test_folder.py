"""Waveforms: every bit back, damage found and named, nothing acknowledged is lost."""

import signal
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from store.errors import DamagedError, NotFoundError, StoreError
from store.waveforms.folder import WaveformFolder
from store.waveforms.waveform import Waveform, WaveformChannel, WaveformReference
from store.waveforms.waveform_codec import decode, encode

FILE = "20260101-abc.waveforms"


def blow(samples: int = 64) -> Waveform:
    counts = np.arange(2 * samples, dtype=np.int32).reshape(2, samples) ** 2
    return Waveform(
        channels=(
            WaveformChannel("hammer", "N", (0.5, 2e-6), 0.0023),
            WaveformChannel("accelerometer", "m/s^2", (0.0, 1e-6, 1e-15), 0.0102),
        ),
        samples=counts,
        sample_rate=5120.0,
        started_at=datetime(2026, 1, 2, 3, 4, 5, 678901, tzinfo=UTC),
        trigger_index=7,
        overloaded=("hammer",),
    )


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[WaveformFolder]:
    opened = WaveformFolder(tmp_path)
    yield opened
    opened.close()


def damage(folder: WaveformFolder) -> list[str]:
    found = []
    try:
        for _, error in folder.verify(FILE):
            found += [] if error is None else [str(error)]
    except DamagedError as error:
        found.append(str(error))
    return found


SHAPES = hnp.array_shapes(min_dims=2, max_dims=2, max_side=40)
FINITE = st.floats(allow_nan=False, allow_infinity=False)


@given(st.one_of(hnp.arrays(np.int32, SHAPES), hnp.arrays(np.float64, SHAPES, elements=FINITE)))
def test_every_sample_comes_back_exactly(samples: NDArray[Any]) -> None:
    channels = tuple(WaveformChannel(f"c{index}", "V") for index in range(samples.shape[0]))
    back = decode(*encode(Waveform(channels, samples, 1000.0)), "test")
    assert back.samples.dtype == samples.dtype
    assert back.samples.tobytes() == samples.tobytes()


def test_a_waveform_comes_back_with_all_that_was_stored(folder: WaveformFolder) -> None:
    stored = blow()
    back = folder.read(folder.append(FILE, stored))
    assert np.array_equal(back.samples, stored.samples)
    for name in ("channels", "sample_rate", "started_at", "trigger_index", "overloaded"):
        assert getattr(back, name) == getattr(stored, name)


def test_counts_become_physical_values_by_polynomial_and_sensitivity() -> None:
    counts = blow().samples[1].astype(float)
    assert blow().value("accelerometer") == pytest.approx((1e-6 * counts + 1e-15 * counts**2) / 0.0102, rel=1e-14)


def test_an_unknown_channel_is_named_with_those_there_are() -> None:
    with pytest.raises(NotFoundError, match="no channel 'force'; it has hammer, accelerometer"):
        blow().value("force")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"samples": np.zeros((2, 3), np.float32)}, "float32"),
        ({"samples": np.zeros((3, 3), np.int32)}, r"shape \(3, 3\)"),
        ({"samples": np.zeros((2, 0), np.int32)}, r"shape \(2, 0\)"),
        ({"samples": np.full((2, 3), np.nan)}, "not finite"),
        ({"channels": (WaveformChannel("a", "N"), WaveformChannel("a", "N"))}, "not unique"),
        ({"sample_rate": 0.0}, "sample rate"),
    ],
)
def test_a_waveform_that_makes_no_sense_is_refused(change: dict[str, object], said: str) -> None:
    fields = {"channels": blow().channels, "samples": blow().samples, "sample_rate": 1.0, **change}
    with pytest.raises(StoreError, match=said):
        Waveform(**fields)  # type: ignore[arg-type]  # wrong on purpose


def test_a_local_start_time_is_refused(folder: WaveformFolder) -> None:
    naive = Waveform(blow().channels, blow().samples, 1.0, started_at=datetime(2026, 1, 1))
    with pytest.raises(StoreError, match="time zone"):
        folder.append(FILE, naive)


def test_records_are_numbered_in_the_order_of_appending(folder: WaveformFolder) -> None:
    references = [folder.append(FILE, blow()), *folder.append_all(FILE, [blow(), blow()])]
    assert [reference.record for reference in references] == [1, 2, 3]
    assert folder.records(FILE) == references


def test_a_finished_file_is_one_plain_file(folder: WaveformFolder, tmp_path: Path) -> None:
    reference = folder.append(FILE, blow())
    folder.finish(FILE)
    assert [path.name for path in tmp_path.iterdir()] == [FILE]
    assert np.array_equal(folder.read(reference).samples, blow().samples)
    assert [path.name for path in tmp_path.iterdir()] == [FILE]


def test_another_process_reads_while_the_file_is_being_written(folder: WaveformFolder, tmp_path: Path) -> None:
    reference = folder.append(FILE, blow())
    assert WaveformFolder(tmp_path).read(reference).trigger_index == 7


def test_records_cannot_be_changed_or_deleted(folder: WaveformFolder, tmp_path: Path) -> None:
    folder.append(FILE, blow())
    folder.finish(FILE)
    connection = sqlite3.connect(tmp_path / FILE)
    for statement in ("UPDATE records SET crc = 0", "DELETE FROM records"):
        with pytest.raises(sqlite3.IntegrityError, match="never"):
            connection.execute(statement)
    connection.close()


def _damage(path: Path, column: str, value: object) -> None:
    connection = sqlite3.connect(path)
    connection.execute("DROP TRIGGER records_are_never_changed")
    connection.execute(f"UPDATE records SET {column} = ? WHERE number = 2", (value,))
    connection.commit()
    connection.close()


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("crc", 1),
        ("samples", b"not zlib"),
        ("samples", encode(Waveform(blow().channels, blow().samples + np.int32(1), 5120.0))[1]),
        ("header", encode(blow())[0].replace("5120.0", "5121.0")),
        ("header", "{}"),
        ("header", "nonsense"),
    ],
)
def test_a_damaged_record_is_named_and_its_neighbours_are_well(
    folder: WaveformFolder, tmp_path: Path, column: str, value: object
) -> None:
    references = folder.append_all(FILE, [blow(), blow(), blow()])
    folder.finish(FILE)
    _damage(tmp_path / FILE, column, value)
    with pytest.raises(DamagedError, match=f"{FILE} record 2: .* damaged"):
        folder.read(references[1])
    assert [number for number, damage in folder.verify(FILE) if damage] == [2]
    assert folder.read(references[2]).trigger_index == 7


def test_bytes_overwritten_on_the_disk_are_found(folder: WaveformFolder, tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    noise = rng.integers(-(2**23), 2**23, (2, 20_000), dtype=np.int32)
    folder.append(FILE, Waveform(blow().channels, noise, 1000.0))
    folder.finish(FILE)
    assert damage(folder) == []
    content = bytearray((tmp_path / FILE).read_bytes())
    content[len(content) // 2] ^= 0x10
    (tmp_path / FILE).write_bytes(content)
    assert "record 1" in damage(folder)[0]


def test_a_file_that_is_no_waveform_file_is_called_damaged(folder: WaveformFolder, tmp_path: Path) -> None:
    (tmp_path / FILE).write_bytes(b"no database " * 1000)
    with pytest.raises(DamagedError, match=FILE):
        folder.read(WaveformReference(FILE, 1))
    with pytest.raises(DamagedError, match=FILE):
        folder.append(FILE, blow())


def test_missing_file_and_record_are_told_apart(folder: WaveformFolder) -> None:
    with pytest.raises(NotFoundError, match="was the folder moved"):
        folder.read(WaveformReference(FILE, 1))
    folder.append(FILE, blow())
    with pytest.raises(NotFoundError, match="no record 9"):
        folder.read(WaveformReference(FILE, 9))


def test_a_name_that_leads_out_of_the_folder_is_refused(folder: WaveformFolder) -> None:
    with pytest.raises(StoreError, match="not the name"):
        folder.append("../elsewhere", blow())


def test_a_folder_that_cannot_be_made_is_explained(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(StoreError, match="cannot be written"):
        WaveformFolder(tmp_path / "file" / "below").append(FILE, blow())


WRITER = """
import sys
from pathlib import Path
import numpy as np
from store.waveforms.waveform import Waveform, WaveformChannel
from store.waveforms.folder import WaveformFolder
folder = WaveformFolder(Path(sys.argv[1]))
for index in range(10_000):
    samples = np.full((2, 500), index, np.int32)
    waveform = Waveform((WaveformChannel("a", "N"), WaveformChannel("b", "N")), samples, 1000.0)
    print(folder.append(sys.argv[2], waveform).record, flush=True)
"""


def test_every_acknowledged_record_survives_a_killed_process(folder: WaveformFolder, tmp_path: Path) -> None:
    writer = subprocess.Popen([sys.executable, "-c", WRITER, str(tmp_path), FILE], stdout=subprocess.PIPE, text=True)
    assert writer.stdout is not None
    acknowledged = [int(next(writer.stdout)) for _ in range(20)]
    writer.send_signal(signal.SIGKILL)
    acknowledged += [int(line) for line in writer.stdout if line.endswith("\n")]
    writer.wait()
    writer.stdout.close()
    assert damage(folder) == []
    assert len(folder.records(FILE)) in (len(acknowledged), len(acknowledged) + 1)
    for record in acknowledged:
        assert folder.read(WaveformReference(FILE, record)).samples[0, 0] == record - 1
    assert folder.append(FILE, blow()).record == len(folder.records(FILE))


# Finishing a file ends in such a change; this one is long enough to be cut off with certainty.
CUT_OFF = """
import os
import signal
import sqlite3
import sys
half_done = sqlite3.connect(sys.argv[1], isolation_level=None)
half_done.execute("PRAGMA cache_size = 1")
half_done.execute("BEGIN IMMEDIATE")
half_done.executemany("INSERT INTO records (header, samples, crc) VALUES ('', ?, 0)", [(bytes(10_000),)] * 100)
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_file_that_was_cut_off_half_changed_is_read_as_it_was_before(folder: WaveformFolder, tmp_path: Path) -> None:
    references = folder.append_all(FILE, [blow(), blow(32)])
    folder.finish(FILE)
    subprocess.run([sys.executable, "-c", CUT_OFF, str(tmp_path / FILE)], check=False)
    reader = sqlite3.connect(f"{(tmp_path / FILE).as_uri()}?mode=ro", uri=True)
    with closing(reader), pytest.raises(sqlite3.OperationalError, match="readonly"):
        reader.execute("SELECT * FROM records")
    assert folder.records(FILE) == references
    assert damage(folder) == []


def test_a_blow_is_stored_in_less_than_six_tenths_of_its_raw_size() -> None:
    rng = np.random.default_rng(2)
    time = np.arange(10_240) / 5120
    ringing = 1e6 * np.exp(-3 * time) * np.sin(2 * np.pi * 300 * time)
    samples = (np.stack([rng.normal(0, 30, time.size), ringing]) + rng.normal(0, 30, (2, time.size))).astype(np.int32)
    _, compressed, _ = encode(Waveform(blow().channels, samples, 5120.0))
    assert len(compressed) < 0.6 * samples.nbytes
