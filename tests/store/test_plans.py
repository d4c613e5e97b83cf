"""What services ask for again and again is found by an index, however many runs of however many rigs there are."""

from collections.abc import Callable
from datetime import UTC, datetime

import pytest
from sqlalchemy.orm import Session

from store.catalogue import Catalogue
from store.measurements import runs
from store.measurements.runs import finish_run, latest_of_rig, list_runs, reopen_run, start_run
from store.service.jobs import count_jobs, count_open_jobs, find_open_job
from store.states import RunState
from tests.store.plans import plans_of

DAY, NEXT = datetime(2026, 3, 1, tzinfo=UTC), datetime(2026, 3, 2, tzinfo=UTC)


@pytest.mark.parametrize("database_kind", ["sqlite"])
@pytest.mark.parametrize(
    ("ask", "index"),
    [
        (
            lambda session: list_runs(session, since=DAY, until=NEXT),
            "ix_runs_started_at_id (started_at>? AND started_at<?)",
        ),
        (lambda session: list_runs(session, since=DAY), "ix_runs_started_at_id (started_at>? AND started_at<?)"),
        (lambda session: list_runs(session, until=DAY), "ix_runs_started_at_id (started_at>? AND started_at<?)"),
        (lambda session: list_runs(session, kind="sweep"), "ix_runs_kind_id (kind=?)"),
        (lambda session: latest_of_rig(session, "a rig"), "ix_runs_rig_id (rig=?)"),
        (lambda session: find_open_job(session, "identify", {}), "ix_jobs_state_id (state=?)"),
        (lambda session: count_open_jobs(session, "who"), "ix_jobs_state_id (state=?)"),
        (count_jobs, "ix_jobs_state_id (state=?)"),
    ],
)
def test_an_index_finds_it(catalogue: Catalogue, ask: Callable[[Session], object], index: str) -> None:
    plan = plans_of(catalogue, ask)
    assert any(line.endswith(index) for line in plan), plan
    # Of changes of all rigs those that came last are looked at, in their order.
    assert not [line for line in plan if line.startswith("SCAN") and line != "SCAN run_events"], plan


@pytest.mark.parametrize("lately", [1, 1000])
def test_the_latest_run_of_a_rig_is_that_of_its_last_change_whatever_others_did_since(
    catalogue: Catalogue, lately: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runs, "_LATELY", lately)
    with catalogue.writing() as session:
        first, second, _ = (
            start_run(session, kind="sweep", title="t", article="a", setup={}, rig=rig).id
            for rig in ("one", "one", "other")
        )
        finish_run(session, first, RunState.STOPPED, "a break")
        finish_run(session, second, RunState.FINISHED)
        reopen_run(session, first, "the break is over")
        for _ in range(3):
            start_run(session, kind="sweep", title="t", article="a", setup={}, rig="other")
        start_run(session, kind="sweep", title="t", article="a", setup={}, rig="one", state=RunState.CREATED)
        found = latest_of_rig(session, "one")
        assert found is not None
        assert (found[0].id, found[1]) == (first, 3)
        assert latest_of_rig(session, "new") is None
