"""Modes of a structure at named degrees of freedom, and lumped parts that are attached to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import eigh

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.gap.jenkins_element import jenkins_element

ROUNDING = 1e-9
"""Largest square of a natural frequency below zero that is taken for rounding of a free motion, over the largest
stiffness of a degree of freedom over its mass."""


@dataclass(frozen=True)
class Attached:
    """A lumped part at one place.

    Attributes:
        place: a degree of freedom; or, where shapes are known along a line, its coordinate, m.
        mass, stiffness, damping: kg, N/m and N s/m, between the place and the ground (a mass moves with the place).
        tuned: frequency of a mass on a spring (an absorber), Hz; zero for a mass that is fixed to the place.
        tuned_loss: loss factor of that spring.
        cubic: coefficient of a force that grows with the cube of displacement, N/m^3.
        slip: force at which the spring to the ground slips, N; zero where it does not slip.
    """

    place: str | float
    mass: float = 0.0
    stiffness: complex = 0.0
    damping: float = 0.0
    tuned: float = 0.0
    tuned_loss: float = 0.0
    cubic: float = 0.0
    slip: float = 0.0

    @property
    def follows_amplitude(self) -> bool:
        """Whether its stiffness depends on amplitude."""
        return bool(self.cubic or self.slip)

    def dynamic_stiffness(self, pole: Complex, amplitude: Real | None = None) -> Complex:
        """(lines,) N/m at `pole` (lines,); (..., lines) for the first harmonic of an `amplitude` (..., lines) in m."""
        inertia: Complex = np.asarray(pole**2 * self.mass)
        if self.tuned:
            spring = self.mass * (2 * np.pi * self.tuned) ** 2 * (1 + 1j * self.tuned_loss)
            inertia = spring * inertia / (spring + inertia)
        grounded: Complex = np.asarray(self.stiffness, dtype=complex)
        if amplitude is not None:
            if self.slip:
                storage, loss = jenkins_element(self.slip / (np.abs(self.stiffness) * amplitude))
                grounded = grounded * (storage + 1j * loss)
            grounded = grounded + 0.75 * self.cubic * amplitude**2
        return np.asarray(grounded + pole * self.damping + inertia)


@dataclass(frozen=True, eq=False)
class NormalModes:
    """Modes of a structure, scaled to unit modal mass.

    Attributes:
        dofs: names.
        shapes: (dofs, modes) mass-normalised, kg^-1/2.
        frequencies: (modes,) Hz.
        coordinates: (dofs,) m, where the degrees of freedom lie along one line and shapes are read between them.
        parts: (modes, modes) modal stiffness of each named substructure, which sum up to no more than the whole.
        losses: (modes,) loss factor of each; none by default.

    Degrees of freedom are put into the order of their coordinates.

    Raises:
        AnalysisError: numbers are complex or not finite, a frequency is below zero, or there is not one number for each
            mode or degree of freedom.
    """

    dofs: tuple[str, ...]
    shapes: Real
    frequencies: Real
    coordinates: Real | None = None
    parts: Mapping[str, Real] = field(default_factory=dict)
    losses: Real | None = None

    def __post_init__(self) -> None:
        if self.shapes.shape != (len(self.dofs), self.frequencies.size):
            raise AnalysisError(
                f"shapes are {self.shapes.shape}; {len(self.dofs)} degrees of freedom and "
                f"{self.frequencies.size} modes were named"
            )
        given = {"shapes": self.shapes, "frequencies": self.frequencies} | {
            f"part {n}": k for n, k in self.parts.items()
        }
        sizes = {"coordinates": (self.coordinates, len(self.dofs)), "losses": (self.losses, self.frequencies.size)}
        for name, (each, size) in sizes.items():
            if each is not None:
                if np.shape(each) != (size,):
                    raise AnalysisError(f"{name} have shape {np.shape(each)}; {size} numbers are needed")
                given[name] = each
        for name, each in given.items():
            _check_numbers(name, each)
        for name, each in self.parts.items():
            if each.shape != (self.frequencies.size,) * 2:
                raise AnalysisError(f"part {name} is {each.shape}; it is to have a row and a column for each mode")
        if np.any(self.frequencies < 0):
            raise AnalysisError(f"a frequency is below zero: {float(np.min(self.frequencies)):g} Hz")
        if self.coordinates is not None and np.any(np.diff(self.coordinates) < 0):
            self._sort(self.coordinates)

    def _sort(self, coordinates: Real) -> None:
        """Shapes are read between neighbours, so these have to be next to each other."""
        order = np.argsort(coordinates, kind="stable")
        object.__setattr__(self, "dofs", tuple(self.dofs[place] for place in order))
        object.__setattr__(self, "shapes", self.shapes[order])
        object.__setattr__(self, "coordinates", coordinates[order])

    @classmethod
    def of_matrices(
        cls, mass: Real, stiffness: Real, dofs: Sequence[str], modes: int, parts: Mapping[str, Real] | None = None
    ) -> NormalModes:
        """The lowest modes of M and K (dofs, dofs), and of substructures from their own K.

        Raises:
            AnalysisError: a matrix is complex, not finite or not symmetric, M is not positive, a square of a natural
                frequency is clearly negative, or no mode is asked for.
        """
        if modes < 1:
            raise AnalysisError(f"{modes} modes were asked for; one is needed at least")
        for name, each in {"M": mass, "K": stiffness, **(parts or {})}.items():
            _check_numbers(name, each)
            if each.shape != (len(dofs),) * 2 or not np.allclose(
                each, each.T, rtol=1e-6, atol=1e-9 * np.abs(each).max()
            ):
                raise AnalysisError(f"{name} is to be a symmetric matrix of {len(dofs)} x {len(dofs)}")
        try:
            squares, shapes = eigh(stiffness, mass, subset_by_index=(0, min(modes, len(dofs)) - 1))
        except np.linalg.LinAlgError as error:
            raise AnalysisError(f"M and K have no modes: {error}; M is to be positive definite") from error
        stiffest = float(np.max(np.abs(np.diag(stiffness) / np.diag(mass))))
        if squares[0] < -ROUNDING * stiffest:
            raise AnalysisError(
                f"M and K have a mode whose squared angular frequency is {squares[0]:.3g} 1/s^2, below zero; check the "
                "sign of K and its supports"
            )
        own = {name: np.asarray(shapes.T @ each @ shapes) for name, each in (parts or {}).items()}
        return cls(tuple(dofs), shapes, np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi), None, own)

    def at(self, place: str | float) -> Real:
        """(modes,) shapes at a degree of freedom, or at a coordinate.

        Raises:
            AnalysisError: there is no such place.
        """
        if isinstance(place, str):
            if place not in self.dofs:
                raise AnalysisError(f"the structure has no degree of freedom {place!r}; it has {', '.join(self.dofs)}")
            return np.asarray(self.shapes[self.dofs.index(place)])
        if self.coordinates is None or not self.coordinates[0] <= place <= self.coordinates[-1]:
            raise AnalysisError(f"the structure has no point at {place:g} m")
        return np.array([np.interp(place, self.coordinates, shape) for shape in self.shapes.T])


def _check_numbers(name: str, given: Real) -> None:
    if np.iscomplexobj(given):
        raise AnalysisError(f"{name}: complex values; give real numbers, and loss as losses or loss_factor")
    if not np.all(np.isfinite(given)):
        raise AnalysisError(f"{name}: not all values are finite numbers")
