"""Disks that are full or hang are known without waiting for them."""

import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

from jointlab import disk_probe
from jointlab.disk_probe import DiskProbe
from tests.waiting import LONG, until


def test_a_disk_with_space_is_no_trouble_also_where_the_folder_is_not_made_yet(tmp_path: Path) -> None:
    with DiskProbe([tmp_path / "later" / "spools"], least=1, period=0.01) as probe:
        for _ in range(3):
            assert probe.trouble is None


def test_a_full_disk_is_told_until_it_has_space_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = SimpleNamespace(free=5_000_000)
    monkeypatch.setattr("jointlab.disk_probe.shutil.disk_usage", lambda _folder: usage)
    with DiskProbe([tmp_path], least=200_000_000, period=0.01) as probe:
        until(lambda: probe.trouble is not None)
        assert probe.trouble == f"the disk of {tmp_path} is full: 5 MB are free, 200 MB are needed"
        usage.free = 300_000_000
        until(lambda: probe.trouble is None)


def test_a_disk_that_hangs_is_told_and_waited_for_by_nobody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    may_answer = threading.Event()

    def hang(_folder: Path) -> SimpleNamespace:
        may_answer.wait(LONG)
        return SimpleNamespace(free=1)

    monkeypatch.setattr(disk_probe, "LATE", 0.05)
    monkeypatch.setattr("jointlab.disk_probe.shutil.disk_usage", hang)
    with DiskProbe([tmp_path], least=1, period=0.01) as probe:
        until(lambda: probe.trouble == f"the disk of {tmp_path} does not answer")
    may_answer.set()
