"""The stabilisation chart, read from poles that are laid out by hand."""

import numpy as np
import pytest

from analysis.modal.lscf import OrderPoles
from analysis.modal.stabilisation import Stabilisation, read_chart
from analysis.modes import poles_from

STEADY = complex(poles_from(np.array([100.0]), np.array([0.04]))[0])
NEIGHBOUR = complex(poles_from(np.array([102.0]), np.array([0.1]))[0])


def chart(*columns: dict[int, complex], top: int = 40, decay: float = 0.0) -> Stabilisation:
    """A chart of orders 1 to `top`; each column gives its pole by order."""
    orders = []
    for order in range(1, top + 1):
        poles = np.array([column[order] for column in columns if order in column], dtype=np.complex128)
        orders.append(OrderPoles(order, poles))
    return read_chart(tuple(orders), 1.0, 1000.0, 0.5, decay)


def steady(pole: complex, orders: range) -> dict[int, complex]:
    return {order: pole * (1 + 1e-4 / order) for order in orders}


def test_a_pole_that_stays_to_the_top_is_a_candidate_and_its_points_are_marked() -> None:
    found = chart(steady(STEADY, range(10, 41)))
    assert found.candidates == pytest.approx([STEADY], rel=1e-4)
    assert np.array_equal(found.order, np.arange(10, 41))
    assert np.all(found.column == 0)
    assert list(found.stable) == [False] + [True] * 30
    assert found.frequency[-1] == pytest.approx(100.0, rel=1e-3)
    assert found.loss_factor[-1] == pytest.approx(0.04, rel=1e-3)


def test_near_repeated_poles_make_two_columns() -> None:
    found = chart(steady(STEADY, range(10, 41)), steady(NEIGHBOUR, range(20, 41)))
    assert found.candidates == pytest.approx([STEADY, NEIGHBOUR], rel=1e-4)


def test_a_gap_of_one_order_does_not_break_a_column() -> None:
    column = steady(STEADY, range(10, 41))
    del column[25]
    found = chart(column)
    assert found.candidates.size == 1
    assert np.all(found.column == 0)


def test_a_pole_that_wanders_is_no_candidate() -> None:
    rng = np.random.default_rng(0)
    found = chart({order: STEADY * rng.uniform(0.8, 1.2) for order in range(5, 41)})
    assert found.candidates.size == 0
    assert np.all(found.column == -1)


@pytest.mark.parametrize("orders", [range(10, 35), range(38, 41)])
def test_a_column_that_ends_early_or_is_short_is_no_candidate(orders: range) -> None:
    assert chart(steady(STEADY, orders)).candidates.size == 0


def test_overdamped_poles_and_poles_outside_the_band_are_left_out() -> None:
    background = complex(poles_from(np.array([300.0]), np.array([0.9]))[0])
    outside = complex(poles_from(np.array([1200.0]), np.array([0.01]))[0])
    found = chart(steady(background, range(5, 41)), steady(outside, range(5, 41)))
    assert found.order.size == 0
    assert found.candidates.size == 0


def test_a_window_s_decay_is_taken_out_of_the_chart() -> None:
    found = chart(steady(STEADY - 5.0, range(10, 41)), decay=5.0)
    assert found.candidates == pytest.approx([STEADY], rel=1e-4)
