"""What free frequencies do not say of a bar, in plain sentences."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from analysis.suspended.beam_update import PARAMETERS, BeamUpdate

LIKE_TWINS = 0.99  # cosine of what two parameters do to the frequencies
SILENT = 0.3  # a parameter that moves no frequency by this share of its error, over its tolerance, does not show
UNLEARNT = 0.9  # a standard deviation that is this share of the tolerance, or more, is still that of the tolerance

NAMES: Mapping[str, str] = {
    "youngs_modulus": "Young's modulus",
    "density": "density",
    "length": "length",
    "height": "height",
    "width": "width",
}
MODULUS_BY_DENSITY = {"youngs_modulus": 1.0, "density": -1.0}
SLENDER = {"youngs_modulus": 1.0, "density": -1.0, "height": 2.0, "length": -4.0}
"""Powers in E h^2 / (rho L^4): the frequencies of a slender bar are proportional to its root."""


@dataclass(frozen=True)
class Twins:
    """Two parameters that move the measured frequencies alike.

    Attributes:
        first, second: of `PARAMETERS`.
        cosine: between what the two do to the frequencies, by the errors of these; 1 or -1 cannot be told apart.
        correlation: of the two after the update.
    """

    first: str
    second: str
    cosine: float
    correlation: float

    @property
    def text(self) -> str:
        """The pair in words."""
        return (
            f"{NAMES[self.first]} and {NAMES[self.second]} (cosine {self.cosine:+.4f}, "
            f"correlation after the update {self.correlation:+.3f})"
        )


def twins(update: BeamUpdate) -> tuple[Twins, ...]:
    """Pairs of parameters, neither of them exact, that the frequencies cannot tell apart; the likest first."""
    signatures = update.slopes * update.prior_deviation / update.deviation[:, None]
    size = np.linalg.norm(signatures, axis=0)
    shown = [place for place in range(len(PARAMETERS)) if size[place] > SILENT]
    found = [
        Twins(
            PARAMETERS[one],
            PARAMETERS[other],
            float(signatures[:, one] @ signatures[:, other] / (size[one] * size[other])),
            update.correlation(PARAMETERS[one], PARAMETERS[other]),
        )
        for one, other in combinations(shown, 2)
    ]
    return tuple(sorted((pair for pair in found if abs(pair.cosine) > LIKE_TWINS), key=lambda pair: -abs(pair.cosine)))


def statements(update: BeamUpdate) -> tuple[str, ...]:
    """What the data determine, what they do not, and whether they agree with the tolerances; one sentence each."""
    return (
        *([] if update.consistent else [_disagreement(update)]),
        _determined(update),
        *_ratio_only(update),
        *_unlearnt(update),
        *_twins(update),
    )


def _determined(update: BeamUpdate) -> str:
    slender = update.combination(SLENDER)
    share = slender.standard_error / slender.value
    return f"E h^2 / (rho L^4), which the frequencies of a slender bar follow, is known to {share:.2g} (relative)"


def _ratio_only(update: BeamUpdate) -> list[str]:
    prior = dict(zip(PARAMETERS, update.prior_deviation.tolist(), strict=True))
    if update.weighed or not (prior["youngs_modulus"] and prior["density"]):
        return []
    ratio, modulus, density = (
        update.combination(powers) for powers in (MODULUS_BY_DENSITY, {"youngs_modulus": 1.0}, {"density": 1.0})
    )
    shares = [found.standard_error / found.value for found in (ratio, modulus, density)]
    return [
        f"E and rho show as the ratio E / rho = {ratio.value:.6g} (m/s)^2 only, known to {shares[0]:.2g} (relative); E "
        f"alone is known to {shares[1]:.2g} and rho alone to {shares[2]:.2g}, by their tolerances: weigh the bar"
    ]


def _twins(update: BeamUpdate) -> list[str]:
    pairs = "; ".join(pair.text for pair in twins(update))
    return (
        [f"twins, which move these frequencies alike and are told apart by tolerances only: {pairs}"] if pairs else []
    )


def _unlearnt(update: BeamUpdate) -> list[str]:
    """Parameters that are known no better than before."""
    prior, after = update.prior_deviation, np.sqrt(np.diag(update.covariance))
    signatures = np.max(np.abs(update.slopes) / update.deviation[:, None], axis=0) * prior
    found = []
    for name, before, now, signature in zip(PARAMETERS, prior, after, signatures, strict=True):
        if before == 0:
            found.append(f"{NAMES[name]} was taken to be exact")
        elif now >= UNLEARNT * before:
            why = "does not show in these frequencies" if signature < SILENT else "cannot be told from the others"
            found.append(f"{NAMES[name]} {why}: known to {now:.2g} (relative), its tolerance being {before:.2g}")
    return found


def _disagreement(update: BeamUpdate) -> str:
    worst = int(np.argmax(np.abs(update.misfit) / update.deviation))
    stretched = int(np.argmax(np.abs(update.deviations_used)))
    return (
        f"frequencies and tolerances disagree, so no interval here can be relied on: chi-square "
        f"{update.chi_square:.3g} on {update.degrees_of_freedom}; the best bar has its {NAMES[PARAMETERS[stretched]]} "
        f"{update.deviations_used[stretched]:+.1f} tolerances off and leaves mode {update.numbers[worst]} "
        f"{update.misfit[worst]:+.2g} (relative) from its measurement, where {update.deviation[worst]:.2g} is expected"
    )
