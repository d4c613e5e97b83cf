"""A run as HDF5: records in physical units, results with intervals and where they come from."""

import json
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest

from store.catalogue import Catalogue
from store.errors import DamagedError, NotFoundError, StoreError
from store.exports.hdf5 import export_hdf5
from store.measurements.runs import list_runs


def test_every_blow_is_there_in_its_unit_with_verdict(
    catalogue: Catalogue, filled: int, tmp_path: Path, samples: SimpleNamespace
) -> None:
    assert export_hdf5(catalogue, filled, tmp_path / "run.h5") == 4
    waveform = samples.waveform("hammer", "N", "accelerometer", "m/s^2")
    with h5py.File(tmp_path / "run.h5") as file:
        assert sorted(file["blows"]) == ["1y", "4y"]
        assert [len(file[f"blows/{point}/set1"]) for point in ("1y", "4y")] == [3, 3]
        group = file["blows/1y/set1/02"]
        assert not group.attrs["accepted"]
        assert group.attrs["reason"].startswith("double hit")
        for channel, unit in (("hammer", "N"), ("accelerometer", "m/s^2")):
            np.testing.assert_array_equal(group[channel][:], waveform.value(channel))
            assert group[channel].attrs["units"] == unit
        assert group["hammer"].attrs["sensitivity"] == 0.0023
        assert file.attrs["format"] == "jointlab-hdf5/3"
        assert json.loads(file["setup"].asstr()[()]) == samples.setup


def test_sine_records_and_their_stiffness_are_there(
    catalogue: Catalogue, filled: int, tmp_path: Path, samples: SimpleNamespace
) -> None:
    with catalogue.reading() as session:
        (sweep,) = list_runs(session, kind="sweep")
    assert export_hdf5(catalogue, sweep.id, tmp_path / "run.h5") == 2
    with h5py.File(tmp_path / "run.h5") as file:
        group = file["sine_records/0001"]
        assert (group.attrs["specimen"], group.attrs["frequency"]) == ("I", 5.0)
        assert {name: group[name].attrs["units"] for name in group} == {"displacement": "m", "force": "N"}
        (points,) = file["results/dynamic_stiffness"].values()
        assert points.attrs["method"] == "sine fit"
        assert points.attrs["software_version"]
        for column, unit in (("stiffness", "N/m"), ("stiffness_se", "N/m"), ("frequency", "Hz"), ("thd_percent", "%")):
            expected = [getattr(each, column) for each in samples.dynamic_stiffness()]
            np.testing.assert_array_equal(points[column][:], expected)
            assert points[column].attrs["units"] == unit
        assert list(points["specimen"].asstr()) == ["I"] * 4
        assert np.isnan(points["sd_rel"][:]).all()


def test_responses_modes_and_joints_are_there_with_intervals_and_provenance(
    catalogue: Catalogue, filled: int, tmp_path: Path, samples: SimpleNamespace
) -> None:
    export_hdf5(catalogue, filled, tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5") as file:
        (responses,), (modes,), (joints,) = (
            file[f"results/{kind}"].values() for kind in ("frequency_responses", "modes", "joint_matrices")
        )
        expected = samples.frequency_responses()
        np.testing.assert_array_equal(responses["set1/accelerance"][:], expected.accelerance)
        np.testing.assert_array_equal(responses["set1/variance"][:], expected.variance)
        assert responses["set1/accelerance"].attrs["units"] == "(m/s^2)/N"
        assert list(responses["set1/input"].asstr()) == ["1y", "4y"]
        np.testing.assert_array_equal(modes["frequency_ci95"][:], samples.modes().frequency_ci95)
        assert list(modes["dof"].asstr()) == ["1y", "4y"]
        matrix = samples.joint_matrix("I", 2)
        for name in ("stiffness", "stiffness_ci95", "damping", "loss_factor_ci95", "observable", "covariance"):
            np.testing.assert_array_equal(joints[f"I/{name}"][:], getattr(matrix, name))
        assert f"analysis_{joints.attrs['parents'][0]}" in file["results/modes"]
        assert json.loads(joints.attrs["settings"]) == {"order": 20}


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
