"""Runs that were stored to be begun at once, by a program that was killed before they began."""

from contextlib import closing
from pathlib import Path

import pytest

from jointlab.drive.endpoint import connect
from jointlab.drive.process import SPOOLS, driving
from jointlab.drive.protocol import Hello, Reply, TakeLease
from jointlab.runs.orders import order_to_begin, plan_run
from jointlab.settings import Settings, drive_folder
from jointlab.supervision.manager import RunManager
from rig.runs.records import BeginRecord
from rig.runs.spool import spooling
from rig.sequences.sequence import sequence_from
from rig.tester.limits import TesterLimits
from store.catalogue import Catalogue
from store.measurements.runs import Run, list_runs
from store.states import RunState
from store.version import release
from tests.api.conftest import paper
from tests.jointlab.runs.campaign import STARTED


def planned(catalogue: Catalogue, rig: str, *, provisional: bool) -> Run:
    return plan_run(sequence_from(paper()), TesterLimits(), catalogue, "test", rig=rig, provisional=provisional)


def known(catalogue: Catalogue) -> dict[int, RunState]:
    with catalogue.reading() as session:
        return {run.id: run.state for run in list_runs(session)}


def test_the_next_program_removes_them_and_nothing_else(catalogue: Catalogue, rig_settings: Settings) -> None:
    planned(catalogue, "rig", provisional=True)
    kept = [planned(catalogue, "rig", provisional=False).id, planned(catalogue, "other rig", provisional=True).id]
    begun = planned(catalogue, "rig", provisional=True)
    order = order_to_begin(begun, rig="rig", planned=False)
    with spooling(drive_folder(rig_settings) / SPOOLS, order) as spool:
        spool.write(BeginRecord(STARTED, "test", (), (), None))
    with driving(rig_settings), closing(RunManager(catalogue, rig_settings, starts=False)):
        expected = dict.fromkeys(kept, RunState.CREATED) | {begun.id: RunState.RUNNING}
        assert known(catalogue) == expected


@pytest.mark.parametrize("drives", [True, False])
def test_they_stay_while_another_program_drives_which_may_be_about_to_begin_one(
    catalogue: Catalogue, rig_settings: Settings, tmp_path: Path, drives: bool
) -> None:
    run = planned(catalogue, "rig", provisional=True)
    with driving(rig_settings), closing(connect(tmp_path / "drive", 5.0)) as other, other.makefile("rb") as lines:
        for request in (Hello(release=release(), name="other"), TakeLease(holder="ann" if drives else None)):
            other.sendall(request.model_dump_json().encode() + b"\n")
            assert Reply.model_validate_json(lines.readline()).error is None
        with closing(RunManager(catalogue, rig_settings, starts=False)):
            assert known(catalogue) == ({run.id: RunState.CREATED} if drives else {})
