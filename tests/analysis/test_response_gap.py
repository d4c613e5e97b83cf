"""Two curves and where they differ."""

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex
from analysis.response_gap import response_gap

FREQUENCY = np.arange(10.0, 1000.0, 1.0)
ROWS = ("3y by 1y",)


def response(*modes: tuple[float, float], noise: float = 1e-2, seed: int = 1) -> Complex:
    """(1, lines) accelerance of modes with frequency in Hz and residue."""
    omega = 2 * np.pi * FREQUENCY
    poles = [2 * np.pi * frequency for frequency, _ in modes]
    found = sum(-(omega**2) * r / (w**2 * (1 + 0.02j) - omega**2) for w, (_, r) in zip(poles, modes, strict=True))
    random = np.random.default_rng(seed).standard_normal((2, FREQUENCY.size))
    return np.asarray(found + noise * (random[0] + 1j * random[1]))[None]


def test_a_resonance_that_is_off_is_found_with_its_shift_and_height() -> None:
    simulated = response((200.0, 1.0), (660.0, 2.0), noise=0.0)
    found = response_gap(FREQUENCY, response((200.0, 1.0), (600.0, 1.0)), simulated, ROWS)
    right, off = found.resonances[0]
    assert right.shift == 0.0
    assert right.height == pytest.approx(1.0, abs=0.05)
    assert off.shift == pytest.approx(0.1, abs=0.005)
    assert off.height == pytest.approx(2.0, rel=0.1)
    low, high = found.places[0].band
    assert low < 600.0 < high or low < 660.0 < high
    assert "measured at 600 Hz is simulated at 660 Hz (+10.0 %)" in found.statements[-1]


def test_curves_that_differ_by_noise_have_no_place() -> None:
    measured = response((200.0, 1.0))
    noise = np.full(measured.shape, 1e-2)
    found = response_gap(FREQUENCY, measured, response((200.0, 1.0), noise=0.0), ROWS, noise)
    assert found.places == ()
    assert found.statements[-1] == "nothing of it is beyond noise"


def test_curves_that_do_not_fit_together_are_refused() -> None:
    measured = response((200.0, 1.0))
    with pytest.raises(AnalysisError, match="expected"):
        response_gap(FREQUENCY, measured, measured[:, 1:], ROWS)
    with pytest.raises(AnalysisError, match="32 lines"):
        response_gap(FREQUENCY[:9], measured[:, :9], measured[:, :9], ROWS)
