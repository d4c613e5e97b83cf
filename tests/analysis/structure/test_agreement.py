from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex
from analysis.modes import Modes
from analysis.structure.agreement import frac, mac, mode_errors

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench


def test_a_shape_agrees_with_itself_at_any_complex_scale(bench: Bench) -> None:
    shapes = bench.modes.shapes
    assurance = mac(shapes, (2 - 3j) * shapes)
    np.testing.assert_allclose(np.diag(assurance), 1.0)
    assert np.all(assurance <= 1 + 1e-12)
    assert mac(np.array([[1, 0j]]), np.array([[0j, 1]]))[0, 0] == 0


def test_modes_in_another_order_are_paired_and_their_errors_told(bench: Bench) -> None:
    order = [1, 0, 2, 3, 4, 5]
    predicted = Modes(bench.modes.poles[order] * 1.01, bench.modes.shapes[order] * 1j, bench.modes.dofs)
    errors = mode_errors(bench.modes, predicted)
    assert [error.predicted for error in errors] == order
    for error in errors:
        assert error.frequency_error == pytest.approx(0.01)
        assert error.predicted_loss_factor == pytest.approx(error.loss_factor, abs=1e-12)
        assert error.mac == pytest.approx(1.0)


def test_measured_modes_that_nothing_predicts_stay_without_a_pair(bench: Bench) -> None:
    few = Modes(bench.modes.poles[:4], bench.modes.shapes[:4], bench.modes.dofs)
    assert [(pair.measured, pair.predicted) for pair in mode_errors(bench.modes, few)] == [(n, n) for n in range(4)]


def test_shapes_of_different_length_are_refused(bench: Bench) -> None:
    with pytest.raises(AnalysisError, match="11 and 5 components"):
        mac(bench.modes.shapes, bench.modes.shapes[:, :5])


def test_a_shape_of_zeros_is_refused(bench: Bench) -> None:
    with pytest.raises(AnalysisError, match="zeros"):
        mac(bench.modes.shapes, np.zeros((1, 11), dtype=complex))


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
