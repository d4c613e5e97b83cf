"""Sine points under mains hum: how often is hum that matters flagged, do intervals of points without a flag hold, and
what is gained where a plan measures beside the mains?

Sweeps of 5 to 200 Hz with a hum of 0 to 2 % of the force at 50 Hz, and its multiples, at random phases. It matters
where it shifts k by more than the half-width of the interval of the record alone.
"""

import numpy as np

from tests.analysis.direct.test_mains_hum import TRUTH, beside, sweep

SWEEPS = 400
NOISES = (1e-4, 1e-3, 1e-2)  # of both sensors, over the amplitude


def main() -> None:
    """Print a line for each level of noise."""
    for noise in NOISES:
        flagged, held, moved, width, at = [], [], [], [], []
        for seed in range(SWEEPS):
            rng = np.random.default_rng([seed, 2])
            hum = 10 ** rng.uniform(-4.5, -1.7) if rng.random() < 0.7 else 0.0
            plain, quiet = beside(seed, hum, noise, 50.02 + 0.05 * rng.standard_normal())
            low, high = plain.stiffness_estimate.interval()
            moved.append(low <= TRUTH.real <= high)
            width.append(plain.stiffness_estimate.half_width() / quiet.stiffness_estimate.half_width())
            for frequency, (plain, point) in sweep(seed, hum, noise).items():
                if frequency == 45:
                    continue
                at.append(point.stiffness_estimate.half_width() / quiet.stiffness_estimate.half_width())
                if hum * 50 / frequency * abs(TRUTH) > plain.stiffness_estimate.half_width():
                    flagged.append(not point.first_harmonic_sufficient)
                if point.first_harmonic_sufficient:
                    low, high = point.stiffness_estimate.interval()
                    held.append(low <= TRUTH.real <= high)
        print(
            f"noise {noise:g}: {100 * np.mean(flagged):.1f} % of {len(flagged)} that matter are flagged; "
            f"intervals hold {100 * np.mean(held):.1f} % of the {len(held)} points at the mains without a flag; "
            f"beside it they hold {100 * np.mean(moved):.1f} % of {len(moved)}, {np.median(width):.2f} times as wide "
            f"as without hum (at it {np.median(at):.2f}, a tenth more than {np.percentile(at, 90):.0f} times)",
            flush=True,
        )


if __name__ == "__main__":
    main()
