"""Detectability d of an effect: its size in standard deviations, without the part that the baseline can imitate.

The bench's own noiseless readings with the effect are fitted by the paper's model, which may change cylinders, gains,
positions and materials within their tolerances. d is the root of the difference in chi-square between this fit and that
to the same bench without the effect. Below a d of about five, no method could find the effect.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from analysis.frequency_response import Complex
from analysis.gap.catalogue import laws
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import Model, refined
from analysis.gap.measurement import Measurement
from analysis.gap.search.single_effects import Search, search_of
from analysis.gap.simulation.scales import typical_scales
from simlab.case.campaign import ROWS, Row
from simlab.case.draw import Case
from simlab.case.simulate import Simulated, simulate

LARGEST_EXACT_D = 50.0
"""Value of d above which its exact value does not matter."""
FITTED = 3
"""Number of variants of an effect's laws that are fitted in full."""


@dataclass(frozen=True, eq=False)
class Detectability:
    """How far a case's effects stand out in one measurement of it.

    Attributes:
        case: with its truth.
        measurement: as it was diagnosed; only its noise counts.
    """

    case: Case
    measurement: Measurement

    def of(self, effect: str) -> float:
        """The d of one of the case's effects, as if it were the only one."""
        return self._beyond(self._fitted((effect,), ()))

    def beside(self, named: Sequence[str]) -> float:
        """The d that remains of all effects of the case when `named` ones are in the model, each by its best law."""
        return self._beyond(self._fitted(tuple(effect.name for effect in self.case.effects), named))

    @cached_property
    def _bare(self) -> float:
        """Chi-square with priors of the bench without effects."""
        return self._fitted((), ())

    def _beyond(self, cost: float) -> float:
        return float(np.sqrt(max(cost - (self._bare if cost < LARGEST_EXACT_D**2 else 0.0), 0.0)))

    def _fitted(self, effects: tuple[str, ...], named: Sequence[str]) -> float:
        """Chi-square with priors of the bench with some of its effects, fitted by the baseline with `named` effects.

        If a fit to some of the lines gives more than `LARGEST_EXACT_D`, it is not repeated on all lines but evaluated
        there.
        """
        own = tuple(effect for effect in self.case.effects if effect.name in effects)
        noiseless = _noiseless(simulate(replace(self.case, effects=own).repeatable()), self.measurement)
        candidates = tuple(law for kind in laws() if kind.id in named for law in kind.variants(noiseless))
        search = search_of(noiseless, candidates)
        model = search.fit_paper_model()
        for effect in named:
            model = _extended(search, model, effect)
        if model.fit.at.cost < LARGEST_EXACT_D**2:
            # costs compare only under the same scales of the nuisances
            return refined(model, noiseless, typical_scales(noiseless.tolerances)).fit.at.cost
        whole = model.fit.likelihood.simulation.of(noiseless)
        return Likelihood(whole).at(model.fit.scores).cost


def _extended(search: Search, model: Model, effect: str) -> Model:
    """A model with one more effect, by its best law; the model itself where no law promises a gain."""
    own = [candidate for candidate in search.candidates if candidate.id == effect]
    found = search.fitted(model, search.screened(model, own), FITTED)
    return min([model, *found], key=lambda each: each.fit.at.cost)


def _noiseless(simulated: Simulated, measurement: Measurement) -> Measurement:
    """A measurement with the readings of a case without noise."""
    sets = []
    for number, each in enumerate(measurement.sets):
        rows = [ROWS.index(Row(dof.node, dof.direction.value)) for dof in each.inputs]
        lines = np.searchsorted(simulated.frequency, each.frequency - 1e-6)
        accelerance: Complex = simulated.accelerance[number][rows][:, lines]
        sets.append(replace(each, accelerance=accelerance))
    points = measurement.points
    if points is not None:
        place = np.argsort(np.argsort(points.order))
        points = replace(points, stiffness=simulated.stiffness[place])
    return replace(measurement, sets=tuple(sets), points=points)
