"""One process at a time holds a lock, and none when it was killed; `test_runs` tests the locks of runs."""

from pathlib import Path

import pytest

from store.database.file_lock import LockHeldError, exclusive_lock
from store.errors import StoreError
from tests.store.another_process import another_process


def test_one_holder_at_a_time(tmp_path: Path) -> None:
    with exclusive_lock(tmp_path / "a.lock"):
        with pytest.raises(LockHeldError, match=r"a\.lock is held by another process"):
            exclusive_lock(tmp_path / "a.lock").__enter__()
        with exclusive_lock(tmp_path / "b.lock"):
            pass
    with exclusive_lock(tmp_path / "a.lock"):
        pass


def test_a_lock_is_free_when_its_process_was_killed(tmp_path: Path) -> None:
    script = (
        "import sys\nfrom pathlib import Path\nfrom store.database.file_lock import exclusive_lock\n"
        f"with exclusive_lock(Path({str(tmp_path / 'a.lock')!r})):\n"
        "    print('held', flush=True); sys.stdin.read()"
    )
    with another_process(script) as holder:
        with pytest.raises(LockHeldError), exclusive_lock(tmp_path / "a.lock"):
            pass
        holder.kill()
        holder.wait()
        with exclusive_lock(tmp_path / "a.lock"):
            pass


def test_a_lock_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "a.lock").mkdir()
    with pytest.raises(StoreError, match=r"a\.lock cannot be"), exclusive_lock(tmp_path / "a.lock"):
        pass
