"""The demo's run in a catalogue of its own, and queues in front of it."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from store.catalogue import Catalogue
from store.jobs import Job, get_job, signs_of_life
from store.states import OVER
from tests.waiting import LONG

Wait = Callable[..., Job]


@pytest.fixture
def catalogue(measured: int, tmp_path: Path) -> Iterator[Catalogue]:
    assert measured == 1
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as opened:
        yield opened


@pytest.fixture
def wait_for(catalogue: Catalogue) -> Wait:
    """Wait until a job is over, or until a condition holds, for as long as the job changes or its worker lives."""

    def wait(job: Job, is_so: Callable[[Job], bool] = lambda job: job.state in OVER) -> Job:
        latest, ends = None, 0.0
        while True:
            with catalogue.reading() as session:
                found, signs = get_job(session, job.id), signs_of_life(session)
            if is_so(found):
                return found
            if latest != (found, signs):
                latest, ends = (found, signs), time.monotonic() + LONG
            assert time.monotonic() < ends, found
            time.sleep(0.05)

    return wait
