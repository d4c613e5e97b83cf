"""What a suspended bar is made of, for a model whose dimensions stay as drawn.

A bar bends by E h^3 w / L^3 and weighs rho L h w. Its free frequencies fix the ratio of the two, and a balance the
second, far better than anything fixes E, rho and the dimensions one by one. So what is left of the dimensions'
tolerances goes into E and rho, which then have errors in common.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from analysis.interval import Estimate
from analysis.structure.beam import Beam
from analysis.suspended.beam_slopes import PARAMETERS
from analysis.suspended.beam_update import BeamUpdate

BENDS_BY = {"youngs_modulus": 1.0, "height": 3.0, "width": 1.0, "length": -3.0}
WEIGHS = {"density": 1.0, "height": 1.0, "width": 1.0, "length": 1.0}


@dataclass(frozen=True)
class Material:
    """Young's modulus and density of a bar of the drawing's dimensions that bends and weighs as the suspended one.

    Attributes:
        youngs_modulus: Pa.
        density: kg/m^3.
        correlation: between the two.
    """

    youngs_modulus: Estimate
    density: Estimate
    correlation: float

    def of(self, drawn: Beam) -> Beam:
        """The bar as drawn, of this material."""
        return replace(drawn, youngs_modulus=self.youngs_modulus.value, density=self.density.value)


def material_of(update: BeamUpdate) -> Material:
    """The material that an updated bar leads to."""
    powers = np.array([[power.get(name, 0.0) for name in PARAMETERS] for power in (BENDS_BY, WEIGHS)])
    covariance = powers @ update.covariance @ powers.T
    deviation = np.sqrt(np.diag(covariance))
    modulus = update.drawn.youngs_modulus * _grown(update, BENDS_BY)
    density = update.drawn.density * _grown(update, WEIGHS)
    size = float(np.prod(deviation))
    return Material(
        Estimate(modulus, modulus * float(deviation[0])),
        Estimate(density, density * float(deviation[1])),
        float(covariance[0, 1]) / size if size > 0 else 0.0,
    )


def _grown(update: BeamUpdate, powers: Mapping[str, float]) -> float:
    """A product of powers of the bar's parameters after the update over that before."""
    return float(
        np.prod([(getattr(update.beam, name) / getattr(update.drawn, name)) ** power for name, power in powers.items()])
    )
