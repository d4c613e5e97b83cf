"""A stated window is read and written again, or refused if it cannot be corrected for."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from store.errors import StoreError
from store.exchange.blow_window import PLAIN, BlowWindow

SECONDS = st.none() | st.floats(1e-6, 1e6)


@given(SECONDS, SECONDS)
def test_a_window_that_is_written_is_read_as_it_was(force: float | None, time_constant: float | None) -> None:
    window = BlowWindow(force, time_constant)
    assert BlowWindow.parse(str(window), 2.0) == window


@pytest.mark.parametrize("text", [*PLAIN, "None"])
def test_a_plain_record_has_no_window(text: str) -> None:
    window = BlowWindow.parse(text, 2.0)
    assert window == BlowWindow()
    assert window.decay == 0.0
    assert str(window) == "none"


def test_both_windows_are_read_in_either_order() -> None:
    assert BlowWindow.parse("Exponential 0.5 s, force 0.05 s", 2.0) == BlowWindow(0.05, 0.5)
    assert BlowWindow(0.05, 0.5).decay == 2.0


def test_the_rest_at_the_end_of_the_record_gives_the_time_constant() -> None:
    assert math.exp(-2.0 * BlowWindow.parse("exponential 5 %", 2.0).decay) == pytest.approx(0.05)


@pytest.mark.parametrize(
    "text",
    ["", "hanning", "exponential", "exponential 0.5", "exponential 0 s", "exponential 100 %", "force 5 %",
     "exponential 1 s, exponential 2 s", "force 0.05 s, ", "exponential -1 s",
     f"force 1{400 * '0'} s", "exponential 1e-323 %"],
)  # fmt: skip
def test_a_window_that_cannot_be_corrected_for_is_refused_with_advice(text: str) -> None:
    with pytest.raises(StoreError, match=r"not a window that can be corrected for; write none, force 0\.05 s"):
        BlowWindow.parse(text, 2.0)
