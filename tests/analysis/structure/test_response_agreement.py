from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex
from analysis.structure.response_agreement import frac

RNG = np.random.default_rng(3)
ROWS: Complex = RNG.standard_normal((4, 50)) + 1j * RNG.standard_normal((4, 50))


@given(st.floats(0.01, 100.0), st.floats(-np.pi, np.pi))
def test_a_row_agrees_with_itself_whatever_factor_is_on_it(size: float, phase: float) -> None:
    np.testing.assert_allclose(frac(ROWS, (size * np.exp(1j * phase) * ROWS).astype(complex)), 1.0)


def test_rows_without_relation_hardly_agree_and_noise_lowers_agreement_by_its_share() -> None:
    assert np.all(frac(ROWS, ROWS[::-1]) < 0.2)
    noise = 0.3 * (RNG.standard_normal((4, 50)) + 1j * RNG.standard_normal((4, 50)))
    np.testing.assert_allclose(frac(ROWS, ROWS + noise), 1 / 1.09, atol=0.06)


def test_what_cannot_be_compared_is_refused() -> None:
    with pytest.raises(AnalysisError, match="cannot be compared"):
        frac(ROWS, ROWS[:2])
    with pytest.raises(AnalysisError, match="a row of zeros"):
        frac(ROWS, np.zeros_like(ROWS))
