"""The search for effects: first the paper's model, then every effect of the catalogue on top of it, one at a time.

Further effects: `forward_selection`.

Screening takes one step of a linearised fit for every variant of every law, with noise inflated so that no sharp peak
decides. The best are fitted in full, from several starts where a law has them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Protocol, TypeVar

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.effect import Effect, acts_on
from analysis.gap.fitting.fit import EARLY_GAIN, Fit, evaluated, fit, likelihoods
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import ENOUGH, Model, best_by_id, refined
from analysis.gap.fitting.scale_estimate import with_likely_scales
from analysis.gap.fitting.stages import CLOSE, CLOSER, FINAL, FROM_AFAR, FROM_TESTER, NEAR, Stage
from analysis.gap.measurement import Indices, Measurement
from analysis.gap.search.screening import (
    FAR,
    PLAUSIBLE,
    ExpectedGain,
    LinearStep,
    best_laws,
    by_gain,
    gain_by_linear_step,
    gain_by_tester_fit,
    inserted,
    plausible,
    starts,
)
from analysis.gap.simulation.baseline import Baseline, baseline_of
from analysis.gap.simulation.free_beam_modes import BeamModes, beam_modes_of
from analysis.gap.simulation.scales import narrower
from analysis.gap.simulation.two_rigs import Simulation

Item = TypeVar("Item")
Result = TypeVar("Result")
LINES = 128
"""Number of lines of each hammer set that the search uses; its best models are fitted to all lines."""
PROMISING = 12.0
"""Gain in chi-square below which a further effect cannot pay for its parameters."""
CONTRADICTION = 20.0
"""Chi-square per datum of the paper's model above which the two rigs contradict each other."""
FITTED_SINGLES = 7
"""Number of single effects that are fitted: those that promise most."""
TRIED_ANYWAY = 2
"""Effects that are fitted whatever they promise: nothing is said of effects that were not tried."""
FITTED_AFTER_CLEAN = 3
"""Effects that are still fitted, single or second, once a model is clean."""
BATCH_SIZE = 2
"""Effects that are fitted in one batch."""
MOST_LAWS_FITTED = 4
"""Rival laws of one effect that are fitted: those with the highest expected gain."""
FITTED_BY_TESTER = 3
"""Number of effects that are fitted because they alone explain the tester."""
FITTED_SEEDS = 2
"""Best single effects to which second effects are added, where they gain enough."""
STARTS_EVERYWHERE = 3
"""Starts of each place or setting of a cause in no catalogue that are fitted."""
CLOSEST_OF_A_LAW = 3
"""Fits of one law, from other starts or at other places, that go on after the first stages."""
MOST_STEPS = 10
"""Steps of one fit while candidates are compared."""
LEAST_GAIN = 0.01
"""Share of a candidate's misfit that its steps have to gain; the steps of a wrong candidate become tiny."""
SETTLING_STEPS = 30
"""Steps of the fit that lets a model converge before other effects are added to it."""
SETTLED_LAWS = 2
"""Laws of an effect that are left to converge so."""
HOPELESS_COST = 1000.0
"""Largest cost (chi-square with priors) above that of a clean model at which a fit goes on."""
HOPELESS_RATIO = 3.0
"""Ratio of cost to that of the best so far, or to that of noise, beyond which a model does not matter."""


class ParallelMap(Protocol):
    """Does the same work on each of several items, and gives the results in their order.

    Work and items can be pickled, so that an implementation may use processes.
    """

    def __call__(self, work: Callable[[Item], Result], items: Sequence[Item], /) -> Iterable[Result]:
        """The results."""


def serial_map(work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Do the work in this process, one item after the other."""
    return [work(each) for each in items]


Hopeless = Mapping[Stage, float]
"""Cost at the end of a stage, by stage, above which the fit of a model is given up."""


@dataclass(eq=False)
class Search:
    """A search over models of one measurement.

    Attributes:
        measurement: with the lines that the search uses.
        candidates: variants of laws that are tried.
        modes: of the drawing.
        parallel_map: runs independent work, in parallel if it can.
        law_free: smooth functions in place of a law, for each mechanism.
        rivals: changes that are in no catalogue, and compete with its effects.
    """

    measurement: Measurement
    candidates: tuple[Effect, ...]
    modes: BeamModes
    parallel_map: ParallelMap = serial_map
    law_free: tuple[Effect, ...] = ()
    rivals: tuple[Effect, ...] = ()
    baseline: Baseline = field(init=False)

    def __post_init__(self) -> None:
        self.baseline = baseline_of(self.measurement)

    def simulation(self, effects: Sequence[Effect] = ()) -> Simulation:
        """The simulation of the baseline with some effects."""
        return Simulation(self.baseline, self.modes, tuple(effects))

    def fit_paper_model(self) -> Model:
        """Fit the paper's model from the centre of the priors; the search takes over its scales."""
        simulation = self.simulation()
        found = Model((), with_likely_scales(fit(simulation, np.zeros(Likelihood(simulation).unknowns))))
        scales = narrower(found.fit.likelihood.scales, self.baseline.scales)  # a gap is no reason for wide scales
        self.baseline = replace(self.baseline, scales=scales)
        return refined(found, self.measurement, scales)

    def singles(self, none: Model) -> list[Model]:
        """The most promising effects, fitted, the best first.

        Where no model is clean, a linear step may have promised too little: the search also starts from fits to the
        tester alone. Where the rigs contradict each other, the paper's model lies between them and near neither; the
        search then also starts from a fit to the beam alone.
        """
        found, start = (
            self.fitted(none, self.screened(none, self.candidates, always=TRIED_ANYWAY), FITTED_SINGLES),
            none,
        )
        both = bool(self.measurement.sets) and self.measurement.points is not None
        if both and none.fit.per_datum > CONTRADICTION and not any(model.clean for model in found):
            start = self.beam_alone(none)
            others = [each for each in self.candidates if not acts_on(each, "cylinders")]
            found += self.fitted(start, self.screened(start, others), FITTED_SINGLES, known=found)
        if both and not any(model.clean for model in (none, *found)):
            found += self.fitted(start, self.shown_by_tester(self.candidates), FITTED_BY_TESTER, known=found)
        best = [law for seed in seeds(found) for law in _laws_of(seed, found)]
        rest = [model for model in found if not any(model is each for each in best)]
        return sorted([*rest, *self.parallel_map(settled, best)], key=lambda model: -model.log_evidence)

    def beam_alone(self, none: Model) -> Model:
        """The paper's model fitted to the beam, with hardly any weight on the tester; evaluated on all data."""
        points = self.measurement.points
        assert points is not None
        weak = replace(points, deviation=points.deviation + np.abs(points.stiffness))
        alone = self.simulation().of(replace(self.measurement, points=weak))
        found = fit(alone, np.zeros(none.fit.scores.size), FROM_AFAR, ENOUGH)
        return Model((), evaluated(none.fit.likelihood, found.scores))

    def at_centre(self, none: Model) -> Model:
        """The paper's model with all parameters at the centres of their priors; evaluated on all data."""
        return Model((), evaluated(none.fit.likelihood, np.zeros(none.fit.scores.size)))

    def screened(
        self, on: Model, candidates: Sequence[Effect], share: float = 0.0, always: int = 0
    ) -> list[ExpectedGain]:
        """Candidates that promise a gain on top of a model, the best first.

        Args:
            on: the model.
            candidates: on top of it.
            share: of its misfit, that a candidate is to promise at least.
            always: number of effects, the best, that are returned even if they promise too little.
        """
        every, excess = self._expected_gains(on, candidates)
        best = list(dict.fromkeys(each.effect.id for each in every))[:always]
        return by_gain(every, max(PROMISING, share * excess)) or [each for each in every if each.effect.id in best]

    def _expected_gains(self, on: Model, candidates: Sequence[Effect]) -> tuple[list[ExpectedGain], float]:
        """Promises of candidates by one step, the best first, and the chi-square of the model beyond its data."""
        likelihood = plausible(on.fit)
        step = LinearStep.about(likelihood, on.fit.scores)
        extended = [self.simulation((*on.effects, candidate)) for candidate in candidates]
        tried = self.parallel_map(partial(gain_by_linear_step, likelihood, step), extended)
        return by_gain([each for each in tried if each is not None], -np.inf), step.cost - likelihood.data

    def shown_by_tester(self, candidates: Sequence[Effect]) -> list[ExpectedGain]:
        """Candidates of which each alone explains the tester, the best first."""
        seen = [each for each in candidates if acts_on(each, "cylinders") or acts_on(each, "tester")]
        return by_gain(
            list(self.parallel_map(gain_by_tester_fit, [self.simulation((each,)) for each in seen])), PROMISING
        )

    def fitted(
        self,
        on: Model,
        ranked: Sequence[ExpectedGain],
        count: int,
        laws: int = MOST_LAWS_FITTED,
        known: Sequence[Model] = (),
    ) -> list[Model]:
        """The effects of a ranking fitted on top of a model, `count` of them, each under its most promising laws.

        The fit of those that fall far behind the best, or behind `known` models, is given up.
        """
        found, remaining = list[Model](), list(dict.fromkeys(each.effect.id for each in ranked))[:count]
        while remaining:
            names, remaining = remaining[:BATCH_SIZE], remaining[BATCH_SIZE:]
            own = [best_laws([each for each in ranked if each.effect.id == name], laws) for name in names]
            expected = [each for gains in own for each in gains]
            models = self._fitted(on, expected, laws, _hopeless((on, *known, *found)), _close_to(on))
            found += models
            if any(model.clean for model in models):
                remaining = remaining[:FITTED_AFTER_CLEAN]
        return sorted(found, key=lambda model: -model.log_evidence)

    def fitted_everywhere(self, on: Model, candidates: Sequence[Effect], known: Sequence[Model]) -> list[Model]:
        """Each law of some candidates, fitted on top of a model from all its variants, such as places on the beam.

        Of each law, two variants are fitted to the end, and the better one counts. The first fits best under inflated
        noise: a linear step from a model that does not hold says little about the place. The second has the largest
        gain by a linear step: inflated noise may hide the place. A resonance is sought from several frequencies, as a
        step from far off says as little of them.
        """
        ranked, hopeless = self.screened(on, candidates), _hopeless((on, *known))
        of_each_law = {each.effect.law: each for each in reversed(ranked)}  # the one of most gain
        best_by_step = list(of_each_law.values())
        # other fits keep their schedule: what less noise does to them was not measured
        schedule = CLOSER if plausible(on.fit).inflation == CLOSER[1].inflation else _close_to(on)
        found = self._fitted(on, ranked, STARTS_EVERYWHERE, hopeless, schedule)
        found += self._fitted(on, best_by_step, 1, hopeless, schedule)
        best = dict[str, Model]()
        for model in sorted(found, key=lambda model: -model.log_evidence):
            best.setdefault(model.effects[-1].law, model)
        return list(best.values())

    def fitted_anyway(self, on: Model, candidates: Sequence[Effect], known: Sequence[Model]) -> list[Model]:
        """Candidates fitted on top of a model, each under its most promising laws, however little they promise."""
        every, _ = self._expected_gains(on, candidates)
        return self.fitted(on, every, len(every), known=known)

    def bent(self, chosen: Sequence[tuple[Model, int]], visited: Collection[frozenset[Effect]]) -> list[Model]:
        """Models in which one effect, by index, may deviate from its law, fitted from the law.

        Of several starts of a deviation the best counts. Effects without one, and models that were `visited`, are left
        out.
        """
        tried, found = set(visited), list[Model]()
        for model, place in chosen:
            bent, own = model.effects[place].bent(self.measurement), model.places(place)
            if bent is None:
                continue
            effects = tuple(bent if number == place else each for number, each in enumerate(model.effects))
            if frozenset(effects) not in tried:
                tried.add(frozenset(effects))
                begun = [inserted(model.fit.scores, own.stop, start) for start in starts(bent, len(own))]
                simulation = self.simulation(effects)
                # a law that leaves much is far from the deviating one: inflated noise leads there
                schedule = CLOSE if model.fit.per_datum > PLAUSIBLE else (FINAL,)
                fits = self.fitted_from([(simulation, start) for start in begun], schedule, MOST_STEPS)
                found.append(max(fits, key=lambda each: each.log_evidence))
        return found

    def fitted_from(
        self, starts: Sequence[tuple[Simulation, Real]], schedule: tuple[Stage, ...], most_steps: int
    ) -> list[Model]:
        """The models of some simulations, each fitted from its own start."""
        fits = self.parallel_map(partial(_fitted_from, schedule=schedule, most_steps=most_steps), starts)
        return [Model(simulation.effects, found) for (simulation, _), found in zip(starts, fits, strict=True)]

    def _fitted(
        self,
        on: Model,
        expected: Sequence[ExpectedGain],
        tries: int,
        hopeless: Hopeless,
        schedule: tuple[Stage, ...],
    ) -> list[Model]:
        """Each law fitted from its best starts, and from the model itself where these end above the model's cost.

        Every start is fitted with inflated noise; of each law, only the best of these is fitted to the end.
        """
        tasks = [task for each in expected for task in self._tasks(on, each, tries, hopeless, schedule)]
        ended = self._to_the_end(tasks)
        shared = len(on.fit.likelihood.simulation.shared)
        astray = [
            replace(task, start=inserted(on.fit.scores, shared, task.expected.starts[0]), schedule=schedule)
            for task, found in ended
            if found.at.cost > on.fit.at.cost
        ]
        best = dict[Effect, Fit]()
        for task, found in (*ended, *self._to_the_end(astray)):
            before = best.get(task.expected.effect)
            if before is None or found.at.cost < before.at.cost:
                best[task.expected.effect] = found
        return [Model((*on.effects, effect), found) for effect, found in best.items()]

    def _to_the_end(self, tasks: Sequence[_Task]) -> list[tuple[_Task, Fit]]:
        """The best task of each law, with its fit: the further stages are fitted to fewer and fewer of a law."""
        begun = list(zip(tasks, self.parallel_map(_first_stages, tasks), strict=True))
        for stage, kept in ((-2, CLOSEST_OF_A_LAW), (-1, 1)):
            left = _best_of_each_law(begun, kept)
            fits = self.parallel_map(partial(_next_stage, stage=stage), left)
            begun = [(task, found) for (task, _), found in zip(left, fits, strict=True)]
        return begun

    def _tasks(
        self, on: Model, expected: ExpectedGain, tries: int, hopeless: Hopeless, schedule: tuple[Stage, ...]
    ) -> list[_Task]:
        simulation, shared = self.simulation((*on.effects, expected.effect)), len(on.fit.likelihood.simulation.shared)
        imitated = expected.effect.imitated_by
        elastic = acts_on(expected.effect, "cylinders")
        by_tester = elastic and self.measurement.points is not None and not on.clean
        schedule = FROM_TESTER if by_tester else schedule
        # a model that does not hold has unknowns that are impossible: limit them before they become a start
        known = on.fit.scores if on.clean else np.clip(on.fit.scores, -FAR, FAR)
        starts = [inserted(known, shared, start) for start in expected.starts[: 1 if elastic else tries]]
        imitators = [place for place, each in enumerate(on.fit.likelihood.simulation.shared) if each.kind in imitated]
        starts += [_centred(each, imitators) for each in starts if imitators]
        return [_Task(expected, simulation, start, schedule, hopeless) for start in starts]


def _centred(scores: Real, places: Sequence[int]) -> Real:
    """(unknowns,) scores with some of them at the centre of their priors."""
    found = scores.copy()
    found[list(places)] = 0.0
    return found


def _close_to(on: Model) -> tuple[Stage, ...]:
    """The schedule of a fit that starts from a model."""
    return NEAR if on.fit.at.cost < PLAUSIBLE * on.fit.likelihood.data else CLOSE


@dataclass(frozen=True, eq=False)
class _Task:
    """A fit to do."""

    expected: ExpectedGain
    simulation: Simulation
    start: Real
    schedule: tuple[Stage, ...]
    hopeless: Hopeless


def _first_stages(task: _Task) -> Fit:
    """Fit all stages but the last two; a fit that was given up has the cost of the whole likelihood."""
    return fit(task.simulation, task.start, task.schedule[:-2], EARLY_GAIN, MOST_STEPS, task.hopeless, LEAST_GAIN)


def _next_stage(begun: tuple[_Task, Fit], stage: int) -> Fit:
    """Fit one of the last two stages, -2 or -1, unless the fit was given up."""
    task, found = begun
    if found.given_up:
        return found
    tolerance = ENOUGH if stage == -1 else EARLY_GAIN
    schedule = (task.schedule[stage],)
    return fit(task.simulation, found.scores, schedule, tolerance, MOST_STEPS, task.hopeless, LEAST_GAIN)


def _fitted_from(start: tuple[Simulation, Real], schedule: tuple[Stage, ...], most_steps: int) -> Fit:
    return fit(*start, schedule, ENOUGH, most_steps)


def _best_of_each_law(begun: Sequence[tuple[_Task, Fit]], kept: int) -> list[tuple[_Task, Fit]]:
    """The `kept` closest fits of each law, the closest first; fits to a size that is impossible come last."""
    found = dict[tuple[str, str], list[tuple[_Task, Fit]]]()
    for each in sorted(begun, key=lambda each: (_is_impossible(each[1]), each[1].at.cost)):
        found.setdefault((each[0].expected.effect.id, each[0].expected.effect.law), []).append(each)
    return [each for of_law in found.values() for each in of_law[:kept]]


def _is_impossible(found: Fit) -> bool:
    parameters = found.likelihood.parameters
    return any(each.value(float(score)) < each.least for each, score in zip(parameters, found.scores, strict=False))


def settled(model: Model) -> Model:
    """A model whose fit has converged, as other effects are added to it.

    Very precise data make long and bent valleys, at the far side of which a law looks wrong.
    """
    if model.fit.converged:
        return model
    simulation = model.fit.likelihood.simulation
    again = fit(simulation, model.fit.scores, (FINAL,), ENOUGH, SETTLING_STEPS, along_valleys=True)
    return Model(model.effects, again)


def _laws_of(seed: Model, found: Sequence[Model]) -> list[Model]:
    """The best models with the effects of a seed, by evidence, of `SETTLED_LAWS` different laws."""
    alike = sorted((each for each in found if each.ids == seed.ids), key=lambda each: -each.log_evidence)
    best = dict[tuple[Effect, ...], Model]()
    for model in alike:
        best.setdefault(model.effects, model)
    return list(best.values())[:SETTLED_LAWS]


def seeds(singles: Sequence[Model]) -> list[Model]:
    """The best singles, to which second effects are added; where the best is clean, that one alone."""
    best = best_by_id(singles)[:FITTED_SEEDS]
    return best[:1] if best and best[0].clean else best


def _hopeless(found: Sequence[Model]) -> Hopeless:
    """Cost, by stage, above which a model does not matter any more.

    The best model is evaluated with the noise of each stage: the distance to it only grows in later stages.
    """
    best = min(found, key=lambda model: model.fit.at.cost)
    stages, scores = (*NEAR, *CLOSER, *CLOSE, *FROM_TESTER), best.fit.scores

    def bound(seen: Likelihood) -> float:
        cost = seen.at(scores).cost
        return cost + HOPELESS_COST if best.clean else HOPELESS_RATIO * max(cost, seen.data)

    seen = likelihoods(best.fit.likelihood.simulation, stages, scores)
    return {stage: bound(each) for stage, each in zip(stages, seen, strict=True)}


def search_of(
    measurement: Measurement,
    candidates: tuple[Effect, ...],
    lines: int = LINES,
    parallel_map: ParallelMap = serial_map,
    law_free: tuple[Effect, ...] = (),
    rivals: tuple[Effect, ...] = (),
) -> Search:
    """A search that uses some `lines` of each hammer set."""
    chosen = informative(measurement, lines) if measurement.sets else np.zeros(0, dtype=np.intp)
    sets = tuple(each.lines(chosen) for each in measurement.sets)
    modes = beam_modes_of(measurement.drawing)
    return Search(replace(measurement, sets=sets), candidates, modes, parallel_map, law_free, rivals)


def informative(measurement: Measurement, wanted: int) -> Indices:
    """Indices of about `wanted` lines: half of them evenly spread, half where accelerances change most."""
    reference = measurement.sets[0]
    count = reference.frequency.size
    if count <= wanted:
        return np.arange(count)
    size = np.abs(reference.accelerance)
    change = np.sum(
        np.abs(np.gradient(reference.accelerance, axis=1)) / (size + np.median(size, axis=1)[:, None]), axis=0
    )
    smooth = np.convolve(change, np.ones(9) / 9, mode="same")
    density = np.cumsum(0.5 / count + 0.5 * smooth / np.sum(smooth))
    return np.unique(np.searchsorted(density, (np.arange(wanted) + 0.5) / wanted * density[-1]))
