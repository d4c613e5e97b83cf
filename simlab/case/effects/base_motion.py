"""Joints that stand on something which moves: its degrees of freedom are condensed."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from simlab.article import SimulatedArticle
from simlab.beam import Real
from simlab.case.effects.base import SimulatedEffect
from simlab.coupling import Complex


class OnBase(SimulatedEffect):
    """An effect by which a base under the joints gives."""

    @abstractmethod
    def base(self, omega: Complex) -> tuple[Real, Complex]:
        """How the base moves the joints, (6, g), and its own dynamic stiffness, (lines, g, g) in N/m."""

    def joints(self, stiffness: Complex, article: SimulatedArticle, omega: Complex) -> Complex:
        giving, base = self.base(omega)
        return np.asarray(stiffness - stiffness @ giving @ _followed(stiffness, giving, base))

    def deformed(self, motion: Complex, stiffness: Complex, omega: Complex) -> Complex:
        giving, base = self.base(omega)
        return np.asarray(motion - (giving @ _followed(stiffness, giving, base) @ motion[..., None])[..., 0])


def _followed(stiffness: Complex, giving: Real, base: Complex) -> Complex:
    """(lines, g, 6) motion of a base for that of the beam at the joints: (G^T K G + base)^-1 G^T K."""
    columns = stiffness @ giving
    return np.asarray(np.linalg.solve(giving.T @ columns + base, np.swapaxes(columns, 1, 2)))
