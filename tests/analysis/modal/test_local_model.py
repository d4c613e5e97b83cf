"""The local model of one record, on a bench whose accelerance is known in closed form and whose record may be cut."""

from functools import cache

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.interval import Z95
from analysis.modal.local_model import LocalModel, local_model

RATE, SAMPLES, LINES = 1024.0, 2048, 560
FREQUENCY = np.arange(LINES, dtype=np.float64) * (RATE / SAMPLES)
NOISE = 0.3  # m/s^2
DRAWS = 10
WITH_SIGNAL = slice(10, None)
APART, CLOSE = (60.3, 101.7, 151.2, 240.2), (60.3, 101.7, 103.2, 240.2)
WHOLE, CUT, RINGING = 0.02, 0.005, 0.002  # damping ratios: 1e-6, a hundredth and a tenth are left at the end


def accelerance(frequency: Real, natural: tuple[float, ...], damping: float) -> Complex:
    """Of modes at `natural`, Hz, with alternating residues."""
    total = np.zeros(frequency.size, dtype=complex)
    for sign, each in zip((1.0, -0.7, 0.8, 0.5), natural, strict=True):
        total -= sign * frequency**2 / (each**2 - frequency**2 + 2j * damping * each * frequency)
    return total


def record(natural: tuple[float, ...], damping: float) -> tuple[Real, Real]:
    """(samples,) a pulse of 50 N and the whole response to it, of which a record holds the first two seconds."""
    time = np.arange(64 * SAMPLES) / RATE
    force = np.where((time >= 0.1) & (time < 0.104), 50 * np.sin(np.pi * (time - 0.1) / 0.004), 0.0)
    every = np.asarray(np.fft.rfftfreq(time.size, 1 / RATE), dtype=np.float64)
    spectrum = np.fft.rfft(force) * accelerance(every, natural, damping)
    return force[:SAMPLES], np.fft.irfft(spectrum, time.size)[:SAMPLES]


def spectrum(record_: Real) -> Complex:
    return np.asarray(np.fft.rfft(record_)[:LINES])


@cache
def draws(natural: tuple[float, ...], damping: float) -> list[tuple[LocalModel, Complex, Complex]]:
    """The model, the noise of the spectrum, and the error of the spectrum less its transient, draw by draw."""
    force, response = record(natural, damping)
    exact = spectrum(force) * accelerance(FREQUENCY, natural, damping)
    found, rng = [], np.random.default_rng(6)
    for _ in range(DRAWS):
        noise = NOISE * rng.standard_normal(SAMPLES)
        model = local_model(force, response + noise, LINES)
        found.append((model, spectrum(noise), spectrum(response + noise) - model.transient - exact))
    return found


@pytest.mark.parametrize("natural", [APART, CLOSE])
@pytest.mark.parametrize("damping", [WHOLE, CUT, RINGING])
def test_without_noise_its_error_is_well_below_the_noise(natural: tuple[float, ...], damping: float) -> None:
    force, response = record(natural, damping)
    exact = spectrum(force) * accelerance(FREQUENCY, natural, damping)
    left = spectrum(response) - local_model(force, response, LINES).transient - exact
    deviation = NOISE * np.sqrt(SAMPLES / 2)
    assert np.max(np.abs(left)[WITH_SIGNAL]) < 0.5 * deviation
    if damping == RINGING:
        assert np.max(np.abs(spectrum(response) - exact)) > 50 * deviation


@pytest.mark.parametrize("natural", [APART, CLOSE])
@pytest.mark.parametrize("damping", [WHOLE, RINGING])
def test_errors_over_their_variance_are_one_on_the_mean_and_within_their_intervals(
    natural: tuple[float, ...], damping: float
) -> None:
    found = draws(natural, damping)
    for which in (0, 1):
        squares, inside = [], []
        for model, noise, error in found:
            variance = (model.noise, model.noise_without)[which][WITH_SIGNAL]
            each = (noise, error)[which][WITH_SIGNAL]
            squares.append(np.mean(np.abs(each) ** 2 / 2 / variance))
            parts = np.array([each.real, each.imag]) / np.sqrt(variance)
            inside.append(np.mean(np.abs(parts) < Z95))
        counting = np.std(squares) / np.sqrt(len(squares))
        assert np.mean(squares) == pytest.approx(1.0, abs=3 * counting)
        assert np.mean(inside) == pytest.approx(0.95, abs=0.01)


def test_the_mean_error_over_draws_is_below_its_standard_error() -> None:
    errors = np.array([error for *_, error in draws(APART, RINGING)])[:, WITH_SIGNAL]
    scatter = np.mean(np.abs(errors - np.mean(errors, axis=0)) ** 2, axis=0) / (len(errors) - 1)
    freedom = 2 * (len(errors) - 1)
    # a bias of one standard error would make it twice as large
    assert np.mean(np.abs(np.mean(errors, axis=0)) ** 2 / scatter) == pytest.approx(freedom / (freedom - 2), abs=0.2)


def test_three_modes_within_a_window_are_beyond_it_and_its_variance_tells() -> None:
    crowded = (100.2, 102.2, 104.0, 240.2)
    force, response = record(crowded, RINGING)
    noise = NOISE * np.random.default_rng(1).standard_normal(SAMPLES)
    model = local_model(force, response + noise, LINES)
    error = spectrum(response + noise) - model.transient - spectrum(force) * accelerance(FREQUENCY, crowded, RINGING)
    among = (FREQUENCY > 98) & (FREQUENCY < 106)
    assert np.mean(np.abs(error[among]) ** 2) > 4 * NOISE**2 * SAMPLES
    assert np.mean(np.abs(error[among]) ** 2 / 2 / model.noise_without[among]) < 3


def test_an_exponential_window_correlates_noise_and_the_model_allows_for_it() -> None:
    force, response = record(APART, WHOLE)
    window = np.exp(-2.0 * np.arange(SAMPLES) / RATE)
    known, unknown, rng = list[float](), list[float](), np.random.default_rng(8)
    for _ in range(5):
        noise = NOISE * rng.standard_normal(SAMPLES)
        records = force * window, (response + noise) * window, LINES
        for squares, model in (known, local_model(*records, window)), (unknown, local_model(*records)):
            squares.append(float(np.mean(np.abs(spectrum(noise * window)) ** 2 / 2 / model.noise)))
    assert np.mean(known) == pytest.approx(1.0, abs=0.1)
    assert np.mean(unknown) > 3


def test_a_record_shorter_than_a_window_is_refused() -> None:
    with pytest.raises(AnalysisError, match="24 samples is too short"):
        local_model(np.ones(24), np.ones(24), 4)
