"""The power density of a short record."""

import numpy as np
import pytest
from scipy.signal import periodogram

from analysis.chain import power_density


@pytest.mark.parametrize("samples", [511, 512])
def test_it_is_that_of_scipy(samples: int) -> None:
    signal = 3.0 + np.random.default_rng(1).normal(size=samples)
    frequency, power = power_density(signal, 5120.0)
    expected = periodogram(signal, 5120.0, "hann", detrend="constant")
    np.testing.assert_allclose(frequency, expected[0][1:])
    np.testing.assert_allclose(power, expected[1][1:])
