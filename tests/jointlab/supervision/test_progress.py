"""Progress of runs, as the store has it: the same after every restart."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from jointlab.supervision.hammer_progress import hammer_progress
from jointlab.supervision.run_progress import time_left
from jointlab.supervision.sweep_progress import sweep_progress
from store.catalogue import Catalogue
from store.errors import NotFoundError

NOON = datetime(2026, 3, 2, 12, tzinfo=UTC)


@pytest.fixture
def catalogue(demo: Path) -> Catalogue:
    return Catalogue.open(f"sqlite:///{demo}/jointlab.db")


def test_a_finished_session_has_all_its_blows_and_no_next_point(catalogue: Catalogue) -> None:
    with catalogue:
        found = hammer_progress(catalogue, 1)
    assert found.next_point is None
    assert list(found.counts) == ["1y", "3y", "4y", "5y", "6y", "7y", "8y", "9y", "11y", "1x", "11x"]
    assert all(done >= wanted == 10 for done, wanted in found.counts.values())
    assert found.last is not None
    assert found.last.force.max() > 30
    assert abs(found.last.time[found.last.force.argmax()]) < 0.01
    assert 0.2e-3 < found.last.pulse.duration < 5e-3
    assert found.last.pulse.reach is not None
    assert found.last.pulse.reach > 1024  # a blow that counts excites the band that is kept
    assert found.responses is not None
    assert str(found.responses.inputs[0]) == "11x"


def test_a_sweep_has_the_points_of_the_last_mounting_or_of_the_one_asked_for(catalogue: Catalogue) -> None:
    with catalogue:
        last, asked = sweep_progress(catalogue, 1), sweep_progress(catalogue, 1, ("I", "shear"))
    assert last.mounting == ("II", "angled")
    assert len(last.taken_at) == 36
    assert [point.record.commanded_pp_mm for point in asked.points] == [0.1] * 3 + [0.01] * 3
    assert all(point.stiffness is not None and 1e5 < point.stiffness < 1e7 for point in asked.points)
    assert last.signals is not None
    assert 0.4e-3 < last.signals.displacement.mean() < 0.6e-3  # it cycles about the preset
    loop, latest = last.signals.loop, last.points[-1]
    assert loop is not None
    assert latest.stiffness is not None
    assert latest.loss_factor is not None
    assert latest.record.reached_pp_mm is not None
    amplitude = latest.record.reached_pp_mm / 2e3
    assert loop.dissipated == pytest.approx(np.pi * latest.stiffness * latest.loss_factor * amplitude**2, rel=0.02)


def test_a_run_without_the_experiment_says_so(catalogue: Catalogue) -> None:
    with catalogue, pytest.raises(NotFoundError, match="there is no run 7"):
        hammer_progress(catalogue, 7)


@given(pace=st.floats(0.1, 100), done=st.integers(2, 60), left=st.integers(1, 700))
def test_the_rest_takes_the_time_of_its_points_at_the_latest_pace(pace: float, done: int, left: int) -> None:
    times = [NOON + timedelta(seconds=pace * index) for index in range(done)]
    found = time_left(times, left)
    assert found is not None
    assert abs(found - pace * left) < 1e-3 * pace * left


def test_a_night_between_two_points_does_not_count_for_their_pace() -> None:
    times = [NOON + timedelta(seconds=10 * point + 36_000 * (point > 10)) for point in range(20)]
    assert time_left(times, 100) == pytest.approx(1000)


def test_there_is_no_time_left_before_there_is_a_pace() -> None:
    assert time_left([NOON], 10) is None
    assert time_left([NOON, NOON + timedelta(seconds=1)], 0) is None
