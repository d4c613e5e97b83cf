"""Which parameters of a beam its free frequencies do not determine, in plain sentences."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from analysis.suspended.beam_update import PARAMETERS, BeamUpdate

CONFOUNDED = 0.99  # least cosine between the effects of two confounded parameters on the frequencies
INVISIBLE = 0.3  # a parameter whose tolerance changes no frequency by this share of its error is invisible
UNCHANGED = 0.9  # standard deviation after the update over the tolerance, from which the data tell nothing new

NAMES: Mapping[str, str] = {
    "youngs_modulus": "Young's modulus",
    "density": "density",
    "length": "length",
    "height": "height",
    "width": "width",
}
MODULUS_BY_DENSITY = {"youngs_modulus": 1.0, "density": -1.0}
SLENDER = {"youngs_modulus": 1.0, "density": -1.0, "height": 2.0, "length": -4.0}
"""Exponents of E h^2 / (rho L^4); the frequencies of a slender beam are proportional to its root."""


@dataclass(frozen=True)
class ConfoundedPair:
    """Two parameters with nearly the same effect on the measured frequencies.

    Attributes:
        first, second: of `PARAMETERS`.
        cosine: between their effects on the frequencies, in errors of these; at 1 or -1 the two are inseparable.
        correlation: of the two after the update.
    """

    first: str
    second: str
    cosine: float
    correlation: float

    @property
    def text(self) -> str:
        """The pair as text."""
        return (
            f"{NAMES[self.first]} and {NAMES[self.second]} (cosine {self.cosine:+.4f}, "
            f"correlation after the update {self.correlation:+.3f})"
        )


def confounded_pairs(update: BeamUpdate) -> tuple[ConfoundedPair, ...]:
    """Pairs of inexact parameters that the frequencies cannot separate, the most similar first."""
    signatures = update.slopes * update.prior_deviation / update.deviation[:, None]
    size = np.linalg.norm(signatures, axis=0)
    shown = [place for place in range(len(PARAMETERS)) if size[place] > INVISIBLE]
    found = [
        ConfoundedPair(
            PARAMETERS[one],
            PARAMETERS[other],
            float(signatures[:, one] @ signatures[:, other] / (size[one] * size[other])),
            update.correlation(PARAMETERS[one], PARAMETERS[other]),
        )
        for one, other in combinations(shown, 2)
    ]
    return tuple(sorted((pair for pair in found if abs(pair.cosine) > CONFOUNDED), key=lambda pair: -abs(pair.cosine)))


def statements(update: BeamUpdate) -> tuple[str, ...]:
    """One sentence each: which parameters the data determine and which not, and any conflict with the tolerances."""
    powers = (SLENDER, MODULUS_BY_DENSITY, {"youngs_modulus": 1.0}, {"density": 1.0})
    products = [update.combination(each) for each in powers]
    slender, ratio, modulus, density = (product.standard_error / product.value for product in products)
    found = [] if update.consistent else [_conflict(update)]
    found.append(
        f"E h^2 / (rho L^4), which the frequencies of a slender beam follow, is known to {slender:.2g} (relative)"
    )
    prior = dict(zip(PARAMETERS, update.prior_deviation.tolist(), strict=True))
    if not update.weighed and prior["youngs_modulus"] and prior["density"]:
        found.append(
            f"E and rho show as the ratio E / rho = {products[1].value:.6g} (m/s)^2 only, known to {ratio:.2g} "
            f"(relative); E alone is known to {modulus:.2g} and rho alone to {density:.2g}, by their tolerances: weigh "
            "the beam"
        )
    found += _unchanged(update)
    if pairs := "; ".join(pair.text for pair in confounded_pairs(update)):
        found.append(f"twins, which move these frequencies alike and are distinguished by tolerances only: {pairs}")
    return tuple(found)


def _unchanged(update: BeamUpdate) -> list[str]:
    """Parameters that are known no better after the update."""
    prior, after = update.prior_deviation, np.sqrt(np.diag(update.covariance))
    signatures = np.max(np.abs(update.slopes) / update.deviation[:, None], axis=0) * prior
    found = []
    for name, before, now, signature in zip(PARAMETERS, prior, after, signatures, strict=True):
        if before == 0:
            found.append(f"{NAMES[name]} was taken to be exact")
        elif now >= UNCHANGED * before:
            why = "does not show in these frequencies" if signature < INVISIBLE else "looks like the others"
            found.append(f"{NAMES[name]} {why}: known to {now:.2g} (relative), its tolerance being {before:.2g}")
    return found


def _conflict(update: BeamUpdate) -> str:
    worst = int(np.argmax(np.abs(update.misfit) / update.deviation))
    stretched = int(np.argmax(np.abs(update.deviations_used)))
    return (
        f"frequencies and tolerances disagree, so no interval here can be relied on: chi-square "
        f"{update.chi_square:.3g} on {update.degrees_of_freedom}; the best beam has its {NAMES[PARAMETERS[stretched]]} "
        f"{update.deviations_used[stretched]:+.1f} tolerances off and leaves mode {update.numbers[worst]} "
        f"{update.misfit[worst]:+.2g} (relative) from its measurement, where {update.deviation[worst]:.2g} is expected"
    )
