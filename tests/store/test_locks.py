"""One process at a time drives a rig; `test_run_events` tests the locks of runs."""

import pytest

from store.catalogue import Catalogue
from store.errors import StoreError
from store.locks import RigBusyError, rig_lock
from tests.store.another_process import another_process


def test_one_process_at_a_time_drives_a_rig_and_is_named(catalogue: Catalogue) -> None:
    with rig_lock(catalogue, "rig"):
        with pytest.raises(RigBusyError, match=r"'rig' is driven by .+@.+, process \d+; work there, or end it first"):
            rig_lock(catalogue, "rig").__enter__()
        with rig_lock(catalogue, "another rig"):
            pass
    with rig_lock(catalogue, "rig"):
        pass


def test_a_rig_is_free_when_its_process_was_killed(catalogue: Catalogue) -> None:
    folder = catalogue.waveforms.folder
    script = (
        "import sys\nfrom pathlib import Path\nfrom store.file_lock import exclusive_lock\n"
        f"with exclusive_lock(Path({str(folder.with_name(folder.name + '-rig.lock'))!r})):\n"
        "    print('held', flush=True); sys.stdin.read()"
    )
    with another_process(script) as holder:
        with pytest.raises(RigBusyError, match="driven by another process"), rig_lock(catalogue, "rig"):
            pass
        holder.kill()
        holder.wait()
        with rig_lock(catalogue, "rig"):
            pass


def test_a_lock_that_cannot_be_made_is_named(catalogue: Catalogue) -> None:
    folder = catalogue.waveforms.folder
    folder.with_name(f"{folder.name}-rig.lock").mkdir()
    with pytest.raises(StoreError, match=r"-rig\.lock cannot be"), rig_lock(catalogue, "rig"):
        pass
