"""The scales of what differs on every bench, as the data and their priors suggest for one model.

Evidence as a function of a scale needs no further simulation: the model is linear about its fit, and all that changes
is how narrow the prior of some unknowns is, and how much of a residual smooth errors may explain.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.baseline import GAIN, IN_TESTER
from analysis.gap.fit import FINAL, Block, Fit, Likelihood, fit, normal_equations
from analysis.gap.scales import HALF_NORMAL, Scales, unknown_scales
from analysis.inverse.levenberg_marquardt import Linearised

MULTIPLES = (0.02, 0.1, 0.2, 0.35, 0.6, 1.0, 1.5, 2.2, 3.0, 4.0)
"""Of the half-normal prior's scale, that are tried; the first is as good as none."""
COARSE = (0.1, 0.35, 1.0, 2.2)
"""Those with which lengths of correlation are compared."""
CORRELATIONS = (6.0, 15.0, 40.0, 100.0)
"""Hz, that are tried."""
SWEEPS = 2
"""How often each scale is chosen, given the others."""
FAR = 3.0
"""Standard deviations to which a start under narrower scales is limited."""
ROUNDS = 2
"""How often a model is fitted again with scales that have changed."""


def with_likely_scales(found: Fit, most_steps: int = 10) -> Fit:
    """A fit with the most likely scales, fitted again where they differ from those that it had."""
    for _ in range(ROUNDS):
        scales = likely_scales(found)
        if scales == found.likelihood.scales:
            break
        start = rescaled(found.likelihood, found.scores, scales)
        found = fit(found.likelihood.simulation.with_scales(scales), start, (FINAL,), 1.0, most_steps)
    return found


def rescaled(likelihood: Likelihood, scores: Real, scales: Scales) -> Real:
    """(unknowns,) scores that make the same values under other scales, as far as these are plausible there."""
    spread = _spreads(likelihood, scales)
    changed = np.clip(_divided(scores, spread), -FAR, FAR)
    return np.asarray(np.where(spread == 1, scores, changed))


def likely_scales(found: Fit) -> Scales:
    """The scales of highest evidence among some multiples of their priors; those that are stated stay."""
    likelihood, own = found.likelihood, found.likelihood.scales
    unknown = unknown_scales(likelihood.measurement.tolerances)
    predicted = likelihood.predict(found.scores)
    smooth = bool(likelihood.measurement.sets and own.model_error)
    models = [
        _LinearModel(other, found.scores, other.blocks(found.scores, predicted))
        for correlation in (CORRELATIONS if smooth else (own.correlation,))
        for other in [_under(likelihood, replace(own, correlation=correlation))]
    ]
    coarse = COARSE if smooth and "model_error" in unknown else ()
    tried = {model: list(_multiples(model.likelihood.scales, "model_error", coarse)) for model in models}
    pairs = [(model, scales) for model in models for scales in tried[model]]
    model, best = max(pairs, key=lambda pair: pair[0].at(pair[1]))
    for name in SWEEPS * unknown:
        best = max(_multiples(best, name, MULTIPLES), key=model.at)
    return best


def _multiples(scales: Scales, name: str, multiples: Iterable[float]) -> Iterable[Scales]:
    yield scales
    yield from (replace(scales, **{name: multiple * getattr(HALF_NORMAL, name)}) for multiple in multiples)


def _under(likelihood: Likelihood, scales: Scales) -> Likelihood:
    return replace(likelihood, simulation=likelihood.simulation.with_scales(scales))


@dataclass(frozen=True, eq=False)
class _LinearModel:
    """A model linearised about its fit, with smooth errors of one length of correlation.

    Attributes:
        likelihood: under the scales of the fit.
        scores: (unknowns,).
        blocks: of its normal equations.
    """

    likelihood: Likelihood
    scores: Real
    blocks: tuple[Block, ...]
    _sums: dict[float, Linearised] = field(default_factory=dict)
    _known: dict[Scales, float] = field(default_factory=dict)

    def at(self, scales: Scales) -> float:
        """Log evidence under other scales, up to a constant."""
        if scales not in self._known:
            self._known[scales] = self._log_evidence(scales)
        return self._known[scales]

    def _log_evidence(self, scales: Scales) -> float:
        other, data = _under(self.likelihood, scales), self._without_prior(scales.model_error)
        spread = _spreads(self.likelihood, scales)
        scores = _divided(self.scores, spread)
        normal = spread[:, None] * data.normal * spread + np.eye(scores.size)
        pull = spread * data.descent - scores
        cost = data.cost + float(scores @ scores - pull @ np.linalg.solve(normal, pull))
        return float(-(cost + np.linalg.slogdet(normal)[1]) / 2 + other.log_normalisation)

    def _without_prior(self, model_error: float) -> Linearised:
        if model_error not in self._sums:
            given = self.likelihood.scales.model_error
            blocks = [self._seen(block, given, model_error) for block in self.blocks]
            whole = normal_equations(blocks, np.zeros(self.scores.size))
            self._sums[model_error] = replace(whole, normal=whole.normal - np.eye(self.scores.size))
        return self._sums[model_error]

    def _seen(self, block: Block, given: float, model_error: float) -> Block:
        errors = None if block.smooth is None else self.likelihood.smooth_errors(block.set_number)
        return (
            block
            if errors is None
            else block.less(errors.share(block.row, model_error) - errors.share(block.row, given))
        )


def _spreads(likelihood: Likelihood, scales: Scales) -> Real:
    """(unknowns,) standard deviation of each unknown under other scales, over the one that it has."""
    own, found = likelihood.scales, np.ones(likelihood.unknowns)
    for place, parameter in enumerate(likelihood.simulation.baseline.parameters):
        kind = parameter.name.partition("(")[0]
        if kind == IN_TESTER:
            found[place] = _ratio(scales.setup_scatter, own.setup_scatter)
        if kind == GAIN:
            found[place] = _ratio(scales.configuration_gain, own.configuration_gain)
    for _, *joints in likelihood.setups:
        found[joints] = _ratio(scales.setup_scatter, own.setup_scatter)
    return found


def _divided(scores: Real, spread: Real) -> Real:
    return np.asarray(np.where(spread > 0, scores / np.where(spread > 0, spread, 1.0), 0.0))


def _ratio(scale: float, before: float) -> float:
    return scale / before if before > 0 else 1.0
