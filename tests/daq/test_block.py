"""A block: raw counts and their scaling."""

from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.block import Block
from daq.channels import Channel, ChannelKind
from daq.errors import ChannelError

NOW = datetime(2026, 11, 21, tzinfo=UTC)


def block(counts: list[list[int]], scaling: tuple[tuple[float, ...], ...], sensitivity: float) -> Block:
    channels = tuple(
        Channel(f"c{i}", f"D/ai{i}", ChannelKind.VOLTAGE, sensitivity, "N", -0.01, 0.01) for i in range(len(counts))
    )
    return Block(channels, np.array(counts, dtype=np.int32), scaling, 1000.0, NOW)


@given(
    count=st.integers(-(2**31), 2**31 - 1),
    coefficients=st.tuples(*[st.floats(-1, 1)] * 4),
    sensitivity=st.floats(1e-4, 1e4),
)
def test_a_value_is_the_polynomial_of_the_count_over_the_sensitivity(
    count: int, coefficients: tuple[float, ...], sensitivity: float
) -> None:
    terms = [c * float(count) ** i for i, c in enumerate(coefficients)]
    made = block([[count]], (coefficients,), sensitivity).value("c0")[0]
    scale = sum(abs(t) for t in terms) / sensitivity
    assert abs(made - sum(terms) / sensitivity) <= 1e-12 * scale


def test_each_channel_has_its_own_scaling() -> None:
    made = block([[1, 2], [1, 2]], ((0.0, 1.0), (5.0, 10.0)), 2.0)
    np.testing.assert_array_equal(made.value("c0"), [0.5, 1.0])
    np.testing.assert_array_equal(made.at_input("c1"), [15.0, 25.0])


def test_length_and_names() -> None:
    made = block([[1, 2, 3], [1, 2, 3]], ((0.0, 1.0),) * 2, 1.0)
    assert (made.names, made.samples, made.duration) == (("c0", "c1"), 3, 3e-3)


def test_a_channel_that_is_not_in_the_block_is_named_with_those_that_are() -> None:
    with pytest.raises(ChannelError, match="no channel 'hammer' in this block; it holds c0"):
        block([[1]], ((0.0, 1.0),), 1.0).value("hammer")
