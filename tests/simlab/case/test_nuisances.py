"""Blows by hand lean, and fall beside the axis of an end face, in every case with nuisances."""

from dataclasses import replace

import numpy as np
import pytest

from simlab.beam import Load
from simlab.case.campaign import MEASURED, ROWS
from simlab.case.draw import CaseKind
from simlab.case.nuisances import HEIGHT, LARGEST, LEAN, Nuisances
from simlab.case.random_case import draw_random_case
from simlab.case.simulate import simulate


@pytest.fixture(scope="module")
def drawn() -> list[Nuisances]:
    """The nuisances of many cases."""
    found = [draw_random_case(seed, CaseKind.NONE).campaign.nuisances for seed in range(60)]
    return [each for each in found if each is not None]


def test_leans_and_heights_scatter_as_stated(drawn: list[Nuisances]) -> None:
    assert len(drawn) == 60
    leans = np.concatenate([(each.leans / each.lean_deviation).ravel() for each in drawn])
    heights = np.concatenate([each.heights.ravel() for each in drawn]) / HEIGHT
    for values in (leans, heights):
        assert np.std(values) == pytest.approx(0.96, abs=0.04)  # normal, clipped at two standard deviations
        assert np.max(np.abs(values)) <= 2.0 + 1e-9
    sizes = [each.lean_deviation / LEAN for each in drawn]
    assert max(sizes) <= LARGEST
    assert np.mean(sizes) == pytest.approx(0.78, abs=0.2)  # half-normal


def test_a_blow_keeps_its_force_and_turns_the_section_only_beside_the_axis(drawn: list[Nuisances]) -> None:
    own = drawn[0]
    across, along = MEASURED.index(ROWS[1]), ROWS.index(next(row for row in MEASURED if row.direction == "x"))
    lean, height = float(own.leans[0, along]), float(own.heights[0, along])
    found = own.struck(Load(0.0, x=1.0), along, 0)
    assert (found.x, found.y) == pytest.approx((np.cos(lean), np.sin(lean)))
    assert found.r == pytest.approx(-height * found.x)
    lean = float(own.leans[0, across])
    found = own.struck(Load(0.3, y=1.0), across, 0)
    assert (found.y, found.x, found.r) == pytest.approx((np.cos(lean), np.sin(lean), 0.0))


def test_rows_that_are_measured_follow_the_leans_and_heights_of_a_case() -> None:
    case = draw_random_case(3, CaseKind.NONE).without_error()
    own = case.campaign.nuisances
    assert own is not None
    straight = replace(own, leans=0.0 * own.leans, heights=0.0 * own.heights)
    as_drawn, ideal = (
        simulate(replace(case, campaign=replace(case.campaign, nuisances=each)), frequency=np.array([50.0, 400.0]))
        for each in (own, straight)
    )
    changed = np.abs(as_drawn.accelerance / ideal.accelerance - 1.0)
    measured, asked = changed[:, : len(MEASURED)], changed[:, len(MEASURED) :]
    assert np.all(np.max(measured, axis=2) > 0)
    assert np.max(asked) < 1e-12, "rows that are asked for are struck straight on their marks"
