"""The pulse of a blow: its duration and the reach of its spectrum, on pulses whose both are known."""

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.modal.force_pulse import force_pulse

RATE, SAMPLES, TRIGGER = 51_200.0, 51_200, 2_000
TENTH = 2 * np.arccos(0.1) / np.pi
"""Share of a half-sine for which it is above a tenth of its peak."""


def half_sine(width: float, height: float = 100.0, delay: float = 0.0) -> Real:
    time = (np.arange(SAMPLES) - TRIGGER) / RATE - delay
    return np.where((time >= 0) & (time <= width), height * np.sin(np.pi * time / width), 0.0)


@pytest.mark.parametrize("width", [0.5e-3, 1e-3, 4e-3])
def test_a_half_sine_has_its_own_duration_and_reach(width: float) -> None:
    found = force_pulse(half_sine(width) + 3.0, RATE, TRIGGER)  # an offset of the amplifier is no force
    assert found.duration == pytest.approx(TENTH * width, rel=0.01)
    # its spectrum is cos(pi f w) / (1 - (2 f w)^2) of that at 0
    relative = np.linspace(0.6, 1.4, 100_001)
    spectrum = np.abs(np.cos(np.pi * relative) / (1 - (2 * relative) ** 2))
    expected = relative[np.argmax(spectrum < 0.1)] / width
    assert found.reach == pytest.approx(expected, rel=0.005)
    assert np.max(found.level) == 0


def test_a_spectrum_that_stays_up_to_half_the_sample_rate_has_no_reach() -> None:
    force = np.zeros(SAMPLES)
    force[TRIGGER + 5] = 50.0
    found = force_pulse(force, RATE, TRIGGER)
    assert found.reach is None
    assert found.duration < 2 / RATE


def test_a_second_contact_leaves_the_duration_and_dents_the_spectrum() -> None:
    single = force_pulse(half_sine(1e-3), RATE, TRIGGER)
    double = force_pulse(half_sine(1e-3) + half_sine(1e-3, 95.0, 5e-3), RATE, TRIGGER)
    assert double.duration == pytest.approx(single.duration)
    assert double.reach == pytest.approx(1 / (2 * 5e-3), rel=0.1)  # both contacts cancel there


def test_a_force_that_never_pushes_is_no_pulse() -> None:
    with pytest.raises(AnalysisError, match="no pulse"):
        force_pulse(np.zeros(SAMPLES), RATE, TRIGGER)
