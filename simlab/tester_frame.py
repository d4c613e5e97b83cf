"""The tester's own compliance, mass and delay, and the known pieces that show them when mounted in its jaws."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
ITERATIONS = 8  # each is nearer by the share of the motion that the frame takes


@dataclass(frozen=True)
class TesterFrame:
    """A tester that is not rigid, massless and on time; the default is one that is.

    Attributes:
        compliance: of the frame in series with the specimen, inside the measured displacement, m/N.
        fixture_mass: that moves with the specimen, before the force transducer, kg.
        delay: of the displacement channel against the force channel, s.
    """

    compliance: float = 0.0
    fixture_mass: float = 0.0
    delay: float = 0.0

    def specimen_share(self, own: Callable[[Real], Complex], amplitude: Real, frequency: float) -> tuple[Real, Complex]:
        """Amplitudes that the specimen sees when the machine moves by `amplitude`, m, and its stiffness k + ih at them.

        `own` is the specimen's stiffness in N/m by its amplitude in m; all arrays have the shape of `amplitude`.
        """
        seen = amplitude
        for _ in range(ITERATIONS if self.compliance else 0):
            seen = amplitude / np.abs(1 + self.compliance * self._sprung(own(seen), frequency))
        return seen, own(seen)

    def in_series(self, specimen: Complex, frequency: float) -> Complex:
        """The stiffness that the machine finds, N/m, of a specimen with stiffness k + ih."""
        sprung = self._sprung(specimen, frequency)
        return np.asarray(sprung / (1 + self.compliance * sprung))

    def static_force(self, own: Callable[[Real], Real], preset: Real) -> Real:
        """Force in N, shaped like `preset`, that holds specimen and frame there, m; `own` is the specimen's alone."""
        force = own(preset)
        for _ in range(ITERATIONS if self.compliance else 0):
            force = own(preset - self.compliance * force)
        return force

    def _sprung(self, specimen: Complex, frequency: float) -> Complex:
        return specimen - (2 * math.pi * frequency) ** 2 * self.fixture_mass


@dataclass(frozen=True)
class KnownPiece:
    """Something whose stiffness (N/m) and mass (kg) are known; it knows no amplitude."""

    stiffness: float = 0.0
    mass: float = 0.0

    def dynamic_stiffness(self, frequency: float) -> complex:
        """In N/m at `frequency` Hz."""
        return complex(self.stiffness - (2 * math.pi * frequency) ** 2 * self.mass)


BLANK = "blank"
"""The configuration in which known pieces are mounted."""
PIECES = {"blank": KnownPiece(stiffness=2e8), "empty": KnownPiece(), "mass": KnownPiece(mass=0.5)}
"""Known pieces: a steel blank, nothing, and a mass of half a kilogram."""
