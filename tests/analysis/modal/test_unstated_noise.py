"""Modes whose noise is not stated: well damped ones, noise that rises with frequency, rounded text."""

from pathlib import Path

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.frequency_response import Complex, FrequencyResponses
from analysis.modal.estimation import estimate_modes
from analysis.modal.modal_model import LARGEST_LOSS_FACTOR
from tests.bench.bench_damped import draw, estimated, is_found

LINES = np.arange(1.0, 1001.0)
POINTS = tuple(Dof.parse(f"{node}y") for node in range(1, 6))


def responses(accelerance: Complex, noise: float, seed: int = 0) -> FrequencyResponses:
    rng = np.random.default_rng(seed)
    added = noise * (rng.standard_normal(accelerance.shape) + 1j * rng.standard_normal(accelerance.shape))
    return FrequencyResponses(LINES, accelerance + added, POINTS[0], POINTS)


def mode(frequency: float, loss_factor: float, *shape: float) -> Complex:
    squared = LINES**2
    return np.outer(shape, -squared / (frequency**2 * (1 + 1j * loss_factor) - squared)).astype(np.complex128)


def moved(by: float) -> Complex:
    """A mode at 600 Hz that each row found elsewhere."""
    rows = [mode(600.0 * (1 + by * place), 0.06, 1, 0.8, 0.6, 0.4, 0.3) for place in (-1, 1, 0, 1, -1)]
    return np.array([each[row] for row, each in enumerate(rows)])


@pytest.mark.parametrize("seed", [2, 31, 37])
def test_well_damped_modes_are_found_in_rounded_text_whose_noise_rises_with_frequency(
    tmp_path: Path, seed: int
) -> None:
    drawn = draw(seed)
    estimate = estimated(drawn, tmp_path / "holder.unv")
    assert is_found(drawn, estimate)
    assert 0.9 < estimate.residual_over_noise < 1.5


def test_a_background_as_damped_as_no_mode_is_not_reported_as_one() -> None:
    background = mode(450.0, 1.3, 1, 0.7, 0.5, 0.3, 0.2)
    found = estimate_modes(responses(background + mode(600.0, 0.05, 1, -0.5, 0.8, -0.2, 0.4), 0.01))
    assert found.modes.frequency == pytest.approx([600], rel=0.01)
    assert np.all(found.loss_factor_ci95[:, 1] < LARGEST_LOSS_FACTOR)


def test_a_mode_that_the_rows_do_not_agree_on_is_not_split() -> None:
    """Each row has its own frequency, as if load had moved it: two modes of one shape would fit better."""
    found = estimate_modes(responses(moved(2e-3) + mode(300.0, 0.04, 1, -0.8, 0.6, -0.4, 0.3), 0.003))
    assert found.modes.frequency == pytest.approx([300, 600], rel=0.01)


def test_a_weak_mode_whose_damping_may_be_zero_is_not_reported() -> None:
    """The rows have a weak mode at unlike places, and what hangs together over 25 lines is as strong as it."""
    rng = np.random.default_rng(1)
    taper = np.hanning(25) / np.linalg.norm(np.hanning(25))
    real, imaginary = rng.standard_normal((2, 5, LINES.size))
    hanging_together = np.array([np.convolve(row, taper, mode="same") for row in real + 1j * imaginary])
    weak = np.array(
        [
            mode(place, 0.02, factor)[0]
            for place, factor in zip((870, 890, 910, 880, 900), (0.5, -0.4, 0.6, 0.5, -0.3), strict=True)
        ]
    )
    strong = mode(300.0, 0.04, 1, -0.8, 0.6, -0.4, 0.3) + mode(600.0, 0.06, 0.3, 0.8, 0.6, 0.4, 0.9)
    found = estimate_modes(responses(strong + 0.003 * hanging_together + 0.004 * weak, 0.001))
    assert found.modes.frequency == pytest.approx([300, 600, 890], rel=0.02)
    assert np.all(found.loss_factor_ci95[:, 0] > 0)


def test_a_narrow_disturbance_of_one_line_is_no_mode() -> None:
    accelerance = mode(300.0, 0.08, 1, -0.8, 0.6, -0.4, 0.3) + mode(700.0, 0.05, 0.3, 0.8, 0.6, 0.4, 0.9)
    accelerance[:, 49] *= 1.5  # mains at 50 Hz
    assert estimate_modes(responses(accelerance, 0.003)).modes.frequency == pytest.approx([300, 700], rel=0.01)


def test_the_quality_of_a_fit_tells_noise_from_what_no_modal_model_has() -> None:
    clean = mode(300.0, 0.08, 1, -0.8, 0.6, -0.4, 0.3) + mode(700.0, 0.05, 0.3, 0.8, 0.6, 0.4, 0.9)
    joined = np.where(LINES < 420, clean, 0.8 * clean)  # from two measurements of unlike gain
    good, bad = (estimate_modes(responses(each, 0.01)) for each in (clean, joined))
    assert good.quality["residual_over_noise"] == pytest.approx(1, abs=0.1)
    assert good.quality["explained"] > 0.999
    assert bad.quality["residual_over_noise"] > 1.5
    assert bad.quality["explained"] < good.quality["explained"]
