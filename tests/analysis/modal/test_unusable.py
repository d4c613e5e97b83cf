"""Accelerances that cannot give modes are refused with what is wrong, and what to do."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.errors import AnalysisError, NoModeError
from analysis.modal.estimation import estimate_modes
from tests.analysis.modal.test_estimation import BEAM

MEASURED = BEAM.measured(0)


def test_a_file_of_the_opposite_time_dependence_is_told() -> None:
    turned = replace(MEASURED, accelerance=MEASURED.accelerance.conj())
    with pytest.raises(NoModeError, match=r"conjugate.*e\^\(\+i w t\)"):
        estimate_modes(turned)


@pytest.mark.parametrize("variance", [MEASURED.variance, None], ids=["noise stated", "noise not stated"])
def test_a_row_without_a_signal_is_named(variance: np.ndarray[tuple[int, ...], np.dtype[np.float64]] | None) -> None:
    accelerance = MEASURED.accelerance.copy()
    accelerance[4] = 0.0
    with pytest.raises(AnalysisError, match=r"accelerance at 6y is zero on all lines.*leave the row out"):
        estimate_modes(replace(MEASURED, accelerance=accelerance, variance=variance))
