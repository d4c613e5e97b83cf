"""Reading a bundle: a fault is refused with its file, key or line."""

import hashlib
import json
import shutil
import zipfile
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from store.catalogue import Catalogue
from store.errors import StoreError
from store.exchange.bundle import read_bundle
from store.exchange.bundle_exchange import import_bundle
from store.exchange.uff import UffModel, read_uff, write_uff
from store.measurements.runs import list_runs
from tests.recordings import Recording

EXAMPLES = (
    "amplitude", "delay", "foundation", "frame", "none", "novel_1", "novel_2", "out_of_plane", "pair", "sensor_mass"
)  # fmt: skip


def _edit(folder: Path, change: Callable[[dict[str, Any]], object]) -> None:
    document = json.loads((folder / "setup.json").read_text())
    change(document)
    (folder / "setup.json").write_text(json.dumps(document))


def test_a_bundle_is_read_whole(bundle: Path, samples: Any) -> None:
    found = read_bundle(bundle)
    expected = samples.frequency_responses()
    assert found.warnings == ()
    assert [str(dof) for dof in found.inverse[0].inputs] == ["1y", "4y"]
    np.testing.assert_array_equal(found.inverse[0].accelerance, expected.accelerance)
    np.testing.assert_array_equal(found.inverse[0].coherence, expected.coherence)
    assert (found.inverse[0].averages, found.inverse[0].peak_force) == (2, 102.0)
    assert [(point.amplitude_pp_mm, point.frequency_hz) for point in found.direct] == [
        (0.1, 5.0), (0.1, 10.0), (0.05, 5.0), (0.05, 10.0)
    ]  # fmt: skip
    assert [str(blow.point) for blow in found.blows] == ["1y", "1y", "4y", "4y"]
    assert (found.blows[0].sample_rate, found.blows[0].trigger_index) == (5120.0, 10)


@pytest.mark.parametrize("inside", ["", "my beam/"])
def test_a_zip_is_read_like_its_folder(bundle: Path, tmp_path: Path, inside: str) -> None:
    with zipfile.ZipFile(tmp_path / "bundle.zip", "w") as archive:
        for file in bundle.rglob("*.*"):
            archive.write(file, inside + file.relative_to(bundle).as_posix())
    found, expected = read_bundle(tmp_path / "bundle.zip"), read_bundle(bundle)
    assert (found.setup, found.direct) == (expected.setup, expected.direct)
    assert len(found.blows) == 4


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 and no more", b"point;value\n"])
def test_a_file_that_is_no_zip_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "bundle.zip").write_bytes(content)
    with pytest.raises(StoreError, match=r"bundle\.zip is neither a folder nor a whole zip file"):
        read_bundle(tmp_path / "bundle.zip")


def test_a_zip_that_is_cut_short_or_changed_is_refused(bundle: Path, tmp_path: Path) -> None:
    whole = Path(shutil.make_archive(str(tmp_path / "whole"), "zip", bundle)).read_bytes()
    damaged = bytearray(whole)
    damaged[whole.index(b"inverse_1.unv") + 200] ^= 0xFF
    for content in (whole[: len(whole) // 2], bytes(damaged)):
        (tmp_path / "bad.zip").write_bytes(content)
        with pytest.raises(StoreError, match=r"bad\.zip|inverse_1\.unv"):
            read_bundle(tmp_path / "bad.zip")


def test_a_path_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match=r"there is no bundle .*nowhere"):
        read_bundle(tmp_path / "nowhere")


@pytest.mark.parametrize("name", ["setup.json", "direct.csv", "inverse_1.unv"])
def test_a_missing_file_is_named(bundle: Path, name: str) -> None:
    (bundle / name).unlink()
    with pytest.raises(StoreError, match=f"{name} is missing"):
        read_bundle(bundle)


def test_a_bundle_without_blows_is_whole(bundle: Path) -> None:
    shutil.rmtree(bundle / "blows")
    assert read_bundle(bundle).blows == ()


def test_a_file_that_is_not_named_is_ignored_with_a_warning(bundle: Path) -> None:
    shutil.copy(bundle / "inverse_1.unv", bundle / "inverse_2.unv")
    assert read_bundle(bundle).warnings == ("inverse_2.unv is not named in setup.json and is ignored",)


def test_a_blow_in_a_file_of_another_name_is_ignored_with_a_warning(bundle: Path) -> None:
    (bundle / "blows" / BLOW).rename(bundle / "blows" / "blow_1y_set1_01.UFF")
    found = read_bundle(bundle)
    assert len(found.blows) == 3
    assert found.warnings == ("blows/blow_1y_set1_01.UFF does not end in .unv and is ignored",)


def test_a_zip_of_a_mac_is_read_without_what_it_adds(bundle: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "bundle.zip", "w") as archive:
        for file in bundle.rglob("*.*"):
            archive.write(file, Path("bundle") / file.relative_to(bundle))
            archive.writestr(f"__MACOSX/bundle/._{file.name}", b"attributes")
    assert read_bundle(tmp_path / "bundle.zip").setup == read_bundle(bundle).setup


def test_a_window_that_cannot_be_corrected_for_is_stored_with_a_warning(bundle: Path) -> None:
    _edit(bundle, lambda setup: setup["inverse"][0].update(window="hanning"))
    found = read_bundle(bundle)
    assert found.inverse[0].window == "hanning"
    (warning,) = found.warnings
    assert warning.startswith("inverse_1.unv: 'hanning' is not a window that can be corrected for")


@pytest.mark.parametrize("name", ["direct.csv", "inverse_1.unv", "blows/blow_1y_set1_01.unv"])
def test_a_checksum_that_differs_is_refused_by_file(bundle: Path, name: str) -> None:
    right = hashlib.sha256((bundle / name).read_bytes()).hexdigest()
    _edit(bundle, lambda setup: setup.update(checksums={name: right}))
    assert read_bundle(bundle).setup.checksums == {}
    _edit(bundle, lambda setup: setup.update(checksums={name: "0" * 64}))
    with pytest.raises(StoreError, match=f"{name}: checksum differs"):
        read_bundle(bundle)


@pytest.mark.parametrize(("name", "said"), [("gone.unv", "gone.unv is missing"), ("../lab.db", "not a file of the")])
def test_a_checksum_of_a_file_that_the_bundle_does_not_hold_is_refused(bundle: Path, name: str, said: str) -> None:
    _edit(bundle, lambda setup: setup.update(checksums={name: "0" * 64}))
    with pytest.raises(StoreError, match=said):
        read_bundle(bundle)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda setup: setup["accelerometer"].update(node=4), "inverse_1.unv: the response is at 3y, .* at 4y"),
        (lambda setup: setup["inverse"][0].update(sample_rate=6), "inverse_1.unv: frequencies reach 4 Hz"),
        (lambda setup: setup["joints"][0].update(name="A"), "direct.csv, line 2: specimen 'I'"),
        (lambda setup: setup["inverse"][0].update(file="direct.csv"), "setup.json: setup: a file comes twice"),
        (lambda setup: setup.pop("tolerances"), "setup.json: tolerances: is missing"),
    ],
)
def test_a_setup_that_its_files_contradict_is_refused(
    bundle: Path, change: Callable[[dict[str, Any]], object], said: str
) -> None:
    _edit(bundle, change)
    with pytest.raises(StoreError, match=said):
        read_bundle(bundle)


def test_a_node_that_the_beam_does_not_have_is_refused(bundle: Path) -> None:
    _edit(bundle, lambda setup: setup.update(node_positions=[0.0, 0.06, 0.914]))
    _edit(bundle, lambda setup: setup["joints"][1].update(node=3))
    with pytest.raises(StoreError, match=r"inverse_1\.unv: unknown point 4y; nodes are 1 to 3"):
        read_bundle(bundle)


BLOW = "blow_1y_set1_01.unv"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"values": np.ones(7)}, "7 samples of force, 100 of acceleration|100 samples of force, 7"),
        ({"unit": "V"}, "found: (N, )?V"),
        ({"step": 0.1}, "not on one clock"),
        ({"abscissa_unit": "ms"}, "time is in 'ms'"),
        ({"values": np.ones(100, complex)}, "is complex"),
    ],
)
@pytest.mark.parametrize("row", [0, 1])
def test_a_blow_that_makes_no_sense_is_refused_by_file(
    bundle: Path, row: int, change: dict[str, Any], said: str
) -> None:
    functions = list(read_uff(bundle / "blows" / BLOW).functions)
    functions[row] = replace(functions[row], **change)
    write_uff(bundle / "blows" / BLOW, functions)
    with pytest.raises(StoreError, match=f"{BLOW}.*({said})"):
        read_bundle(bundle)


def test_a_blow_that_begins_after_its_trigger_is_refused(bundle: Path) -> None:
    functions = [replace(function, start=1.0) for function in read_uff(bundle / "blows" / BLOW).functions]
    write_uff(bundle / "blows" / BLOW, functions)
    with pytest.raises(StoreError, match=f"{BLOW}: time runs from 1 s"):
        read_bundle(bundle)


def test_an_acceleration_for_a_blow_elsewhere_is_refused(bundle: Path) -> None:
    force, acceleration = read_uff(bundle / "blows" / BLOW).functions
    write_uff(bundle / "blows" / BLOW, [force, replace(acceleration, reference=acceleration.response)])
    with pytest.raises(StoreError, match=f"{BLOW}: the force is at 1y, the acceleration is for a blow elsewhere"):
        read_bundle(bundle)


def test_nodes_that_lie_elsewhere_than_in_the_setup_are_told(bundle: Path) -> None:
    setup = read_bundle(bundle).setup
    file = bundle / setup.inverse[0].file
    positions = list(setup.node_positions)
    drawn = UffModel("beam", [0.1 + place for place in positions], datetime(2026, 3, 1, tzinfo=UTC))
    write_uff(file, read_uff(file).functions, drawn)
    assert read_bundle(bundle).warnings == ()
    write_uff(file, read_uff(file).functions, replace(drawn, positions=[*positions[:-1], positions[-1] + 0.02]))
    (warning,) = read_bundle(bundle).warnings
    assert warning.startswith(f"{file.name}: node {len(positions)} is ")
    assert warning.endswith(" m in setup.json")
    write_uff(file, read_uff(file).functions, replace(drawn, positions=[-place for place in positions]))
    (warning,) = read_bundle(bundle).warnings
    assert "and the other way in setup.json; check the signs of rows along the beam" in warning


def test_a_force_without_its_acceleration_is_refused(bundle: Path) -> None:
    write_uff(bundle / "blows" / BLOW, read_uff(bundle / "blows" / BLOW).functions[:1])
    with pytest.raises(
        StoreError, match=rf"{BLOW}: expected one force \(N, lbf\) and one acceleration \(m/s\^2, g\), found: N"
    ):
        read_bundle(bundle)


@given(data=st.data())
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_damage_gives_a_bundle_or_an_error_of_the_store_and_stores_nothing(
    exported: Path, tmp_path: Path, data: st.DataObject
) -> None:
    folder = tmp_path / "damaged"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(exported, folder)
    _edit(folder, lambda setup: setup.pop("checksums"))
    files = sorted(path for path in folder.rglob("*.*") if path.is_file())
    path = data.draw(st.sampled_from(files), label="file")
    content = bytearray(path.read_bytes())
    at = data.draw(st.integers(0, len(content)), label="at")
    content[at : at + data.draw(st.integers(0, 40), label="length")] = data.draw(st.binary(max_size=20), label="by")
    path.write_bytes(content)
    with Catalogue.open(f"sqlite:///{tmp_path / 'damage.db'}") as opened:
        before = _runs(opened)
        said = ""
        try:
            import_bundle(opened, folder)
        except StoreError as error:
            said = str(error)
        assert "\n" not in said
        assert _runs(opened) == (before if said else before + 1)
        files_left = list(opened.waveforms.folder.glob("*")) if opened.waveforms.folder.exists() else []
        assert len(files_left) <= _runs(opened)


def _runs(opened: Catalogue) -> int:
    with opened.reading() as session:
        return len(list_runs(session))


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_example_is_read_without_a_warning(recording: Recording, name: str) -> None:
    found = read_bundle(recording(f"examples/{name}"))
    assert found.warnings == ()
    assert len(found.direct) == 720
    assert len(found.inverse) == len(found.setup.inverse)
    for measured in found.inverse:
        assert measured.accelerance.shape == (9, 2049)
        assert measured.frequency[-1] == 1024.0
        assert measured.coherence is not None
    assert len(found.blows) == (3 if name in ("none", "delay") else 0)
