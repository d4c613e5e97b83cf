"""The sensitivity that a calibrator shows, with an uncertainty that covers it."""

import numpy as np
import pytest

from analysis.chain import Calibrator, found_sensitivity
from analysis.errors import AnalysisError

RATE = 5120.0
TIMES = np.arange(int(2 * RATE)) / RATE


@pytest.mark.parametrize("frequency", [157.5, 159.15, 161.0])
def test_sensitivity_and_frequency_are_those_of_the_tone(frequency: float) -> None:
    noise = 1e-4 * np.random.default_rng(1).standard_normal(TIMES.size)
    volts = 0.3 + 10.2e-3 * 10.0 * np.sqrt(2) * np.sin(2 * np.pi * frequency * TIMES + 0.4) + noise
    found = found_sensitivity(volts, RATE, Calibrator())
    assert found.sensitivity == pytest.approx(10.2e-3, rel=1e-3)
    assert found.frequency == pytest.approx(frequency, abs=0.01)
    assert found.purity > 0.999
    assert found.uncertainty == pytest.approx(0.03, rel=0.01)


@pytest.mark.parametrize(("samples", "rate"), [(5120, 200.0), (20, 5120.0)], ids=["too slow", "too short"])
def test_a_record_that_cannot_have_the_tone_is_refused(samples: int, rate: float) -> None:
    with pytest.raises(AnalysisError, match=r"has no line near 159.*; sample faster, or record longer"):
        found_sensitivity(TIMES[:samples], rate, Calibrator())


@pytest.mark.parametrize("seed", range(5))
def test_without_a_tone_the_record_is_no_calibration(seed: int) -> None:
    volts = 1e-4 * np.random.default_rng(seed).standard_normal(TIMES.size)
    with pytest.raises(AnalysisError, match="no sine found"):
        found_sensitivity(volts, RATE, Calibrator())
