"""The waveforms of a run as HDF5: raw samples with their scaling."""

from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest

from store.catalogue import Catalogue
from store.errors import DamagedError, NotFoundError, StoreError
from store.hdf5 import export_hdf5
from store.runs import list_runs


def test_every_blow_is_there_with_scale_and_verdict(
    catalogue: Catalogue, filled: int, tmp_path: Path, samples: SimpleNamespace
) -> None:
    assert export_hdf5(catalogue, filled, tmp_path / "run.h5") == 6
    waveform = samples.waveform("hammer", "N", "accelerometer", "m/s^2")
    with h5py.File(tmp_path / "run.h5") as file:
        assert sorted(file["blows"]) == ["1y", "4y"]
        group = file["blows/1y/set1/02"]
        assert not group.attrs["accepted"]
        assert group.attrs["reason"].startswith("double hit")
        hammer = group["hammer"]
        np.testing.assert_array_equal(hammer[:], waveform.samples[0])
        volts = np.polynomial.polynomial.polyval(hammer[:].astype(float), hammer.attrs["coefficients"])
        np.testing.assert_array_equal(volts / hammer.attrs["sensitivity"], waveform.value("hammer"))
        assert hammer.attrs["unit"] == "N"


def test_sine_records_are_there(catalogue: Catalogue, filled: int, tmp_path: Path) -> None:
    with catalogue.reading() as session:
        (sweep,) = list_runs(session, kind="sweep")
    assert export_hdf5(catalogue, sweep.id, tmp_path / "run.h5") == 1
    with h5py.File(tmp_path / "run.h5") as file:
        group = file["sine_records/0001"]
        assert (group.attrs["specimen"], group.attrs["frequency"]) == ("I", 5.0)
        assert set(group) == {"displacement", "force"}


def test_a_damaged_waveform_leaves_no_file(catalogue: Catalogue, filled: int, tmp_path: Path) -> None:
    catalogue.waveforms.close()
    for path in catalogue.waveforms.folder.iterdir():
        content = bytearray(path.read_bytes())
        content[-700] ^= 0xFF
        path.write_bytes(content)
    with pytest.raises(DamagedError, match="damaged"):
        export_hdf5(catalogue, filled, tmp_path / "run.h5")
    assert not list(tmp_path.glob("run.h5*"))


def test_a_file_that_cannot_be_written_is_refused(catalogue: Catalogue, filled: int, tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="no run 77"):
        export_hdf5(catalogue, 77, tmp_path / "run.h5")
    (tmp_path / "taken.h5").write_text("")
    with pytest.raises(StoreError, match="exists already"):
        export_hdf5(catalogue, filled, tmp_path / "taken.h5")
    with pytest.raises(StoreError, match="cannot be written"):
        export_hdf5(catalogue, filled, tmp_path / "nowhere" / "run.h5")
