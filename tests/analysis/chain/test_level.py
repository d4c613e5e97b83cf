"""The level of a channel at rest: mean, noise and hum are distinguished."""

import numpy as np
import pytest

from analysis.chain import level_of
from analysis.errors import AnalysisError

RATE = 5120.0
TIMES = np.arange(int(2 * RATE)) / RATE


def noise(seed: int, rms: float) -> np.ndarray:
    return rms * np.random.default_rng(seed).standard_normal(TIMES.size)


@pytest.mark.parametrize("seed", range(20))
def test_white_noise_has_its_rms_and_hardly_any_hum(seed: int) -> None:
    level = level_of(3.0 + noise(seed, 0.01), RATE)
    assert level.mean == pytest.approx(3.0, abs=5e-4)
    assert level.noise == pytest.approx(0.01, rel=0.03)
    assert level.hum < 0.1 * level.noise


@pytest.mark.parametrize("mains", [49.7, 50.0, 50.3, 59.8, 60.0])
def test_hum_is_found_beside_noise_though_mains_wander(mains: float) -> None:
    hum = 0.005 * np.sin(2 * np.pi * mains * TIMES + 1.0) + 0.002 * np.sin(6 * np.pi * mains * TIMES)
    level = level_of(noise(1, 0.01) + hum, RATE)
    assert level.hum == pytest.approx(np.hypot(0.005, 0.002) / np.sqrt(2), rel=0.15)
    assert level.noise == pytest.approx(0.01, rel=0.03)
    assert level.mains == round(mains, -1)


def test_a_record_too_short_for_lines_of_mains_is_refused() -> None:
    with pytest.raises(AnalysisError, match="too short"):
        level_of(TIMES[:1000], RATE)
