"""Nuisances, errors of every bench that are no effects: new set-ups, gains, and an error of unknown cause."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from simlab.article import JOINT_NAMES
from simlab.beam import Real
from simlab.coupling import Complex

TYPICAL = {"setup_scatter": 0.005, "configuration_gain": 0.01, "model_error": 0.003}
"""Scales of half-normal distributions of the relative standard deviations."""
LARGEST = 2.0
"""Multiple of that scale that no standard deviation exceeds."""
DRAWN_EVERY, DRAWN_TO = 0.5, 1024.0
"""Spacing and highest frequency, Hz, of the lines at which an error of accelerances is drawn; it continues beyond."""


@dataclass(frozen=True, eq=False)
class Nuisances:
    """The nuisances of one case.

    Attributes:
        deviations: standard deviation of each kind, by its name among the tolerances.
        stated: whether the laboratory states them.
        stiffness: (sets + 1, joints) factor on each joint's stiffness, of the hammer sets and then of the tester.
        gains: (configurations,) factor of the tester.
        seed, coherence: of the error of accelerances, and its correlation length, Hz.
        common: whether all sets have the same error.
    """

    deviations: dict[str, float]
    stated: bool
    stiffness: Real
    gains: Real
    seed: int
    coherence: float
    common: bool

    @classmethod
    def draw(cls, rng: np.random.Generator, sets: int, configurations: int) -> Nuisances:
        """Draw the nuisances of a case with `sets` hammer sets and `configurations` of the tester."""
        deviations = {
            name: float(scale * np.clip(abs(rng.standard_normal()), 0.1, LARGEST)) for name, scale in TYPICAL.items()
        }
        return cls(
            deviations=deviations,
            stated=bool(rng.random() < 0.5),
            stiffness=scattered(rng, deviations["setup_scatter"], (sets + 1, len(JOINT_NAMES))),
            gains=scattered(rng, deviations["configuration_gain"], (configurations,)),
            seed=int(rng.integers(2**31)),
            coherence=float(rng.uniform(8.0, 30.0)),
            common=bool(rng.random() < 0.5),
        )

    def without_error(self) -> Nuisances:
        """The same nuisances without the error of accelerances."""
        return replace(self, deviations=self.deviations | {"model_error": 0.0})

    def set_up_again(self, rng: np.random.Generator) -> Nuisances:
        """The same nuisances after new set-ups."""
        return replace(self, stiffness=scattered(rng, self.deviations["setup_scatter"], self.stiffness.shape))

    def error(self, row: int, setup: int, frequency: Real) -> Complex:
        """(lines,) factor on an accelerance at `frequency` (lines,) Hz: one function, whatever lines are asked for.

        Its complex deviation from one is smooth over `coherence`; real and imaginary part share its variance.
        """
        rng = np.random.default_rng([self.seed, row, 0 if self.common else setup])
        lines = round(self.coherence / DRAWN_EVERY)
        grid = round(DRAWN_TO / DRAWN_EVERY) + 1 + 8 * lines
        white = rng.standard_normal((2, grid))
        size = np.sqrt(2.0 * np.mean(_smooth(white, lines) ** 2))
        more = max(int(np.ceil((np.max(frequency) - DRAWN_TO) / DRAWN_EVERY)), 0)
        unit = _smooth(np.concatenate([white, rng.standard_normal((more, 2)).T], axis=1), lines) / size
        places = 4 * lines + frequency / DRAWN_EVERY
        real, imaginary = (np.interp(places, np.arange(grid + more), part) for part in unit)
        return np.asarray(1.0 + self.deviations["model_error"] * (real + 1j * imaginary))


def _smooth(white: Real, lines: int) -> Real:
    return np.asarray(gaussian_filter1d(white, lines / np.sqrt(2.0), axis=1))


def scattered(rng: np.random.Generator, deviation: float, shape: tuple[int, ...]) -> Real:
    """Factors about one, none beyond two standard deviations."""
    return np.asarray(1.0 + deviation * np.clip(rng.standard_normal(shape), -2.0, 2.0))
