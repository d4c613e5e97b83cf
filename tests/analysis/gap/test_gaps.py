"""Gaps of several explanations beside one floor."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.dof import Direction, Dof
from analysis.gap.effects.tester import FrameCompliance
from analysis.gap.gaps import AT_THE_FLOOR, Gaps, measured_gaps, where_asked
from analysis.gap.measurement import HammerSet
from analysis.gap.model import Model, refined
from analysis.gap.parallel_work import one_by_one
from analysis.gap.repeatability import floor_percent
from analysis.gap.verdict import weigh
from tests.analysis.gap.conftest import Made, search_among


@pytest.fixture(scope="module")
def models(made: Made) -> tuple[Model, Model]:
    """The paper's model of a bench with a soft frame, and one that has it."""
    search = search_among(made((FrameCompliance(),), (0.8,)), {"frame_compliance"})
    none = search.without_effects()
    return none, search.singles(none)[0]


def test_the_right_model_reaches_the_floor_and_the_paper_s_does_not(models: tuple[Model, Model]) -> None:
    none, right = models
    weighed = weigh(none, [right])
    assert weighed[0].model is right
    measurement = right.fit.likelihood.measurement
    gaps = where_asked(measured_gaps(none, weighed, measurement, one_by_one), right)
    assert gaps.floor_percent == floor_percent(right.fit)
    assert not gaps.above_the_floor(right)
    assert gaps.above_the_floor(none)


def test_a_model_that_was_not_asked_for_is_not_known_to_be_above_the_floor(models: tuple[Model, Model]) -> None:
    none, right = models
    gaps = Gaps({}, 1.0)
    assert gaps.of(none) is None
    assert not gaps.above_the_floor(none)
    assert AT_THE_FLOOR > 1.0
    again = refined(right, right.fit.likelihood.measurement)
    assert gaps.of(again) is None


@given(count=st.integers(1, 400), lines=st.integers(1, 300))
def test_a_thinned_set_has_at_least_as_many_lines_as_asked_for_and_fewer_than_twice(count: int, lines: int) -> None:
    shape = 1, count
    frequency = np.linspace(1.0, count, count)
    whole = HammerSet((Dof(1, Direction.Y),), frequency, np.ones(shape, dtype=complex), np.ones(shape), 100.0)
    thin = whole.thinned(lines)
    assert min(count, lines) <= thin.frequency.size < max(2 * lines, lines + 2)
    assert thin.frequency[0] == frequency[0]
    assert np.unique(np.diff(thin.frequency)).size <= 1
