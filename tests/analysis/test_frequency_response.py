"""Sets of accelerances: what does not fit is refused where it is put together."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import FrequencyResponses

GOOD = FrequencyResponses(
    frequency=np.array([0.0, 1.0, 2.0]),
    accelerance=np.ones((1, 3), complex),
    response=Dof.parse("3y"),
    inputs=(Dof.parse("1y"),),
    variance=np.ones((1, 3)),
)


@pytest.mark.parametrize("frequency", [[0.0, 2.0, 1.0], [0.0, 1.0, 1.0], [2.0, 1.0, 0.0]])
def test_frequencies_that_do_not_rise_are_refused(frequency: list[float]) -> None:
    with pytest.raises(AnalysisError, match="frequencies do not rise; sort the lines by frequency"):
        replace(GOOD, frequency=np.array(frequency))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0])
def test_a_frequency_that_is_none_is_refused(bad: float) -> None:
    frequency = GOOD.frequency.copy()
    frequency[0 if bad < 0 else 2] = bad
    with pytest.raises(AnalysisError, match="frequencies are not all finite numbers from 0 Hz up"):
        replace(GOOD, frequency=frequency)


def test_a_variance_below_zero_is_refused() -> None:
    with pytest.raises(AnalysisError, match="variance holds values below zero"):
        replace(GOOD, variance=np.array([[1.0, -1.0, 1.0]]))


def test_values_of_a_damaged_file_are_refused() -> None:
    with pytest.raises(AnalysisError, match=r"accelerance holds values beyond 1e\+30"):
        replace(GOOD, accelerance=1e200 * GOOD.accelerance)
