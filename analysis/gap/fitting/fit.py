"""The most likely parameters of one model, found in several stages."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.evidence.fitted import Fitted
from analysis.gap.fitting.likelihood import LastState, Likelihood
from analysis.gap.fitting.model_error import Row
from analysis.gap.fitting.normal_equations import NormalBlock, beyond, by_point, joint
from analysis.gap.fitting.stages import FINAL, FROM_AFAR, Stage, with_lines
from analysis.gap.measurement import Measurement
from analysis.gap.simulation.simulation_state import Prediction
from analysis.gap.simulation.two_rigs import Simulation
from analysis.inverse.levenberg_marquardt import Minimum, minimise

EARLY_GAIN = 30.0
"""Gain in chi-square (over chi-square per datum) at which all stages but the last end."""


@dataclass(frozen=True, eq=False)
class Fit(Fitted[Likelihood]):
    """The most likely parameters of one model of the beam rig and the tester.

    Attributes:
        given_up: whether the fit ended early, as its model does not matter.
    """

    given_up: bool = False

    @cached_property
    def readings(self) -> Prediction:
        """Readings of both rigs, without derivatives."""
        return self.likelihood.predict(self.scores, ())

    @cached_property
    def blocks(self) -> tuple[NormalBlock, ...]:
        """The normal equations of each row and of the tester."""
        return self.likelihood.blocks(self.scores)

    def left_out(self, rows: Collection[Row]) -> tuple[NormalBlock, ...]:
        """The information of some rows, given all other rows: one block for each of their points, to be subtracted."""
        found = list[NormalBlock]()
        for blocks, whole in self._points:
            others = [each for each in blocks if (each.set_number, each.row) not in rows]
            if len(others) < len(blocks):
                found.append(beyond(whole, joint(others)) if others else whole)
        return tuple(found)

    @cached_property
    def _points(self) -> list[tuple[list[NormalBlock], NormalBlock]]:
        return [(blocks, joint(blocks)) for blocks in by_point(self.blocks)]


def evaluated(likelihood: Likelihood, scores: Real) -> Fit:
    """A likelihood evaluated at `scores`, which need not be its maximum."""
    return Fit(likelihood, scores, likelihood.at(scores).linearised(), converged=False)


def as_unknowns(scores: Real, likelihood: Likelihood) -> Real:
    """(unknowns,) scores of a likelihood, from more or fewer of them: missing amplitude errors are zero."""
    rest = likelihood.unknowns - scores.size
    return np.concatenate([scores, np.zeros(rest)]) if rest > 0 else scores[: likelihood.unknowns]


def cost_at(simulation: Simulation, scores: Real) -> float:
    """Chi-square with the priors at `scores` (unknowns,); amplitude errors that a simulation lacks are left out."""
    likelihood = Likelihood(simulation)
    return likelihood.at(as_unknowns(scores, likelihood)).cost


def in_other_set_up(found: Fit, measurement: Measurement) -> tuple[Likelihood, Real]:
    """The likelihood of another measurement, and (unknowns,) scores: shared ones of a fit, zero for the others."""
    likelihood = Likelihood(found.likelihood.simulation.of(measurement))
    scores, shared = np.zeros(likelihood.unknowns), len(likelihood.simulation.shared)
    scores[:shared] = found.scores[:shared]
    return likelihood, scores


def fit(
    simulation: Simulation,
    start: Real,
    schedule: Sequence[Stage] = FROM_AFAR,
    tolerance: float = 1e-2,
    most_steps: int = 30,
    hopeless: Mapping[Stage, float] = MappingProxyType({}),
    least_gain: float = 0.0,
    *,
    along_valleys: bool = False,
) -> Fit:
    """Find the most likely parameters.

    Args:
        simulation: the model.
        start: (unknowns,) scores, with or without amplitude errors.
        schedule: fits one after the other; the last should be `FINAL`. Stages without lines are left out.
        tolerance: gain in chi-square (over chi-square per datum) at which the last of them ends.
        most_steps: of each stage.
        hopeless: cost at the end of a stage above which the fit is given up.
        least_gain, along_valleys: as of `minimise`: the share of what is left beyond noise that steps have to gain, and
            whether they may bend.
    """
    found: Minimum | None = None
    schedule = with_lines(schedule, simulation.baseline.measurement)
    scores = as_unknowns(start, Likelihood(simulation))
    for stage, likelihood in zip(schedule, likelihoods(simulation, schedule, scores), strict=True):
        enough = tolerance if stage is schedule[-1] else EARLY_GAIN
        found = minimise(likelihood, scores, enough, most_steps, along_valleys=along_valleys, least_gain=least_gain)
        scores = found.values
        if stage != FINAL and found.at.cost > hopeless.get(stage, np.inf):
            return replace(evaluated(Likelihood(simulation), scores), given_up=True)
    assert found is not None
    return Fit(replace(likelihood, last_state=None), found.values, found.at, found.converged)


def likelihoods(simulation: Simulation, schedule: Sequence[Stage], scores: Real) -> list[Likelihood]:
    """The likelihood of each stage, from `scores` (unknowns,) on; stages of the same lines share their last state."""
    seen = dict[tuple[float, int | None], tuple[Simulation, LastState]]()
    for stage in schedule:
        if (stage.highest, stage.lines) not in seen:
            of = simulation.of(stage.seen(simulation.baseline.measurement))
            seen[stage.highest, stage.lines] = of, LastState(scores)
    both = [seen[stage.highest, stage.lines] for stage in schedule]
    return [
        Likelihood(of, stage.inflation, stage.tester_inflation, last_state)
        for stage, (of, last_state) in zip(schedule, both, strict=True)
    ]
