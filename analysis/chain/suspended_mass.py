"""Hammer and accelerometer against each other on a suspended rigid mass: F = m a (ISO 7626-5, annex on calibration).

Force over acceleration during blows is the mass, by whatever both sensitivities are wrong; its sign is the polarity.
"""

from dataclasses import dataclass

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Real

DURING = 0.2  # of the highest force of a record: samples above it belong to a blow


@dataclass(frozen=True)
class ApparentMass:
    """What blows on a rigid mass say.

    Attributes:
        mass: force over acceleration by least squares, kg; negative where their signs differ.
        correlation: of both during the blows; 1 or -1 for a rigid mass and sensors that follow it.
        peak_force: largest force, N.
    """

    mass: float
    correlation: float
    peak_force: float


def apparent_mass(force: Real, acceleration: Real) -> ApparentMass:
    """The mass that blows in a record show.

    Args:
        force: (samples,) N of the hammer.
        acceleration: (samples,) m/s^2 of the mass.

    Raises AnalysisError where a channel does not vary at all.
    """
    force, acceleration = force - np.median(force), acceleration - np.median(acceleration)
    size = np.abs(force)
    during = size >= DURING * size.max()
    struck, moved = force[during], acceleration[during]
    if not (np.any(struck) and np.any(moved)):
        raise AnalysisError("a channel does not vary: no blow is in the record")
    product = float(struck @ moved)
    return ApparentMass(
        mass=product / float(moved @ moved),
        correlation=product / float(np.linalg.norm(struck) * np.linalg.norm(moved)),
        peak_force=float(struck[np.argmax(np.abs(struck))]),
    )


def mass_if_swapped(mass: float, force_sensitivity: float, acceleration_sensitivity: float) -> float:
    """The apparent mass of `mass` kg where the cables of hammer (V/N) and accelerometer (V/(m/s^2)) are swapped."""
    return (acceleration_sensitivity / force_sensitivity) ** 2 / mass
