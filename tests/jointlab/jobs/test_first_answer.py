"""A job of a diagnosis says what it does and has found so far, and no longer once it is over."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from analysis.gap.catalogue import effect_ids
from jointlab.diagnosis.load import subject_of_bundle
from jointlab.diagnosis.pipeline import diagnosed
from jointlab.jobs.work import JobHeartbeat
from store.catalogue import Catalogue
from store.exchange.bundle import read_bundle
from store.progress import Advance
from store.service.jobs import Job, JobLostError, add_job, cancel_job, finish_job, get_job, take_job
from tests.investigations import small
from tests.jointlab.jobs.conftest import Wait

OTHERS = frozenset(effect_ids()) - {"channel_delay", "joint_mass"}
"""All but a part of the catalogue, which is quick."""


@pytest.fixture
def taken(catalogue: Catalogue) -> tuple[Job, str]:
    """A diagnosis that this process works on, and its token."""
    with catalogue.writing() as session:
        add_job(session, "diagnose", {"run": 1}, "ann")
        found = take_job(session, ["diagnose"])
    assert found is not None
    return found


def test_the_job_shows_each_answer_while_it_runs_and_none_when_it_is_done(
    catalogue: Catalogue, taken: tuple[Job, str], wait_for: Wait, tmp_path: Path
) -> None:
    job, token = taken
    shown = list[str]()
    subject = subject_of_bundle(read_bundle(small(5, tmp_path / "bundle")))
    with JobHeartbeat(catalogue, job.id, token) as heartbeat:

        @contextmanager
        def shown_by_the_job(what: str, total: int) -> Iterator[Advance]:
            with heartbeat(what, total) as advance:

                def advance_and_look(done: int, now: str = "") -> None:
                    advance(done, now)
                    found = wait_for(job, lambda found: (found.now or "") == now)
                    shown.append(found.now or "")

                yield advance_and_look

        found = diagnosed(subject, OTHERS, shown_by_the_job, workers=1)
    assert found.diagnosis.effects == ("channel_delay",)
    first = next(place for place, each in enumerate(shown) if each.startswith("first answer, not final: "))
    assert shown[first - 1] == "trying single effects"
    assert "delay between the channels (channel_delay), explains" in shown[first]
    assert shown[first].endswith(" of the misfit; trying further effects")
    assert all(each.startswith("first answer, not final: ") for each in shown[first:-1])
    assert shown[-1] == ""
    with catalogue.writing() as session:
        finish_job(session, job.id, token, {"diagnosis": 1})
    assert catalogue.read(get_job, job.id).now is None


def test_a_cancelled_job_keeps_no_answer_and_its_worker_writes_none(
    catalogue: Catalogue, taken: tuple[Job, str], wait_for: Wait
) -> None:
    job, token = taken
    answer = "first answer, not final: mass at the joints (joint_mass), explains 40 % of the misfit"
    with JobHeartbeat(catalogue, job.id, token) as heartbeat, heartbeat("diagnosis", 100) as advance:
        advance(40, answer)
        wait_for(job, lambda found: found.now == answer)
        with catalogue.writing() as session:
            cancel_job(session, job.id)
        with pytest.raises(JobLostError):
            _go_on(advance, answer)
    assert catalogue.read(get_job, job.id).now is None


def _go_on(advance: Advance, answer: str) -> None:
    """Work until there is a reason to end."""
    while True:
        advance(0, answer)
