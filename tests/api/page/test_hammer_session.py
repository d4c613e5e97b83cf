"""How far a hammer session is, as the store has it: the same after every restart."""

from __future__ import annotations

import pytest

from api.page.hammer_session import hammer_session
from api.page.sweep_progress import sweep_progress
from store.catalogue import Catalogue
from store.errors import NotFoundError


@pytest.fixture
def catalogue(demo_copy: object) -> Catalogue:
    return Catalogue.open(f"sqlite:///{demo_copy}/jointlab.db")


def test_a_finished_session_has_all_its_blows_and_no_next_point(catalogue: Catalogue) -> None:
    with catalogue:
        found = hammer_session(catalogue, 1)
    assert found.following is None
    assert list(found.counts) == ["1y", "3y", "4y", "5y", "6y", "7y", "8y", "9y", "11y", "1x", "11x"]
    assert all(done >= wanted == 10 for done, wanted in found.counts.values())
    assert found.last is not None
    assert found.last.force.max() > 30
    assert abs(found.last.time[found.last.force.argmax()]) < 0.01
    assert found.so_far is not None
    assert str(found.so_far.inputs[0]) == "11x"


def test_a_sweep_shows_the_mounting_that_was_last_or_the_one_asked_for(catalogue: Catalogue) -> None:
    with catalogue:
        last, asked = sweep_progress(catalogue, 1), sweep_progress(catalogue, 1, ("I", "shear"))
    assert last.mounting == ("II", "angled")
    assert len(last.taken_at) == 36
    assert [point.record.commanded_pp_mm for point in asked.points] == [0.1] * 3 + [0.01] * 3
    assert all(point.stiffness is not None and 1e5 < point.stiffness < 1e7 for point in asked.points)
    assert last.signals is not None
    assert 0.4e-3 < last.signals.displacement.mean() < 0.6e-3  # it swings about the preset


def test_a_run_without_the_experiment_says_so(catalogue: Catalogue) -> None:
    with catalogue, pytest.raises(NotFoundError, match="there is no run 7"):
        hammer_session(catalogue, 7)
