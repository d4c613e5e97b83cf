"""An effect that was found on one article in the simulation of another: does it lower the gap there, too?

The priors of its parameters are their estimates from the first article. Nothing is searched: the paper's model is
fitted without the effect and with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from analysis.errors import AnalysisError
from analysis.gap.catalogue import shows
from analysis.gap.effect import Effect
from analysis.gap.evidence.calibration import UNCALIBRATED, Calibration
from analysis.gap.faults.removal import examine
from analysis.gap.findings.gaps import COARSE_LINES, floor_percent, shrinks
from analysis.gap.findings.model_values import EffectValues, ModelValues, effect_of, values_of
from analysis.gap.fitting.fit import fit
from analysis.gap.fitting.held_out import HeldOut, held_out
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import ENOUGH, Model, refined
from analysis.gap.fitting.stages import CLOSE, FROM_AFAR
from analysis.gap.measurement import Measurement
from analysis.gap.parameter import Parameter, ParameterEstimate
from analysis.gap.search.screening import inserted
from analysis.gap.search.single_effects import ParallelMap, search_of, serial_map
from analysis.gap.simulation.scales import Scales
from analysis.interval import Z90


@dataclass(frozen=True, eq=False)
class Carried:
    """The result of effects of another article in this simulation.

    Attributes:
        before, after: gaps on held-out data, without them and with them.
        floor_percent: difference to expect when the measurement is repeated.
        lowers: whether they lower the gap of a rig on which they act, and raise none.
        apart: for each effect, by parameter, distance of the estimate from the prior, in standard deviations of it.
        model: the simulation with them, by its values.
        nuisances: their scales.
        faults: of the measurement, a sentence each.
    """

    before: HeldOut
    after: HeldOut
    floor_percent: float
    lowers: bool
    apart: tuple[Mapping[str, float], ...]
    model: ModelValues
    nuisances: Scales
    faults: tuple[str, ...]


def carry(
    measurement: Measurement,
    effects: Sequence[EffectValues],
    parallel_map: ParallelMap = serial_map,
    calibration: Calibration = UNCALIBRATED,
) -> Carried:
    """Put effects of another article in the simulation of this one.

    Raises:
        AnalysisError: there is no effect, it cannot act here, or the measurement cannot be simulated.
    """
    if not effects:
        raise AnalysisError("the other article's simulation has no effect that could be carried")
    sound = examine(measurement)
    measurement = sound.measurement
    chosen = tuple(with_priors(_applicable(each, measurement), each.parameters) for each in effects)
    search = search_of(measurement, ())
    none = search.fit_paper_model()
    place = len(none.fit.likelihood.simulation.shared)
    start = inserted(none.fit.scores, place, np.zeros(sum(len(each.parameters) for each in chosen)))
    simulation = search.simulation(chosen)
    # the paper's model may have shifted far to imitate the effect, so a fit may also begin at the centre of the priors
    begun = [fit(simulation, start, CLOSE, ENOUGH)]
    if not Model(chosen, begun[0]).clean:
        begun.append(fit(simulation, np.zeros(Likelihood(simulation).unknowns), FROM_AFAR, ENOUGH))
    best = Model(chosen, min(begun, key=lambda each: each.at.cost))
    fine = measurement.thinned(COARSE_LINES)
    models = [refined(each, fine, none.fit.likelihood.scales) for each in (none, best)]
    none, with_them = models
    before, after = parallel_map(held_out, [each.fit for each in models])
    scores = with_them.fit.scores
    return Carried(
        before=before,
        after=after,
        floor_percent=floor_percent(with_them.fit),
        lowers=shrinks(with_them, before, after),
        apart=tuple(
            {each.name: float(scores[at]) for each, at in zip(effect.parameters, with_them.places(n), strict=True)}
            for n, effect in enumerate(chosen)
        ),
        model=values_of(with_them, calibration),
        nuisances=with_them.fit.likelihood.scales,
        faults=sound.faults,
    )


def _applicable(values: EffectValues, measurement: Measurement) -> Effect:
    """The effect of the catalogue that values describe; AnalysisError where it cannot act in a measurement."""
    effect = effect_of(values, measurement)
    if not shows(effect, measurement):
        raise AnalysisError(f"{values.id} ({values.law}) acts on a rig that this article was not measured in")
    own, given = {each.name for each in effect.parameters}, set(values.parameters)
    if own != given:
        raise AnalysisError(
            f"{values.id} ({values.law}) does not fit this article, whose joints or points differ: "
            f"it needs {', '.join(sorted(own))}; the other article has {', '.join(sorted(given))}"
        )
    return effect


def with_priors(effect: Effect, known: Mapping[str, ParameterEstimate]) -> Effect:
    """An effect whose parameters have estimates as their priors.

    Raises:
        AnalysisError: an interval is empty, or contains values that are impossible.
    """
    priors = tuple(_prior(effect, each, known[each.name]) for each in effect.parameters)
    law, own = type(effect), {each.name: getattr(effect, each.name) for each in fields(effect)}
    changed: dict[str, Any] = {
        "parameters": property(lambda _: priors),
        "__reduce__": lambda _: (with_priors, (effect, known)),  # pickle cannot find such a class by name
    }
    made: Effect = type(law.__name__, (law,), changed)(**own)
    return made


def _prior(effect: Effect, parameter: Parameter, known: ParameterEstimate) -> Parameter:
    low, high = known.ci90
    if not low < high or (parameter.positive and low <= 0):
        bound = " and be above zero" if parameter.positive else ""
        raise AnalysisError(
            f"{effect.id}: the interval of {parameter.name} is {low:g} to {high:g}; its lower end has to be below the "
            f"upper one{bound}"
        )
    reach = np.log(high / low) if parameter.positive else high - low
    return replace(parameter, centre=known.value, spread=float(reach) / (2 * Z90), starts=(0.0,))
