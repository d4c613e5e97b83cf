"""How long the fit of one sine point takes, beside plain least squares on the same records in the same run."""

import time
from collections.abc import Callable

import numpy as np

from analysis.direct.sine import fit_sine
from analysis.frequency_response import Real

RATE, SAMPLES, FREQUENCY = 10240.0, 5000, 50.003
REPEATS = 50


def main() -> None:
    """Print milliseconds and their quotient; two records of five thousand samples are one point of a sweep."""
    t = np.arange(SAMPLES) / RATE
    random = np.random.default_rng(0)
    clean = np.stack([amplitude * np.cos(2 * np.pi * FREQUENCY * t) for amplitude in (1e-5, 20.0)])
    record = clean * (1 + 0.01 * random.standard_normal(clean.shape))
    rows = _columns(t)
    plain = _quickest(lambda: np.linalg.lstsq(rows.T, record.T))
    fitted = _quickest(lambda: fit_sine(record, RATE, 50.0))
    print(f"fit {1e3 * fitted:.2f} ms, plain least squares {1e3 * plain:.2f} ms, quotient {fitted / plain:.1f}")


def _columns(t: Real) -> Real:
    """(12, samples) offset, slope, and five harmonics."""
    phase = np.arange(1, 6)[:, None] * 2 * np.pi * FREQUENCY * t
    return np.vstack([np.ones_like(t), t, np.cos(phase), np.sin(phase)])


def _quickest(work: Callable[[], object]) -> float:
    """Seconds; other work on the machine only ever adds."""
    spent = []
    for _ in range(REPEATS):
        begun = time.perf_counter()
        work()
        spent.append(time.perf_counter() - begun)
    return min(spent)


if __name__ == "__main__":
    main()
