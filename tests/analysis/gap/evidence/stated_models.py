"""Models whose evidence is stated, to see which explanation wins without a fit."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import cast

import numpy as np

from analysis.gap.effect import Effect
from analysis.gap.evidence.residual_structure import CHANCE_LIMIT, Misfit
from analysis.gap.fitting.fit import Fit
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import Model
from analysis.inverse.levenberg_marquardt import Linearised

DATA = 1000


@dataclass(frozen=True)
class Stated(Model):
    """A model with a misfit and a density of data left out that are stated and not computed."""

    stated: float = 0.0
    predictive: float = 0.0
    common_noise: float = 1.0

    @property
    def misfit(self) -> Misfit:
        return Misfit(self.stated + CHANCE_LIMIT if self.stated else 0.0, 1.0, 0.0, self.common_noise)

    def log_predictive_density(self, overdispersion: float) -> float:
        return self.predictive


def model(
    effects: tuple[Effect, ...], chi_square: float, left: float = 0.0, score: float = 1.0, predictive: float = 0.0
) -> Model:
    """Its effects `score` standard deviations from none, and known to a hundredth of their range."""
    shared = tuple(parameter for effect in effects for parameter in effect.parameters)
    scores = np.full(len(shared), score)
    simulation = SimpleNamespace(shared=shared, baseline=SimpleNamespace(parameters=()), effects=effects)
    likelihood = cast(
        "Likelihood", SimpleNamespace(simulation=simulation, parameters=shared, data=DATA, log_normalisation=0.0)
    )
    normal = np.eye(len(shared)) * 1e4
    at = Linearised(chi_square + float(scores @ scores), np.zeros(len(shared)), normal)
    return Stated(effects, Fit(likelihood, scores, at, True), left, predictive)
