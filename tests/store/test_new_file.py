"""Files and folders that appear when they are complete, and not before."""

import errno
import os
import shutil
from pathlib import Path
from typing import Any

import pytest

from store.errors import StoreError
from store.new_file import UNFINISHED, new_folder


@pytest.fixture
def full_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """One that takes a file and a half, in another file system than that of temporary files."""
    copied, plain = list[object](), shutil.copyfile

    def copyfile(source: Any, target: Any, **options: Any) -> object:
        copied.append(target)
        if len(copied) == 2 or str(target).endswith((".zip", ".zip.unfinished")):
            Path(target).write_bytes(Path(source).read_bytes()[:1])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return plain(source, target, **options)

    def rename(_source: object, _target: object) -> None:
        raise OSError(errno.EXDEV, os.strerror(errno.EXDEV))

    monkeypatch.setattr(shutil, "copyfile", copyfile)
    monkeypatch.setattr(os, "rename", rename)


def write_into(path: Path) -> None:
    with new_folder(path) as folder:
        for name in ("one", "two", "three"):
            (folder / name).write_text(name, encoding="utf-8")


@pytest.mark.usefixtures("full_disk")
@pytest.mark.parametrize("name", ["run", "run.zip"])
def test_nothing_is_left_where_the_disk_is_full(tmp_path: Path, name: str) -> None:
    with pytest.raises(StoreError, match="No space left on device"):
        write_into(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("full_disk")
def test_an_empty_folder_is_empty_again_where_the_disk_is_full(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="No space left on device"):
        write_into(tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("is_there", [True, False])
def test_a_folder_is_written_beside_what_was_cut_off(tmp_path: Path, is_there: bool) -> None:
    (tmp_path / "run.unfinished").mkdir()
    (tmp_path / "run.unfinished" / "older").touch()
    if is_there:
        (tmp_path / "run").mkdir()
    write_into(tmp_path / "run")
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == ["one", "three", "two"]


def test_what_a_killed_program_leaves_is_beside_the_result_and_named_unfinished(tmp_path: Path) -> None:
    with new_folder(tmp_path / "run-1.zip") as folder:
        (left,) = tmp_path.iterdir()
        assert left.name.startswith("run-1.zip.")
        assert left.suffix == UNFINISHED
        assert folder.is_relative_to(left)
    assert [each.name for each in tmp_path.iterdir()] == ["run-1.zip"]
