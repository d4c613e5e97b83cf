"""Any number of effects: one after the other is added to the best models so far, and earlier ones are exchanged.

An effect is first fitted as if it were the only one. Where a wrong effect hides a large one, a further effect shows it:
each effect of a leading model is therefore taken out again, and others are tried in its place.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.effect import Effect, Mechanism
from analysis.gap.evidence.calibration import Calibration
from analysis.gap.evidence.plausibility import CHANCE, implausibility
from analysis.gap.evidence.verdict import EXCLUDED, UNKNOWN, Weighed, leading, weigh
from analysis.gap.fitting.fit import cost_at
from analysis.gap.fitting.model import Model, best_by_id, without_effects
from analysis.gap.fitting.stages import CLOSE, FINAL
from analysis.gap.outside_catalogue.local_change import LOCAL_CHANGE
from analysis.gap.search.single_effects import (
    FITTED_AFTER_CLEAN,
    MOST_LAWS_FITTED,
    PROMISING,
    SETTLING_STEPS,
    Search,
    seeds,
    settled,
)
from analysis.gap.simulation.two_rigs import Simulation

FITTED_ON_ONE, FITTED_ON_MORE = 6, 4
"""Further effects that are fitted on top of a model with one effect, and with more."""
WORTH_FITTING = 0.1
"""Least share of a model's misfit that a further effect has to promise; mere errors of a law promise less."""
HELPS = 0.85
"""Largest share of the misfit before it that each effect may leave, in the mean, for further ones to be tried."""
BENDING = 2.0
"""Significance of the misfit that laws leave, in standard deviations, from which deviations from them are fitted."""
RIVAL_ROUNDS = 3
"""Rounds in which causes in no catalogue are fitted: from the paper's model, or from where several effects moved it,
then from where the best single cause moved it, until one is clean."""
RIVALS_SETTLED = 2
"""Best causes in no catalogue, each of another law, whose fit goes on until it has converged."""
MODELS_REFINED = 2
"""Number of best single effects whose laws may deviate, and of best pairs whose laws and effects are exchanged, too; of
larger models, only the best one's are."""
MECHANISMS_WITHOUT_LAW = 2
"""Mechanisms that are fitted as smooth functions where no effect explains the gap."""


def _silent(best: Weighed[Model]) -> None:
    del best


@dataclass(eq=False)
class ForwardSelection:
    """Models with more and more effects.

    Attributes:
        search: fits candidates on top of a model.
        none: the paper's model.
        calibration: what trials say.
        visited: every model that was fitted, the paper's left out.
        so_far: called with the best explanation after each round.
        extended: ids of the models to which every other effect was considered.
        tried_rivals: whether causes in no catalogue were fitted.
    """

    search: Search
    none: Model
    calibration: Calibration
    visited: list[Model] = field(default_factory=list)
    so_far: Callable[[Weighed[Model]], None] = _silent
    extended: set[frozenset[str]] = field(default_factory=set)
    tried_rivals: bool = False

    def run(self) -> list[Model]:
        """Visit models until further effects gain too little; return all of them."""
        self.visited += self.search.singles(self.none)
        self._try_what_a_step_hides(self.none)
        self._bend(best_by_id(self.visited)[:MODELS_REFINED])
        # no further effect is sought beside a single effect that gains less than a further one has to promise
        leaders = [each for each in seeds(self.visited) if self.none.fit.at.cost - each.fit.at.cost > PROMISING]
        self._fit_best_without_law()
        for size in range(2, self.calibration.most_effects + 1):
            self.so_far(leading(weigh(self.none, self.visited, self.calibration)))
            before = len(self.visited)
            for leader in leaders:
                self.add_to(leader)
            if len(self.visited) == before:
                break
            self.fit_again(size - 1)
            refined_count = MODELS_REFINED if size == 2 else 1
            # laws that bent beside fewer effects may be what these compete with
            self._bend(self._ranked(size)[:refined_count])
            best = self._leaders(size)[:refined_count]
            for leader in best:
                self.exchange(leader)
            self._bend(best)
            if size == 2 and self._leaders(size) and self._leading().misfit.significance > CHANCE:
                self._try_rivals()  # before larger combinations, which an unknown cause makes superfluous
            leaders = self.to_extend(size)
            if not leaders:
                break
        self._bend_rivals_of_two_laws()
        self._replace_laws()
        if not self.tried_rivals or (self._leading().clean and not self._rival_explains()):
            self._try_rivals()
        return self.visited

    def _bend(self, models: Sequence[Model]) -> None:
        """Fit each effect of models with a smooth deviation from its law, where more than noise is left."""
        left = [each for each in models if each.misfit.significance > BENDING]
        chosen = [(each, place) for each in left for place in range(len(each.effects))]
        self.visited += self.search.bent(chosen, {frozenset(each.effects) for each in self.visited})

    def _bend_rivals_of_two_laws(self) -> None:
        """Fit one law with a deviation in place of two of its mechanism, which may together imitate another form."""
        best = self._leading()
        for pair in combinations(best.effects, 2):
            if pair[0].mechanism is pair[1].mechanism:
                rest = {each.id for each in best.effects if each not in pair}
                alone = [each for each in self.visited if set(each.ids) in [rest | {own.id} for own in pair]]
                self._bend(best_by_id(alone))

    def _fit_best_without_law(self) -> None:
        """Fit the mechanism of the best effect as a smooth function, where its law leaves a misfit.

        The function competes with effects that take up the errors of the law. Further effects are added to laws alone.
        """
        best = self._best_single()
        if best.effects and not best.clean:
            self._fit_without_law(self.none, best.effects[0].mechanism, best)

    def _fit_without_law(self, on: Model, mechanism: Mechanism, known: Model) -> None:
        """Fit a mechanism as a smooth function on top of a model, unless that model was visited."""
        visited = {frozenset(each.effects) for each in self.visited}
        free = [each for each in self.search.law_free if each.mechanism is mechanism]
        ranked = self.search.screened(on, [each for each in free if frozenset((*on.effects, each)) not in visited])
        self.visited += self.search.fitted(on, ranked, 1, laws=MOST_LAWS_FITTED, known=[known])

    def _try_rivals(self) -> None:
        """Fit causes that the catalogue does not have: those that could be as good as the best explanation.

        A gap moves the parameters of the paper's model far off. The best explanation, or single cause, may have moved
        them back; if no single cause is clean, fits start at the centre of the priors, too.
        """
        self.tried_rivals = True
        best = self._leading()
        rivals = self._rivals_of(best)
        closest = self._best_single()
        start = without_effects(best, self.none) if best.clean and best.effects else self.none
        for _ in range(RIVAL_ROUNDS if rivals else 0):
            self.visited += self.search.fitted_everywhere(start, rivals, known=[closest])
            found = self._best_single()
            if found.clean or (found is closest and start is not self.none):
                break
            start, closest = without_effects(found, self.none), found
        if rivals and not self._best_single().clean:
            self.visited += self.search.fitted_everywhere(self.search.at_centre(self.none), rivals, known=[closest])
        tried = dict[str, Model]()
        for each in sorted(self._fitted_rivals(), key=lambda each: -each.log_evidence):
            tried.setdefault(each.effects[0].law, each)
        self.visited += self.search.parallel_map(settled, list(tried.values())[:RIVALS_SETTLED])

    def _rivals_of(self, best: Model) -> Sequence[Effect]:
        """All, unless there is nothing to explain: no effect leads, and none has more evidence than its absence.

        A flexible law may imitate an unknown cause to the noise; which of them is the simpler one, their evidence says.
        A weak one that does not lead on the lines of the search may lead on all of them.
        """
        silent = not best.effects and best.misfit.significance <= CHANCE and best.clean and best.clean_in_tester
        better = any(each.log_evidence > self.none.log_evidence for each in self.visited)
        return self.search.rivals if better or not silent else ()

    def _best_single(self) -> Model:
        return next(iter(best_by_id([each for each in self.visited if len(each.effects) == 1])), self.none)

    def _replace_laws(self) -> None:
        """Fit mechanisms as smooth functions in place of laws, where the best explanation leaves more than noise.

        Where no effect explains the gap, all mechanisms are screened, each with the closest of its effects.
        """
        verdict = self._verdict()
        best = self.none if verdict.effects in ((), UNKNOWN) else verdict.model
        if not self.search.law_free or best.misfit.significance <= CHANCE:
            return
        for effect, rest in zip(best.effects, self.fit_without_each(best), strict=True):
            self._fit_without_law(rest, effect.mechanism, best)
        if best is self.none:
            ranked = self.search.screened(best, self.search.law_free)
            for mechanism in list(dict.fromkeys(each.effect.mechanism for each in ranked))[:MECHANISMS_WITHOUT_LAW]:
                named = [each for each in self.search.candidates if each.mechanism is mechanism]
                own = [each for each in ranked if each.effect.mechanism is mechanism]
                self.visited += self.search.fitted(best, self.search.screened(best, named), 1, known=self.visited)
                self.visited += self.search.fitted(best, own, 1, laws=MOST_LAWS_FITTED, known=self.visited)

    def _leaders(self, size: int) -> list[Model]:
        """The models of `_ranked`, if the most probable explanation so far has `size` effects, and helps.

        Beside effects that explain almost nothing, others only accumulate: the cause is then in no catalogue.
        """
        top = self._most_probable()
        hopeless = top.misfit.certain > HELPS**size * self.none.misfit.certain or self._rival_explains()
        return [] if len(top.effects) != size or hopeless else self._ranked(size)

    def _rival_explains(self) -> bool:
        """Whether one cause in no catalogue leaves only noise where the best of the catalogue leaves more."""
        best = self._leading()
        return best.misfit.significance > CHANCE and any(
            each.misfit.significance <= CHANCE and each.log_evidence > best.log_evidence + EXCLUDED
            for each in self._fitted_rivals()
        )

    def to_extend(self, size: int) -> list[Model]:
        """Models of `_leaders` to which a further effect is added: the best, and the most probable where it is another.

        Where much is left, tolerances that are moved far off may make a wrong combination the best; it costs
        probability.
        """
        leaders, probable = self._leaders(size), set(self._most_probable().ids)
        return leaders[:1] + [each for each in leaders[1:] if set(each.ids) == probable]

    def _most_probable(self) -> Model:
        return weigh(self.none, self._by_law(), self.calibration)[0].model

    def _ranked(self, size: int) -> list[Model]:
        """The best model of each combination of `size` effects, the best first."""
        own = [each for each in self._by_law() if len(each.effects) == size]
        return [self.within_range(each) for each in best_by_id(own)]

    def _verdict(self) -> Weighed[Model]:
        """The verdict by the catalogue so far."""
        return leading(weigh(self.none, self._of_catalogue(), self.calibration))

    def _leading(self) -> Model:
        return self._verdict().model

    def _by_law(self) -> list[Model]:
        return [each for each in self._of_catalogue() if not any(effect.law_free for effect in each.effects)]

    def _of_catalogue(self) -> list[Model]:
        return [each for each in self.visited if LOCAL_CHANGE not in each.ids]

    def _fitted_rivals(self) -> list[Model]:
        return [each for each in self.visited if LOCAL_CHANGE in each.ids]

    def within_range(self, model: Model) -> Model:
        """A model; where it needs a size far beyond its range, the best with the same effects that does not.

        A law far outside its range takes up the response to an effect that is not in the model yet, and would hide it.
        """
        if implausibility(model) < EXCLUDED:
            return model
        alike = [each for each in self.visited if set(each.ids) == set(model.ids) and implausibility(each) < EXCLUDED]
        return max(alike, key=lambda each: each.log_evidence, default=model)

    def add_to(self, model: Model) -> None:
        """Fit every other effect on top of a model, except combinations that were visited."""
        self.extended.add(frozenset(model.ids))
        known = {frozenset(each.ids) for each in self.visited}
        others = [
            each
            for each in self.search.candidates
            if each.id not in model.ids and frozenset((*model.ids, each.id)) not in known
        ]
        ranked = self.search.screened(model, others, WORTH_FITTING)
        clean = model.clean or any(each.clean for each in self.visited if len(each.effects) == len(model.effects) + 1)
        most = FITTED_ON_ONE if len(model.effects) == 1 else FITTED_ON_MORE
        count = FITTED_AFTER_CLEAN if clean else most
        self.visited += self.search.fitted(model, ranked, count, laws=1, known=self.visited)
        self._try_what_a_step_hides(model)

    def _try_what_a_step_hides(self, model: Model) -> None:
        """Fit effects whose gain one step underestimates, on a model that leaves so little that they might show."""
        known = {frozenset(each.effects) for each in self.visited}
        others = [each for each in self.search.candidates if not each.seen_in_one_step and each.id not in model.ids]
        hidden = [each for each in others if frozenset((*model.effects, each)) not in known]
        if model.clean and hidden:
            self.visited += self.search.fitted_anyway(model, hidden, known=self.visited)

    def exchange(self, model: Model) -> None:
        """Fit each effect of a model under its other laws, and other effects in its place.

        This is done even where the model leaves no misfit: another effect may still be more probable.
        """
        for effect, rest in zip(model.effects, self.fit_without_each(model), strict=True):
            laws = [each for each in self.search.candidates if each.id == effect.id and each.law != effect.law]
            ranked = self.search.screened(rest, laws)
            self.visited += self.search.fitted(rest, ranked, 1, laws=MOST_LAWS_FITTED, known=[model])
            if frozenset(rest.ids) not in self.extended:
                self.add_to(rest)

    def fit_without_each(self, model: Model) -> list[Model]:
        """Fit a model without each of its effects in turn, where that was not visited.

        Returns:
            For each effect, the best model without it.
        """
        known = self._best_by_effects()
        rests = self._rests(model)
        new = self.search.fitted_from(
            [each for each in rests if frozenset(each[0].effects) not in known], CLOSE, SETTLING_STEPS
        )
        self.visited += new
        known |= {frozenset(each.effects): each for each in new}
        return [known[frozenset(rest.effects)] for rest, _ in rests]

    def fit_again(self, size: int) -> None:
        """Fit models with `size` effects again that ended in a poor minimum.

        This shows where the parameters of a larger model, without its further effect, have a lower cost. From a poor
        minimum, any further effect would seem to explain much.
        """
        known = self._best_by_effects()
        poorer = dict[frozenset[Effect], tuple[float, tuple[Simulation, Real]]]()
        for larger in (each for each in self.visited if len(each.effects) == size + 1):
            for rest, start in self._rests(larger):
                own = frozenset(rest.effects)
                if own in known:
                    least = poorer[own][0] if own in poorer else known[own].fit.at.cost
                    cost = cost_at(rest, start) if larger.fit.at.cost < least else np.inf
                    if cost < least:
                        poorer[own] = cost, (rest, start)
        self.visited += self.search.fitted_from([start for _, start in poorer.values()], (FINAL,), SETTLING_STEPS)

    def _rests(self, model: Model) -> list[tuple[Simulation, Real]]:
        """For each effect of a model, the simulation without it, and the parameters that the model has for the rest."""
        return [
            (
                self.search.simulation(model.effects[:place] + model.effects[place + 1 :]),
                np.delete(model.fit.scores, model.places(place)),
            )
            for place in range(len(model.effects))
        ]

    def _best_by_effects(self) -> dict[frozenset[Effect], Model]:
        """The best of the visited models, and of the paper's, with each combination of laws."""
        from_worst = sorted((self.none, *self.visited), key=lambda each: each.log_evidence)
        return {frozenset(each.effects): each for each in from_worst}


def selected(
    search: Search, none: Model, calibration: Calibration, so_far: Callable[[Weighed[Model]], None] = _silent
) -> list[Model]:
    """Every model that forward selection visits.

    Args:
        search: of one measurement.
        none: the paper's model, fitted.
        calibration: what trials say.
        so_far: called with the best explanation after each round: a first answer.
    """
    return ForwardSelection(search, none, calibration, so_far=so_far).run()
