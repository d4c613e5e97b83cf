"""Units that suit a size."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from jointlab.quantities import PREFIXES, prefix_of, suited


@pytest.mark.parametrize(
    ("unit", "values", "text"),
    [
        ("m", (2.923e-5,), "µm"),
        ("m", (3e-7, -5.2e-5, 5.4e-5), "µm"),
        ("m", (0.0,), "m"),
        ("kg", (0.023, 0.1), "g"),
        ("kg", (1.2,), "kg"),
        ("Hz", (2e4,), "Hz"),
        ("1", (1e-5,), "1"),
        ("s", (None, 33e-6), "µs"),
    ],
)
def test_the_unit_suits_the_largest_value(unit: str, values: tuple[float | None, ...], text: str) -> None:
    assert suited(unit, *values)[1] == text


@given(st.floats(min_value=1e-12, max_value=9e11), st.booleans())
def test_a_size_has_one_to_three_digits_before_its_point(size: float, is_negative: bool) -> None:
    factor, _ = prefix_of(-size if is_negative else size)
    assert 1.0 <= size / factor < 1000.0 * (1 + 1e-12)
    assert factor in dict(PREFIXES)
