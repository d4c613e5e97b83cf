"""How far each explanation brings the gap down, and which of them leave held-out data above their floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.gap.held_out import HOLDS, HeldOut, held_out
from analysis.gap.measurement import Measurement
from analysis.gap.model import Model, on
from analysis.gap.parallel_work import ParallelMap
from analysis.gap.repeatability import carried_over, floor_percent, floor_percent_of
from analysis.gap.verdict import UNKNOWN, Weighed, listed, standing_for

COARSE_LINES = 128
"""Of each hammer set, for the held-out gaps of models that do not hold, and of those that are not the verdict."""
AT_THE_FLOOR = 1.2
"""Times what measuring again would differ by, up to which data count as explained; of a vast gap 5 % is much."""


@dataclass(frozen=True, eq=False)
class Gaps:
    """Gaps of models on held-out data.

    Attributes:
        by_model: by the identity of the model, as expected where predictions are asked for.
        floor_percent: what measuring again would differ by, there.
    """

    by_model: dict[int, HeldOut]
    floor_percent: float

    def of(self, model: Model) -> HeldOut | None:
        """Of one model; None where it was not asked for."""
        return self.by_model.get(id(model))

    def above_the_floor(self, model: Model) -> bool:
        """Whether a model is known to leave held-out data clearly above their floor."""
        found = self.of(model)
        return found is not None and found.overall.percent > AT_THE_FLOOR * self.floor_percent


def measured_gaps(
    none: Model, weighed: Sequence[Weighed], measurement: Measurement, parallel_map: ParallelMap
) -> dict[int, HeldOut]:
    """Gaps of the explanations that are listed on rows and points that are left out in turn, by identity of model."""
    coarse = measurement.thinned(COARSE_LINES)
    models = {id(each.model): on(each.model, coarse) for each in listed(weighed) if each.effects != UNKNOWN}
    models |= {id(each): _held(each, coarse) for each in (none, standing_for(weighed[0], none))}
    return dict(zip(models, parallel_map(_held_out, list(models.values())), strict=True))


def where_asked(gaps: dict[int, HeldOut], after: Model) -> Gaps:
    """Gaps and their floor: for rows of which a prediction is asked and none was measured, else as they are.

    Args:
        gaps: on what was measured.
        after: the model that the floor is computed with.
    """
    measurement = after.fit.likelihood.measurement
    measured = {point for each in measurement.sets for point in each.inputs}
    unseen = [point for _, point in measurement.predict if point not in measured]
    if not (unseen and measurement.sets):
        return Gaps(gaps, floor_percent(after.fit))
    unseen_floor = floor_percent_of(after.fit, unseen)
    return Gaps({model: carried_over(gap, unseen_floor) for model, gap in gaps.items()}, unseen_floor)


def _held(model: Model, coarse: Measurement) -> Model:
    """On all lines of the contest, or on fewer where the model does not hold and every fold is a fit of its own."""
    return model if model.fit.per_datum < HOLDS else on(model, coarse)


def _held_out(model: Model) -> HeldOut:
    return held_out(model.fit)
