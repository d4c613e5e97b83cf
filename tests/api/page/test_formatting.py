"""Quantities, interlocks and lengths of time as people read them."""

from types import SimpleNamespace
from typing import cast

import pytest

from api.page.formatting import INTERLOCKS, accepted_text, duration, in_unit, job_progress, quantity, run_state, scaled
from jointlab.drive.phase import Phase
from jointlab.drive.state import RigState
from rig.registers import Interlock
from store.measurements.runs import Run
from store.service.jobs import Job
from store.states import RunState


def test_thousands_are_apart_by_thin_spaces_and_decimals_after_a_point() -> None:
    assert quantity(1234567.8, "N", 8) == "1\u202f234\u202f567.8\u202fN"
    assert scaled(2_640_000.0, "N/m") == "2.64\u202fMN/m"


def test_a_small_acceleration_has_a_prefix_and_a_large_one_has_none() -> None:
    given = (7.42e-6, -0.0219, 490.0, 5000.0, 0.0)
    shown = ["7.42 µm/s²", "-21.9 mm/s²", "490 m/s²", "5 000 m/s²", "0.00 m/s²"]
    assert [in_unit(each, "m/s^2").replace("\u202f", " ") for each in given] == shown
    assert in_unit(None, "m/s^2") == "–"


def test_more_blows_than_are_wanted_at_one_point_replace_none_at_another() -> None:
    assert accepted_text({"1y": (5, 3), "3y": (3, 3), "4y": (1, 3)}) == "7 of 9 blows accepted, and 2 more"
    assert accepted_text({"1y": (3, 3)}) == "3 of 3 blows accepted"


def test_an_unknown_value_is_a_dash() -> None:
    assert quantity(None, "N") == scaled(float("nan"), "N") == "–"


def test_every_interlock_of_the_tester_has_a_sentence() -> None:
    assert set(INTERLOCKS) == set(Interlock)


def test_durations_have_the_unit_that_suits_their_size() -> None:
    assert [duration(seconds) for seconds in (12, 600, 9000)] == ["12\u202fs", "10\u202fmin", "2\u202fh 30\u202fmin"]


def test_a_run_that_is_not_carried_out_was_cut_off() -> None:
    run = cast(Run, SimpleNamespace(id=3, state=RunState.RUNNING, rig="east"))
    assert run_state(run, RigState(phase=Phase.RUNNING, run_id=3), "east") == "running"
    assert run_state(run, RigState(phase=Phase.RUNNING, run_id=4), "east") == "cut off"
    assert run_state(run, RigState(run_id=3), "east") == "cut off"
    assert run_state(run, None, None) == "running"  # a service that drives no rig cannot know
    assert (
        run_state(cast(Run, SimpleNamespace(id=3, state=RunState.FAILED, rig="east")), RigState(), "east") == "failed"
    )


def test_a_run_of_another_rig_of_the_same_database_is_not_called_cut_off() -> None:
    run = cast(Run, SimpleNamespace(id=3, state=RunState.RUNNING, rig="west"))
    assert run_state(run, RigState(), "east") == "running"


@pytest.mark.parametrize(
    ("now", "shown"),
    [
        (None, "diagnosis, 42 of 100"),
        ("first answer, not final: joint mass", "diagnosis, 42 of 100; first answer, not final: joint mass"),
    ],
)
def test_the_progress_of_a_job_has_what_its_worker_has_found_so_far(now: str | None, shown: str) -> None:
    assert job_progress(cast(Job, SimpleNamespace(stage="diagnosis", done=42, total=100, now=now))) == shown
