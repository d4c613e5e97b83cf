"""A STOP on the disk: what is kept of it is there after a power cut, too."""

import os
from contextlib import closing
from pathlib import Path

import pytest

from jointlab.drive.kept_stop import KeptStop
from rig.tester.stop_latch import StopLatch, StopNotResetError
from tests.waiting import until


def test_a_stop_is_written_to_the_disk_with_the_name_of_its_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synchronised, file, latch = set[int](), tmp_path / "stop.latched", StopLatch()
    monkeypatch.setattr(os, "fsync", lambda descriptor: synchronised.add(os.fstat(descriptor).st_ino))
    with closing(KeptStop(file, latch)):
        stop = latch.stop("test", "a power cut follows")
        until(lambda: tmp_path.stat().st_ino in synchronised)
        assert file.stat().st_ino in synchronised
    with closing(KeptStop(file, after := StopLatch())):
        assert after.in_force is not None
        assert (after.in_force.who, after.in_force.why) == (stop.who, stop.why)
        with pytest.raises(StopNotResetError):
            after.reset(stop.epoch)  # a client that asks for this has not seen what the new process does
