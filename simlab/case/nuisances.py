"""Nuisances, errors of every bench that are no effects: set-ups, gains, blows by hand, an error of unknown cause."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from simlab.article import JOINT_NAMES, TOLERANCES, clipped_normal
from simlab.beam import Load, Real
from simlab.coupling import Complex

TYPICAL = {"setup_scatter": 0.005, "configuration_gain": 0.01, "model_error": 0.003}
"""Scales of half-normal distributions of the relative standard deviations."""
LARGEST = 2.0
"""Multiple of that scale that no standard deviation exceeds."""
LEAN = float(np.radians(0.4))
"""Scale of the half-normal distribution of the standard deviation of a row's mean lean, rad: of five to ten blows by
hand, each leans by about a degree."""
HEIGHT = TOLERANCES["impact_position"]
"""Standard deviation of the height of a row's blows above the axis of an end face, m."""
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
        lean_deviation: standard deviation of the leans, rad.
        leans: (sets, rows) mean lean of the blows of each measured row in the plane of the beam, rad.
        heights: (sets, rows) of these blows above the beam's axis where they strike an end face, m.
        seed, coherence: of the error of accelerances, and its correlation length, Hz.
        common: whether all sets have the same error.
    """

    deviations: dict[str, float]
    stated: bool
    stiffness: Real
    gains: Real
    lean_deviation: float
    leans: Real
    heights: Real
    seed: int
    coherence: float
    common: bool

    @classmethod
    def draw(cls, rng: np.random.Generator, sets: int, configurations: int, rows: int) -> Nuisances:
        """Draw the nuisances of a case with `sets` hammer sets of `rows` and `configurations` of the tester."""
        deviations = {
            name: float(scale * np.clip(abs(rng.standard_normal()), 0.1, LARGEST)) for name, scale in TYPICAL.items()
        }
        stated = bool(rng.random() < 0.5)
        stiffness = scattered(rng, deviations["setup_scatter"], (sets + 1, len(JOINT_NAMES)))
        gains, seed = scattered(rng, deviations["configuration_gain"], (configurations,)), int(rng.integers(2**31))
        of_blows = np.random.default_rng([seed])
        lean = LEAN * np.clip(abs(of_blows.standard_normal()), 0.1, LARGEST)
        return cls(
            deviations=deviations,
            stated=stated,
            stiffness=stiffness,
            gains=gains,
            lean_deviation=float(lean),
            leans=clipped_normal(of_blows, lean, (sets, rows)),
            heights=clipped_normal(of_blows, HEIGHT, (sets, rows)),
            seed=seed,
            coherence=float(rng.uniform(8.0, 30.0)),
            common=bool(rng.random() < 0.5),
        )

    def without_error(self) -> Nuisances:
        """The same nuisances without the error of accelerances."""
        return replace(self, deviations=self.deviations | {"model_error": 0.0})

    def set_up_again(self, rng: np.random.Generator, rows: int) -> Nuisances:
        """The same nuisances after new set-ups, with new blows at `rows`."""
        struck = len(self.leans), rows
        return replace(
            self,
            stiffness=scattered(rng, self.deviations["setup_scatter"], self.stiffness.shape),
            leans=clipped_normal(rng, self.lean_deviation, struck),
            heights=clipped_normal(rng, HEIGHT, struck),
        )

    def struck(self, load: Load, row: int, setup: int) -> Load:
        """How the mean blow of a row in a set meets the beam, of a straight blow or one that an effect changed.

        A blow on an end face that is not on the axis turns the section. Rows that are not measured are struck straight.
        """
        if row >= self.leans.shape[1]:
            return load
        lean = self.leans[setup, row]
        cosine, sine = float(np.cos(lean)), float(np.sin(lean))
        if abs(load.x) < abs(load.y):
            return replace(load, x=cosine * load.x + sine * load.y, y=cosine * load.y - sine * load.x)
        x, y = cosine * load.x - sine * load.y, cosine * load.y + sine * load.x
        return replace(load, x=x, y=y, r=load.r - float(self.heights[setup, row]) * x)

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
    return 1.0 + clipped_normal(rng, deviation, shape)
