"""Runs that were stored to be begun at once, by a program that was killed before they began."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from jointlab.drive.endpoint import UnansweredError, connect
from jointlab.drive.process import SPOOLS, driving
from jointlab.drive.protocol import Begin, DriveRequest, Hello, Reply, TakeLease
from jointlab.runs.orders import order_to_begin, plan_run
from jointlab.settings import Settings, drive_folder
from jointlab.supervision.drive_link import _Line
from jointlab.supervision.manager import RunManager
from rig.errors import RigError, RunStoppedError
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
from tests.waiting import LONG


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


def test_a_run_that_does_not_begin_is_removed_at_once(catalogue: Catalogue, rig_settings: Settings) -> None:
    with driving(rig_settings), closing(RunManager(catalogue, rig_settings, starts=False)) as rig:
        rig.stop("test")
        with pytest.raises(RunStoppedError):
            rig.run(sequence_from(paper()), "test")
        assert known(catalogue) == {}


def test_where_it_cannot_be_removed_the_error_is_still_the_one_that_kept_it_from_beginning(
    impatient: None, catalogue: Catalogue, rig_settings: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with driving(rig_settings), closing(RunManager(catalogue, rig_settings, starts=False)) as rig:

        def refuse(*_: object) -> None:
            other.execute("BEGIN IMMEDIATE")
            raise RigError("no instrument answers")

        monkeypatch.setattr(rig, "_begin", refuse)
        with (
            closing(sqlite3.connect(tmp_path / "jointlab.db")) as other,
            pytest.raises(RigError, match="no instrument answers") as raised,
        ):
            rig.run(sequence_from(paper()), "test")
        assert "run 1 was stored, did not begin and cannot be removed now" in raised.value.__notes__[0]
        assert known(catalogue) == {1: RunState.CREATED}


def test_a_run_stays_where_nobody_has_answered_whether_it_begins(
    catalogue: Catalogue, rig_settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The drive process may be late: what it measures then needs the run."""
    asked = list[DriveRequest]()
    sent = _Line.send

    def is_late(line: _Line, request: DriveRequest) -> None:
        if isinstance(request, Begin):
            asked.append(request)
            line.end()
        else:
            sent(line, request)

    monkeypatch.setattr(_Line, "send", is_late)
    with driving(rig_settings), closing(RunManager(catalogue, rig_settings, starts=False)) as rig:
        with pytest.raises(UnansweredError) as raised:
            rig.run(sequence_from(paper() | {"steps": [{"step": "wait", "seconds": 600}]}), "test")
        assert raised.value.__notes__ == ["run 1 may begin all the same; look at the rig"]
        monkeypatch.undo()
        rig._link.ask(asked[0], LONG)
        assert rig.stop("test") == 1
        assert rig.wait(LONG)
        assert known(catalogue) == {1: RunState.STOPPED}
