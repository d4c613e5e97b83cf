"""The search for effects: every candidate on top of the best models so far, until further ones gain too little."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import zip_longest

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.gap.diagnosis_step import Stage, StepReport
from analysis.gap.evidence.calibration import Calibration
from analysis.gap.evidence.contest import Catalogue
from analysis.gap.evidence.model_evidence import divided, log_evidence, overdispersed
from analysis.gap.evidence.residual_structure import Misfit, misfit_of
from analysis.gap.evidence.verdict import leading, weigh
from analysis.gap.fitting.predictive import density_of
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.effect import StructureEffect, label_of
from analysis.gap.structures.likelihood import INFLATIONS, CurveFit, CurveLikelihood, fit_curves
from analysis.gap.structures.pulls import pull_energy
from analysis.gap.structures.simulator import Simulator

LEADERS = 3
"""Number of best models to which further effects are added."""
MOST_EFFECTS = 3
"""Largest number of effects of an explanation."""
CLOSE = (0.1, 0.0)
"""Inflations of a fit that starts near its end."""
PROMISING = 12.0
"""Gain in chi-square, over chi-square per datum, that one linear step has to promise for an effect to be fitted."""
SEARCH, SEARCH_AGAIN = (0.0, 0.5), (0.5, 0.85)
"""Shares of a diagnosis between which effects are sought, and sought again with smooth errors."""
MOST_STEPS = 10
"""Steps of a fit while candidates are compared; leaders are then fitted to the end."""


@dataclass(frozen=True, eq=False)
class CurveModel:
    """A fitted model of any structure: its simulation with no, one or more effects."""

    effects: tuple[StructureEffect, ...]
    fit: CurveFit

    @property
    def ids(self) -> tuple[str, ...]:
        """Ids of its effects."""
        return tuple(each.id for each in self.effects)

    @property
    def overdispersed_fit(self) -> None:
        """None: it is not fitted again."""
        return None

    def fit_with(self, overdispersion: float) -> CurveFit:
        """The fit with chi-square divided by an overdispersion: a step from the fit to noise alone."""
        return overdispersed(self.fit, overdispersion)

    @cached_property
    def log_evidence(self) -> float:
        """Log evidence with noise alone."""
        return log_evidence(self.fit)

    @cached_property
    def misfit(self) -> Misfit:
        """The misfit beyond noise, over the values of each curve in their order, and in parameters that are far off."""
        likelihood, found = self.fit.likelihood, list[Complex]()
        for curve in likelihood.curves:
            left = likelihood.left(self.fit.scores, curve)
            half = left.size // 2
            whole = left[:half] + 1j * left[half:] if curve.is_complex else left
            found.append(np.asarray(whole))
        own = misfit_of([each for each in found if each.size])
        return replace(own, energy=own.energy + pull_energy(self.fit))

    def log_predictive_density(self, overdispersion: float) -> float:
        """Log density of parts that are left out in turn."""
        blocks = ((each.unknowns, each.normal, each.descent, each.chi_square) for each in self.fit.blocks)
        return density_of(blocks, divided(self.fit.at, self.fit.scores, overdispersion), overdispersion)

    def places(self, effect: int) -> range:
        """Indices, among the parameters, of those of one of its effects."""
        counts = [len(each.parameters) for each in self.effects]
        first = len(self.fit.likelihood.simulator.parameters) + sum(counts[:effect])
        return range(first, first + counts[effect])


@dataclass(frozen=True)
class Failure:
    """A candidate that could not be computed.

    Attributes:
        effect: its id and law.
        reason: what went wrong.
    """

    effect: str
    reason: str


@dataclass(eq=False)
class CurveSearch:
    """A search over models of the same curves.

    Attributes:
        simulator: of the structure.
        curves: measured.
        candidates: effects that are tried.
        calibration: what trials say.
        report: told of each step, and of the leading explanation with laws after each round.
        failures: candidates that could not be computed.
        smooth_error: scale of the smooth errors of the curves.
        span: shares of the diagnosis that are done when the search begins and when it ends.
    """

    simulator: Simulator
    curves: tuple[Curve, ...]
    candidates: tuple[StructureEffect, ...]
    calibration: Calibration
    report: StepReport
    failures: list[Failure] = field(default_factory=list)
    smooth_error: float = 0.0
    span: tuple[float, float] = SEARCH
    visited: list[CurveModel] = field(default_factory=list)

    @property
    def catalogue(self) -> Catalogue:
        """Mechanism of each candidate with a law."""
        return {each.id: each.mechanism for each in self.candidates if not each.law_free}

    def fit_simulation(self) -> CurveModel:
        """The simulation without effects, fitted.

        Raises:
            AnalysisError: the simulator does not predict these curves.
        """
        likelihood = self._likelihood(())
        check(likelihood, np.zeros(likelihood.unknowns))
        return CurveModel((), fit_curves(likelihood, np.zeros(likelihood.unknowns)))

    def _likelihood(self, effects: tuple[StructureEffect, ...]) -> CurveLikelihood:
        return CurveLikelihood(self.simulator, effects, self.curves, smooth_error=self.smooth_error)

    def run(self, none: CurveModel) -> list[CurveModel]:
        """Every model that was visited beside the one without effects."""
        leaders = [none]
        for size in range(1, min(MOST_EFFECTS, self.calibration.most_effects) + 1):
            for number, leader in enumerate(leaders):
                stage = Stage.SINGLE_EFFECTS if size == 1 and self.span == SEARCH else Stage.FURTHER_EFFECTS
                done = (size - 1 + number / len(leaders)) / MOST_EFFECTS
                self.report.begin(stage, self.span[0] + (self.span[1] - self.span[0]) * done)
                self._add_to(leader)
            leaders = self._leaders(none, size)
            if not leaders:
                break
        self._name_mechanisms()
        return self.visited

    def _add_to(self, model: CurveModel) -> None:
        known = {each.effects for each in self.visited}
        for each in self.candidates:
            effects = tuple(sorted((*model.effects, each), key=repr))
            if each.id not in model.ids and effects not in known and not _doubled(effects):
                self._visit(model, effects)

    def _visit(self, model: CurveModel, effects: tuple[StructureEffect, ...]) -> None:
        """Fit a model with further effects, from every start of theirs, and keep the best.

        Effects with as many parameters as there are data fit anything, and cannot be judged.
        """
        likelihood, best = self._likelihood(effects), None
        new = [each for each in effects if each not in model.effects]
        if (count := sum(len(each.parameters) for each in effects)) >= likelihood.data:
            if len(effects) == 1:
                reason = (
                    f"it has {count} parameters for {likelihood.data} measured values, which it fits whatever they are"
                )
                self.failures.append(Failure(label_of(new[0]), reason))
            return
        own, said = [(each, parameter.name) for each in new for parameter in each.parameters], ""
        for values in zip_longest(*(p.starts for e in new for p in e.parameters), fillvalue=0.0):
            start = started(model, likelihood, dict(zip(own, values, strict=True)))
            try:
                check(likelihood, start)
                if model.effects and not promising(model, likelihood, start):
                    continue
                for scores, inflations in self._beginnings(model, start):
                    found = fit_curves(likelihood, scores, inflations, most_steps=MOST_STEPS)
                    if best is None or found.at.cost < best.at.cost:
                        best = found
            except AnalysisError as error:
                said = str(error)
        if best is not None:
            self.visited.append(CurveModel(effects, best))
        elif said and len(effects) == 1:
            self.failures.append(Failure(label_of(new[0]), said))

    def _beginnings(self, model: CurveModel, start: Real) -> list[tuple[Real, Sequence[float]]]:
        """The starts of fits, with their inflations.

        A simulation that does not hold has parameters far off, so the first effect also begins at their centres.
        """
        likelihood = model.fit.likelihood
        if model.effects:
            return [(start, CLOSE)]
        centre = start.copy()
        centre[: len(likelihood.parameters)] = 0.0
        centre[start.size - len(likelihood.parts) * len(likelihood.simulator.local) :] = 0.0
        return [(start, CLOSE), (centre, INFLATIONS)]

    def _leaders(self, none: CurveModel, size: int) -> list[CurveModel]:
        """The best models of a size, where a smaller one is not clearly better.

        The search goes on beside a smooth function that fits: two laws may predict more than the function does.
        """
        own = [each for each in self.visited if len(each.effects) == size]
        if not own:
            return []
        by_laws = [each for each in self.visited if not any(effect.law_free for effect in each.effects)]
        verdict = leading(weigh(none, by_laws, self.calibration, catalogue=self.catalogue))
        self.report.answer(verdict, none)
        if len(verdict.model.effects) < size - 1 or verdict.model.fit.per_datum < 1.0:
            return []
        best = dict[frozenset[str], CurveModel]()
        for each in sorted(own, key=lambda model: -model.log_evidence):
            best.setdefault(frozenset(each.ids), each)
        return [self._settled(each) for each in list(best.values())[:LEADERS]]

    def _settled(self, model: CurveModel) -> CurveModel:
        """A model whose fit has converged; among those visited, it replaces the given one."""
        if model.fit.converged:
            return model
        try:
            again = CurveModel(model.effects, fit_curves(model.fit.likelihood, model.fit.scores, CLOSE[-1:]))
        except AnalysisError:  # further on there is no prediction
            return model
        self.visited[self.visited.index(model)] = again
        return again

    def _name_mechanisms(self) -> None:
        """Fit, for each good model with a smooth function, the model with the best law of that mechanism instead."""
        free = [each for each in self.visited if any(effect.law_free for effect in each.effects)]
        for model in sorted(free, key=lambda each: -each.log_evidence)[:LEADERS]:
            smooth = next(each for each in model.effects if each.law_free)
            rest = tuple(each for each in model.effects if each is not smooth)
            known = {each.effects for each in self.visited}
            for law in self.candidates:
                effects = tuple(sorted((*rest, law), key=repr))
                named = law.mechanism == smooth.mechanism and not law.law_free and law.id not in {e.id for e in rest}
                if named and effects not in known:
                    base = next((each for each in self.visited if set(each.effects) == set(rest)), None)
                    if base is not None:
                        self._visit(base, effects)


def _doubled(effects: Sequence[StructureEffect]) -> bool:
    """Whether a smooth function stands beside a law of its own mechanism, which it contains."""
    free = {each.mechanism for each in effects if each.law_free}
    return any(each.mechanism in free for each in effects if not each.law_free)


def started(model: CurveModel, likelihood: CurveLikelihood, starts: dict[tuple[StructureEffect, str], float]) -> Real:
    """(unknowns,) scores of a model, with those of further effects at their starts."""
    own = model.fit.likelihood
    shared = len(own.simulator.parameters)
    scores = [*model.fit.scores[:shared]]
    for effect in likelihood.effects:
        if effect in model.effects:
            scores += model.fit.scores[model.places(model.effects.index(effect))].tolist()
        else:
            scores += [starts.get((effect, each.name), 0.0) for each in effect.parameters]
    return np.array([*scores, *model.fit.scores[len(own.parameters) :]])


def promising(model: CurveModel, likelihood: CurveLikelihood, start: Real) -> bool:
    """Whether a linear step from `start` lowers the cost of a model as much as an effect must to pay for itself."""
    there = likelihood.linearised(start)
    reached = there.cost - float(there.descent @ np.linalg.solve(there.normal, there.descent))
    return model.fit.at.cost - reached > PROMISING * max(1.0, model.fit.per_datum)


def check(likelihood: CurveLikelihood, scores: Real) -> None:
    """Check that every curve can be predicted, as a simulator or an effect may be code of users.

    Raises:
        AnalysisError: what goes wrong, and whose code it is.
    """
    for curve in likelihood.curves:
        if not np.all(np.isfinite(likelihood.predict(scores, curve))):
            raise AnalysisError(f"{likelihood.who} gives values that are not finite for {curve.name}")
