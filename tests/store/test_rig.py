"""What the store keeps of a rig: its limits as they were set last, and that one process at a time drives it."""

from __future__ import annotations

import pytest
from sqlalchemy import text

from store.catalogue import Catalogue
from store.errors import StoreError
from store.rig_limits import rig_limits, save_rig_limits
from store.rig_lock import RigBusyError, driving_alone
from tests.store.another_process import another_process


def test_the_limits_that_were_set_last_are_in_force_at_their_own_rig(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        assert rig_limits(session, "rig") is None
        save_rig_limits(session, "rig", {"force": 2e3}, "ann")
        save_rig_limits(session, "rig", {"force": 1e3}, "bob")
        save_rig_limits(session, "other", {"force": 3e3}, "bob")
    with catalogue.reading() as session:
        assert rig_limits(session, "rig") == {"force": 1e3}
        assert rig_limits(session, "none") is None


@pytest.mark.parametrize("statement", ["UPDATE rig_limits SET who = 'nobody'", "DELETE FROM rig_limits"])
def test_limits_that_were_in_force_are_never_changed(catalogue: Catalogue, filled: int, statement: str) -> None:
    with pytest.raises(StoreError, match="never changed or deleted"), catalogue.writing() as session:
        session.execute(text(statement))


def test_a_rig_is_driven_by_one_at_a_time_who_is_named(catalogue: Catalogue) -> None:
    with driving_alone(catalogue, "rig"):
        with pytest.raises(RigBusyError, match=r"'rig' is driven by .+@.+, process \d+; work there, or end it first"):
            driving_alone(catalogue, "rig").__enter__()
        with driving_alone(catalogue, "another rig"):
            pass
    with driving_alone(catalogue, "rig"):
        pass


def test_a_rig_is_free_when_whoever_drove_it_was_killed(catalogue: Catalogue) -> None:
    folder = catalogue.waveforms.folder
    script = (
        "import sys\nfrom pathlib import Path\nfrom store.process_lock import held_alone\n"
        f"with held_alone(Path({str(folder.with_name(folder.name + '-rig.lock'))!r})):\n"
        "    print('held', flush=True); sys.stdin.read()"
    )
    with another_process(script) as holder:
        with pytest.raises(RigBusyError, match="driven by another process"), driving_alone(catalogue, "rig"):
            pass
        holder.kill()
        holder.wait()
        with driving_alone(catalogue, "rig"):
            pass


def test_a_lock_that_cannot_be_made_is_named(catalogue: Catalogue) -> None:
    folder = catalogue.waveforms.folder
    folder.with_name(f"{folder.name}-rig.lock").mkdir()
    with pytest.raises(StoreError, match=r"-rig\.lock cannot be"), driving_alone(catalogue, "rig"):
        pass
