"""Two soft cords in which the bar hangs when it is free of its joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from simlab.article import NODE_POSITIONS, Article
from simlab.elastomer import REFERENCE_TEMPERATURE, Complex

BOUNCE = 4.0
"""Frequency of the hanging bar's bounce, Hz."""
HUNG_AT = (NODE_POSITIONS[1], NODE_POSITIONS[9])
"""Where the cords hold the bar, m from its left end."""
LOSS_FACTOR = 0.1
SIDEWAYS = 0.05  # stiffness along the bar over that across it: cords swing


@dataclass(frozen=True)
class Cord:
    """Holds the bar at a place (m) with a stiffness across it, N/m; it knows no amplitude and no temperature."""

    position: float
    stiffness: float

    def dynamic_stiffness(
        self,
        amplitude: float,  # noqa: ARG002 - as a joint is asked
        frequency: ArrayLike,
        temperature: float = REFERENCE_TEMPERATURE,  # noqa: ARG002 - as a joint is asked
    ) -> Complex:
        """(..., 3, 3) k + ih in x, y and rotation for frequencies (...) in Hz."""
        held = self.stiffness * (1 + 1j * LOSS_FACTOR) * np.diag([SIDEWAYS, 1.0, 0.0])
        return np.broadcast_to(held, (*np.shape(frequency), 3, 3)).astype(np.complex128)

    def lateral_stiffness(
        self,
        amplitude: float,  # noqa: ARG002 - as a joint is asked
        frequency: ArrayLike,
        temperature: float = REFERENCE_TEMPERATURE,  # noqa: ARG002 - as a joint is asked
    ) -> Complex:
        """(..., 2, 2) k + ih out of plane: sideways, and in rotation."""
        held = self.stiffness * (1 + 1j * LOSS_FACTOR) * np.diag([SIDEWAYS, 0.0])
        return np.broadcast_to(held, (*np.shape(frequency), 2, 2)).astype(np.complex128)


def cords_for(article: Article) -> dict[str, Cord]:
    """Two equal cords that let the bar of `article` bounce at `BOUNCE`."""
    stiffness = article.bar.mass * (2 * np.pi * BOUNCE) ** 2 / len(HUNG_AT)
    return {f"cord {number}": Cord(place, stiffness) for number, place in enumerate(HUNG_AT, start=1)}
