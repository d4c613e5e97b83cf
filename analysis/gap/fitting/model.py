"""One fitted model, and the best of many."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.effect import Effect
from analysis.gap.evidence.model_evidence import (
    OverdispersedLikelihood,
    divided,
    log_evidence,
    overdispersed,
)
from analysis.gap.evidence.residual_structure import Misfit, misfit_of, series
from analysis.gap.fitting.fit import Fit, as_unknowns, evaluated, fit
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.predictive import Part, density_of, parts_of
from analysis.gap.fitting.scale_estimate import HOLDS, rescaled, with_likely_scales
from analysis.gap.fitting.stages import FINAL
from analysis.gap.measurement import Measurement
from analysis.gap.simulation.scales import Scales
from analysis.gap.simulation.simulation_state import Prediction
from analysis.inverse.levenberg_marquardt import minimise

ENOUGH = 1.0
"""Gain in chi-square (over chi-square per datum) at which a search ends; what it finds is refined afterwards."""
REFINING_STEPS = 6
OVERDISPERSED_STEPS, CLOSE_ENOUGH = 10, 0.1
"""Most steps of a fit with overdispersion, and the gain in its sum of squares at which it ends, twice that in log
evidence."""


@dataclass(frozen=True, eq=False)
class Model:
    """A fitted model: the baseline with any number of effects.

    Attributes:
        effects: in the order in which they act.
        fit: its most likely parameters.
        overdispersed_fit: the most likely parameters with chi-square divided by the overdispersion of a contest; None
            where it was not fitted again.
        parts: of the data, as of `predictive.parts_of`, at `overdispersed_fit` or `fit`, if computed beforehand.
        compared_misfit: the misfit under the scales of the models it is compared with; None where they are its own.
    """

    effects: tuple[Effect, ...]
    fit: Fit
    overdispersed_fit: Fit | None = field(default=None, kw_only=True)
    parts: tuple[Part, ...] | None = field(default=None, kw_only=True)
    compared_misfit: Misfit | None = field(default=None, kw_only=True)

    @property
    def ids(self) -> tuple[str, ...]:
        """Ids of its effects."""
        return tuple(effect.id for effect in self.effects)

    @property
    def clean(self) -> bool:
        """Whether it leaves almost no misfit, with parameters that priors expect."""
        return self.fit.cost_per_datum < HOLDS

    @cached_property
    def clean_in_tester(self) -> bool:
        """Whether it leaves almost no misfit in the tester alone, which has few data compared with the beam."""
        points = self.fit.likelihood.measurement.points
        if points is None:
            return True
        left = (points.stiffness - self.fit.readings.stiffness) / points.deviation
        return float(np.mean(np.abs(left) ** 2)) / 2 < HOLDS

    @cached_property
    def log_evidence(self) -> float:
        """Log evidence of this law, with noise alone."""
        return log_evidence(self.fit)

    @cached_property
    def misfit(self) -> Misfit:
        """The misfit beyond noise."""
        return self.compared_misfit or misfit(self.fit)

    def fit_with(self, overdispersion: float) -> Fit:
        """The fit with chi-square divided by an overdispersion: fitted again, or a step from the fit to noise alone."""
        return self.overdispersed_fit or overdispersed(self.fit, overdispersion)

    def log_predictive_density(self, overdispersion: float) -> float:
        """Log density of parts of the data that are left out in turn."""
        again = self.overdispersed_fit
        there = divided(self.fit.at, self.fit.scores, overdispersion) if again is None else again.at
        return density_of(self.parts or parts_of(again or self.fit), there, overdispersion)

    def places(self, effect: int) -> range:
        """Indices, among the shared parameters, of those of one of its effects."""
        first = len(self.fit.likelihood.simulation.baseline.parameters)
        counts = [len(each.parameters) for each in self.effects]
        return range(first + sum(counts[:effect]), first + sum(counts[: effect + 1]))


def misfit(found: Fit) -> Misfit:
    """The misfit of a fitted model, over every row of accelerances and every series of the tester."""
    shares = [1.0] * len(found.likelihood.measurement.sets)
    return _misfit(found.likelihood, found.scores, found.readings, shares)


def with_misfit_on(model: Model, measurement: Measurement) -> Model:
    """A model whose misfit is that on other lines of the same sets, in proportion to the number of lines.

    Where the lines of a fit are far apart, its misfit at a sharp peak has no neighbour that shows it.
    """
    own = model.fit.likelihood
    pairs = zip(own.measurement.sets, measurement.sets, strict=True)
    shares = [fitted.frequency.size / each.frequency.size for fitted, each in pairs]
    there, scores = Likelihood(own.simulation.of(measurement)), model.fit.scores
    return replace(model, compared_misfit=_misfit(there, scores, there.predict(scores, ()), shares))


def _misfit(likelihood: Likelihood, scores: Real, readings: Prediction, shares: Sequence[float]) -> Misfit:
    """The misfit of the `readings` at `scores` (unknowns,); that of each hammer set counts with its share."""
    measurement, decays = likelihood.measurement, likelihood.simulation.decays(scores)
    parts, of_parts = list[Complex](), list[tuple[float, float]]()
    for number, rows in enumerate(likelihood.left_over(readings)):
        decay = max(0.0, decays[number]) / spacing_of(measurement.sets[number].frequency)
        parts += [*rows]
        of_parts += [(decay, shares[number])] * len(rows)
    points = measurement.points
    if points is not None:
        left = (points.stiffness - readings.stiffness) / points.deviation
        of_tester = [left[members] for members in series(points).values()]
        parts += of_tester
        of_parts += [(0.0, 1.0)] * len(of_tester)
    return misfit_of(parts, *zip(*of_parts, strict=True))


def spacing_of(frequency: Real) -> float:
    """Distance of neighbouring lines, Hz; some may have been left out. That of a single line is without bound."""
    return float(np.median(np.diff(frequency))) if frequency.size > 1 else np.inf


def evaluate_on(model: Model, measurement: Measurement) -> Model:
    """A model with its parameters unchanged, evaluated on other lines of the same sets."""
    other = model.fit.likelihood.simulation.of(measurement)
    return Model(model.effects, evaluated(Likelihood(other), model.fit.scores))


def without_effects(model: Model, none: Model) -> Model:
    """The paper's model at the parameters that another model has, without its effects.

    Args:
        model: with effects.
        none: the paper's model of the same data.
    """
    own = [place for effect in range(len(model.effects)) for place in model.places(effect)]
    likelihood = none.fit.likelihood  # it has no amplitude errors, which an effect of amplitude adds
    return Model((), evaluated(likelihood, as_unknowns(np.delete(model.fit.scores, own), likelihood)))


def refined(model: Model, measurement: Measurement, scales: Scales | None = None) -> Model:
    """A model fitted to other lines of the same sets, from its own parameters.

    Args:
        model: fitted.
        measurement: with other lines.
        scales: of the nuisances; None for those that are most likely with this model.
    """
    simulation, start = model.fit.likelihood.simulation.of(measurement), model.fit.scores
    if scales is None:
        return Model(model.effects, with_likely_scales(fit(simulation, start, (FINAL,), ENOUGH, REFINING_STEPS)))
    start = rescaled(model.fit.likelihood, start, scales)
    return Model(model.effects, fit(simulation.with_scales(scales), start, (FINAL,), ENOUGH, REFINING_STEPS))


def with_overdispersion(model: Model, overdispersion: float) -> Model:
    """The model with a second fit, in which chi-square is divided by T: a linear step does not reach a distant minimum.

    Parameters, misfit and predictions still come from `fit`, the fit to noise alone. `overdispersed_fit` and `parts`
    are set. With T = 1 a second fit is not needed, and only `parts` are set.
    """
    if overdispersion == 1.0:
        return replace(model, parts=parts_of(model.fit))
    found = model.fit
    target = OverdispersedLikelihood(found.likelihood, found.scores, found.at, overdispersion)
    end = minimise(target, found.scores, CLOSE_ENOUGH, OVERDISPERSED_STEPS)
    again = Fit(found.likelihood, end.values, end.at, end.converged)
    return replace(model, overdispersed_fit=again, parts=parts_of(again))


def best_by_id(models: Sequence[Model]) -> list[Model]:
    """The best model of each set of effects, the best first."""
    found = dict[frozenset[str], Model]()
    for model in sorted(models, key=lambda each: -each.log_evidence):
        found.setdefault(frozenset(model.ids), model)
    return list(found.values())
