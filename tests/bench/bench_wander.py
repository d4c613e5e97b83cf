"""Sine points whose amplitude wanders while the specimen softens: how much wider than its scatter is the interval of k?

Wander of 3 % (rms) from cycle to cycle, slowly, as a sine, and as a trend; stiffness as the power -0.4 of amplitude.
"""

import numpy as np

from analysis.direct.dynamic_stiffness import dynamic_stiffness
from analysis.frequency_response import Real

RATE, TRUTH, EXPONENT, MEAN = 5000.0, 2.3e6 * (1 + 0.12j), -0.4, 50e-6
WANDER, NOISE, RECORDS = 0.03, 1e-4, 150
KINDS = ("from cycle to cycle", "slow", "sine", "trend")


def wander(kind: str, rng: np.random.Generator, phase: Real) -> Real:
    """Relative, at each `phase` in cycles."""
    cycles = float(phase[-1])
    if kind == "trend":
        return np.asarray(WANDER * np.sqrt(3) * (2 * phase / cycles - 1) * rng.choice([-1, 1]))
    if kind == "sine":
        turns = rng.uniform(2, 8) * phase / cycles
        return np.asarray(WANDER * np.sqrt(2) * np.sin(2 * np.pi * turns + rng.uniform(0, 2 * np.pi)))
    knots = np.linspace(0, cycles, 6) if kind == "slow" else np.arange(cycles + 2)
    return np.interp(phase, knots, WANDER * rng.standard_normal(knots.size))


def main() -> None:
    """Print a line for each kind and frequency."""
    for kind in KINDS:
        for frequency in (10.0, 100.0):
            errors, half, held = [], [], []
            for seed in range(RECORDS):
                rng = np.random.default_rng(seed)
                samples = round(max(24, frequency / 2) / frequency * RATE)
                phase = np.linspace(0, frequency * samples / RATE, samples, endpoint=False)
                size = 1 + wander(kind, rng, phase)
                wave = MEAN * size * np.exp(2j * np.pi * phase)
                noise = NOISE * MEAN * rng.standard_normal((2, phase.size))
                force = (TRUTH * size**EXPONENT * wave).real + abs(TRUTH) * noise[1]
                point = dynamic_stiffness(wave.real + noise[0], force, RATE, frequency)
                truth = TRUTH.real * (point.amplitude_pp / (2 * MEAN)) ** EXPONENT
                low, high = point.stiffness_estimate.interval()
                errors.append(point.stiffness / truth - 1)
                half.append((high - low) / 2 / truth)
                held.append(low <= truth <= high)
            scatter = np.std(errors)
            print(
                f"{kind:<20}{frequency:5.0f} Hz: intervals {np.median(half) / 1.96 / scatter:5.1f} times as wide as "
                f"the scatter of {1e6 * scatter:3.0f}e-6, mean error {1e6 * np.mean(errors):+4.0f}e-6, "
                f"hold {100 * np.mean(held):.0f} %",
                flush=True,
            )


if __name__ == "__main__":
    main()
