"""The most likely scales of the nuisances for one model, from the data and the priors of the scales.

Evidence as a function of a scale needs no further simulation: the model is linear about its fit, and all that changes
is how narrow the prior of some unknowns is, and how much of a residual smooth errors may explain.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.fitting.fit import Fit, fit
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.normal_equations import NormalBlock, normal_equations
from analysis.gap.fitting.stages import FINAL
from analysis.gap.measurement import HammerSet
from analysis.gap.simulation.baseline import GAIN, IN_TESTER
from analysis.gap.simulation.scales import HALF_NORMAL, Scales, unknown_scales
from analysis.inverse.levenberg_marquardt import Linearised

MULTIPLES = (0.02, 0.1, 0.2, 0.35, 0.6, 1.0, 1.5, 2.2, 3.0, 4.0)
"""Multiples of the half-normal prior's scale that are tried; the first is practically zero."""
COARSE = (0.1, 0.35, 1.0, 2.2)
"""Multiples with which lengths of correlation are compared."""
SHORTEST, FINER = 6.0, 1.12
"""Hz, length of correlation below which errors are noise, and the ratio of neighbouring lengths. All models are tried
with the same lengths, as the shapes of errors of one length are kept; one a fifth off leaves far more than noise."""
FIRST_LENGTHS = (0, 8, 17, 25)
"""Ranks of the lengths that are tried first: 6, 15, 41 and 102 Hz."""
CLOSER = (4, 2)
"""Ranks by which the best is then changed, up or down; then by one, as long as that is better."""
COMMON = (0.0, 0.3, 0.6, 0.8, 0.9, 0.96, 0.985, 1.0)
"""Shares of the variance of smooth errors that all sets have in common, that are tried."""
HOLDS = 1.2
"""Chi-square with the priors, per datum, up to which a model holds. The misfit of a wrong model is the same in every
set, and would look like a smooth error that sets have in common, so none is assumed then."""
LINES = 512
"""Lines of each set that are enough to estimate scales: two or three in the shortest length of correlation."""
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
    simulation, own = found.likelihood.simulation, found.likelihood.scales
    whole = found.likelihood.measurement
    likelihood = Likelihood(simulation.of(replace(whole, sets=tuple(map(_thinned, whole.sets)))))
    unknown = unknown_scales(likelihood.measurement.tolerances)
    predicted = likelihood.predict(found.scores)
    rows, tester = list(likelihood.rows(found.scores, predicted)), tuple(likelihood.of_tester(predicted))
    smooth = bool(likelihood.measurement.sets and own.model_error)
    sizes = COARSE if smooth and "model_error" in unknown else ()

    @cache
    def of_length(rank: int) -> tuple[float, _LinearModel, Scales]:
        """Log evidence of a length of correlation, by its rank, with the model and scales that have it."""
        length = SHORTEST * FINER**rank if smooth else own.correlation
        other = _under(likelihood, replace(own, correlation=length, common=0.0))  # each row has them
        errors = other.errors_of_rows
        along = [errors[block.set_number, block.row].along_once(whole) if smooth else None for block, whole in rows]
        model = _LinearModel(other, found.scores, [block for block, _ in rows], along, tester)
        scales = max(_multiples(model.likelihood.scales, "model_error", sizes), key=model.at)
        return model.at(scales), model, scales

    rank = _best_rank(own.correlation, lambda each: of_length(each)[0]) if smooth else 0
    _, model, best = of_length(rank)
    for name in SWEEPS * unknown:
        best = max(_multiples(best, name, MULTIPLES), key=model.at)
    if smooth and found.cost_per_datum < HOLDS and any(len(point.rows) > 1 for point in likelihood.smooth_errors):
        best = _climbed(replace(best, common=own.common), model.at)
        for name in unknown:
            if name != "model_error":
                best = max(_multiples(best, name, MULTIPLES), key=model.at)
    return best


@lru_cache(maxsize=16)
def _thinned(hammer_set: HammerSet) -> HammerSet:
    """A thinned set, cached with its digest: the shapes of its smooth errors are computed once for all models."""
    return hammer_set.thinned(LINES)


def _best_rank(before: float, at: Callable[[int], float]) -> int:
    """The rank of the length of highest evidence, sought about `before` (Hz) or the best of `FIRST_LENGTHS`."""
    known = max(round(float(np.log(before / SHORTEST) / np.log(FINER))), 0)
    rank = max((known, *FIRST_LENGTHS), key=at)
    for change in CLOSER if rank in FIRST_LENGTHS else ():
        rank = max((rank, max(rank - change, 0), rank + change), key=at)
    while (best := max((rank, max(rank - 1, 0), rank + 1), key=at)) != rank:
        rank = best
    return rank


def _climbed(scales: Scales, at: Callable[[Scales], float]) -> Scales:
    """Scales with the common share of highest evidence, from the given one on to neighbours as long as it rises."""
    while True:
        near = int(np.argmin(np.abs(np.array(COMMON) - scales.common)))
        found = max((replace(scales, common=share) for share in COMMON[max(near - 1, 0) : near + 2]), key=at)
        if found == scales:
            return found
        scales = found


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
        rows, tester: its normal equations, with noise alone.
        along: (n + 1, 2, K) amplitudes of smooth errors in each row; None without them.
    """

    likelihood: Likelihood
    scores: Real
    rows: Sequence[NormalBlock]
    along: Sequence[Real | None]
    tester: Sequence[NormalBlock]
    _sums: dict[tuple[float, float], Linearised] = field(default_factory=dict)
    _known: dict[Scales, float] = field(default_factory=dict)

    def at(self, scales: Scales) -> float:
        """Log evidence under other scales, up to a constant."""
        if scales not in self._known:
            self._known[scales] = self._log_evidence(scales)
        return self._known[scales]

    def _log_evidence(self, scales: Scales) -> float:
        other = _under(self.likelihood, scales)
        data, spread = self._without_prior(other), _spreads(self.likelihood, scales)
        scores = _divided(self.scores, spread)
        normal = spread[:, None] * data.normal * spread + np.eye(scores.size)
        pull = spread * data.descent - scores
        cost = data.cost + float(scores @ scores - pull @ np.linalg.solve(normal, pull))
        return float(-(cost + np.linalg.slogdet(normal)[1]) / 2 + other.log_normalisation)

    def _without_prior(self, other: Likelihood) -> Linearised:
        key = other.scales.model_error, other.scales.common
        if key not in self._sums:
            errors, blocks = other.errors_of_rows, list(self.tester)
            for block, along in zip(self.rows, self.along, strict=True):
                own = errors.get((block.set_number, block.row))
                blocks.append(block if own is None or along is None else block.under(own, *own.taken(along)))
            whole = normal_equations(blocks, np.zeros(self.scores.size))
            self._sums[key] = replace(whole, normal=whole.normal - np.eye(self.scores.size))
        return self._sums[key]


def _spreads(likelihood: Likelihood, scales: Scales) -> Real:
    """(unknowns,) standard deviation of each unknown under other scales, over the one that it has."""
    own, found = likelihood.scales, np.ones(likelihood.unknowns)
    for place, parameter in enumerate(likelihood.simulation.baseline.parameters):
        if parameter.kind == IN_TESTER:
            found[place] = _ratio(scales.setup_scatter, own.setup_scatter)
        if parameter.kind == GAIN:
            found[place] = _ratio(scales.configuration_gain, own.configuration_gain)
    for _, *joints in likelihood.setups:
        found[joints] = _ratio(scales.setup_scatter, own.setup_scatter)
    leans = [likelihood.blow_at_point(point)[1] for point in likelihood.struck]
    for number, each in enumerate(likelihood.measurement.sets):
        leans += [likelihood.blow_of_row(number, row)[1] for row in range(len(each.inputs))]
    found[leans] = _ratio(scales.blow_lean, own.blow_lean)
    return found


def _divided(scores: Real, spread: Real) -> Real:
    return np.asarray(np.where(spread > 0, scores / np.where(spread > 0, spread, 1.0), 0.0))


def _ratio(scale: float, before: float) -> float:
    return scale / before if before > 0 else 1.0
