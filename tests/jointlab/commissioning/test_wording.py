"""What the checks of an examination say at the terminal."""

import pytest

from jointlab.commissioning.wording import with_unit


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (2.99e-8, "m", "0.0299 um"),
        (5e-4, "m", "500 um"),
        (-2.5e-3, "m", "-2.5 mm"),
        (0.0, "m", "0 um"),
        (12.0, "Hz", "12 Hz"),
        (0.5, "", "0.5"),
        ("no tone", "m", "no tone"),
        (None, "m", ""),
    ],
)
def test_a_length_is_told_in_um_or_mm_and_others_in_their_unit(
    value: float | str | None, unit: str, words: str
) -> None:
    assert with_unit(value, unit) == words
