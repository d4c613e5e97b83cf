"""How far each explanation lowers the gap on held-out data, and the floor: the difference to expect of a repetition."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.dof import Dof
from analysis.gap.effect import METHODS_OF_RIG, acts_on_rig
from analysis.gap.evidence.plausibility import impossibility
from analysis.gap.evidence.verdict import (
    UNKNOWN,
    Weighed,
    excludes_no_effect,
    leading,
    listed,
    model_of_verdict,
    with_refuted,
)
from analysis.gap.fitting.fit import Fit, in_other_set_up
from analysis.gap.fitting.held_out import MODEL_HOLDS_BELOW, HeldOut, held_out
from analysis.gap.fitting.model import Model, evaluate_on
from analysis.gap.measurement import HammerSet, Measurement, Rig, SetUpTolerances
from analysis.gap.outside_catalogue.local_change import LOCAL_CHANGE
from analysis.gap.search.single_effects import ParallelMap
from analysis.gap.simulation.simulation_state import Prediction


def floor_percent(found: Fit) -> float:
    """Difference to expect when a measurement is repeated, in per cent: offsets of blows, another gain, and noise.

    The rms over all set-ups of the beam rig; of the tester alone, its noise and gain.
    """
    likelihood = found.likelihood
    measurement = likelihood.measurement
    if not measurement.sets:
        assert measurement.points is not None
        noise = float(np.sum(2 * measurement.points.deviation**2) / np.sum(np.abs(measurement.points.stiffness) ** 2))
        return 100 * float(np.sqrt(noise + measurement.tolerances.tester_gain**2))
    return _differing(measurement.sets, likelihood.predict(found.scores, (0,)), measurement.tolerances)


def floor_percent_of(found: Fit, unseen: Sequence[Dof]) -> float:
    """The floor of a set struck at points that were not measured, with the noise of the reference set."""
    likelihood = found.likelihood
    reference = likelihood.measurement.sets[0]
    there = reference.struck_at(tuple(unseen), reference.frequency)
    other, scores = in_other_set_up(found, replace(likelihood.measurement, sets=(there,)))
    return _differing((there,), other.predict(scores, (0,)), likelihood.measurement.tolerances)


def _differing(sets: Sequence[HammerSet], predicted: Prediction, tolerances: SetUpTolerances) -> float:
    """Rms difference, in per cent, of the sets that a model predicts from one set-up to another."""
    differing = measured = 0.0
    for number, each in enumerate(sets):
        size = np.abs(predicted.accelerances[number]) ** 2
        blows = np.sum(np.abs(predicted.by_blow[number]) ** 2, axis=0)
        differing += float(np.sum(tolerances.sensor_gain**2 * size + blows + 2 * each.deviation**2))
        measured += float(np.sum(size))
    return 100 * float(np.sqrt(differing / measured))


def gap_on_unseen_rows(found: HeldOut, unseen_floor: float) -> HeldOut:
    """Gaps to expect on rows that were not measured: the model has the same error there, and the floor is theirs.

    Args:
        found: on rows that were left out in turn.
        unseen_floor: floor on the rows that were not measured, per cent.
    """
    if found.inverse is None:
        return found
    change = found.inverse.model_percent**2 + unseen_floor**2 - found.inverse.percent**2

    def there(percent: float) -> float:
        return float(np.sqrt(max(0.0, percent**2 + change)))

    low, high = found.ci90_percent
    return replace(
        found,
        inverse=replace(found.inverse, percent=there(found.inverse.percent)),
        ci90_percent=(there(low), there(high)),
    )


COARSE_LINES = 128
"""Lines of each hammer set for the held-out gaps of models that do not hold, or that are not the verdict."""
AT_THE_FLOOR = 1.2
"""Multiple of the floor up to which a gap counts as explained. The explained share of the misfit alone is not enough:
the last 5 % of a very large gap may be far above the floor."""


@dataclass(frozen=True, eq=False)
class Gaps:
    """Gaps of models on held-out data.

    Attributes:
        by_model: by the identity of the model, as expected where predictions are asked for.
        floor_percent: difference to expect when the same rows are measured again.
    """

    by_model: dict[int, HeldOut]
    floor_percent: float

    def above_the_floor(self, model: Model) -> bool:
        """Whether a model is known to leave held-out data clearly above their floor."""
        found = self.by_model.get(id(model))
        return found is not None and found.overall.percent > AT_THE_FLOOR * self.floor_percent


GapsByModel = dict[int, HeldOut]
"""Gaps on rows and points that are left out in turn, by identity of model."""


def coarse_gaps(
    none: Model, weighed: Sequence[Weighed[Model]], measurement: Measurement, parallel_map: ParallelMap
) -> GapsByModel:
    """Gaps of the explanations that are listed and of the paper's model, all on the same few lines."""
    coarse = measurement.thinned(COARSE_LINES)
    models = {id(each.model): each.model for each in listed(weighed) if each.effects != UNKNOWN} | {id(none): none}
    fits = [evaluate_on(each, coarse).fit for each in models.values()]
    return dict(zip(models, parallel_map(held_out, fits), strict=True))


def fine_gaps(
    none: Model, weighed: Sequence[Weighed[Model]], coarse: GapsByModel, parallel_map: ParallelMap
) -> GapsByModel:
    """The coarse gaps, with those of the paper's model and of the verdict on the lines of their fits, where these hold.

    Where a model does not hold, every fold needs a fit. Gaps on other lines differ a little: where the gap would then
    rise with the verdict, both models keep their coarse gaps.
    """
    after = model_of_verdict(leading(weighed), none)
    holding = {id(each): each.fit for each in (none, after) if each.fit.per_datum < MODEL_HOLDS_BELOW}
    found = coarse | dict(zip(holding, parallel_map(held_out, list(holding.values())), strict=True))
    return coarse if found[id(after)].overall.percent > found[id(none)].overall.percent else found


SAME = 0.01
"""Relative change up to which a held-out gap counts as unchanged."""


def shrinks(model: Model, before: HeldOut, after: HeldOut) -> bool:
    """Whether the effects of a model lower the held-out gap of a rig that they act on, and raise none.

    A gap is lower if `percent` or `sigma` falls. A gap that noise and set-ups already explain cannot fall and counts as
    lower. A gap is higher if both rise by more than chance, to more than noise and set-ups explain. A smaller rise does
    not count: its reason is where the blows fell.
    """
    parts = {rig: any(acts_on_rig(effect, rig) for effect in model.effects) for rig in METHODS_OF_RIG}
    pairs = {
        rig: (getattr(before, rig), getattr(after, rig)) for rig in METHODS_OF_RIG if getattr(before, rig) is not None
    }
    lowered = [
        new.sigma < old.sigma or new.percent < old.percent or not old.stands_out
        for rig, (old, new) in pairs.items()
        if parts[rig]
    ]
    raised = [
        new.percent > (1 + SAME) * old.percent and new.sigma > old.sigma and new.is_above(old) and new.stands_out
        for old, new in pairs.values()
    ]
    return any(lowered) and not any(raised)


def no_higher(after: HeldOut, before: HeldOut) -> HeldOut:
    """Gaps of a verdict that was not refuted: any rise is chance, or due to where blows fell, and is reported as none.

    Args:
        after: of the verdict's model.
        before: of the paper's model.
    """
    rigs = {rig: (getattr(before, rig), getattr(after, rig)) for rig in METHODS_OF_RIG}
    kept = {rig: old if new and new.percent > old.percent else new for rig, (old, new) in rigs.items()}
    overall = before if after.overall.percent > before.overall.percent else after
    return HeldOut(kept[Rig.BEAM], kept[Rig.TESTER], overall.ci90_percent)


def without_refuted(
    weighed: Sequence[Weighed[Model]], none: Model, gaps: Mapping[int, HeldOut]
) -> tuple[Weighed[Model], ...]:
    """Explanations that do not lower a held-out gap lose their probability: to no effect, or to an unknown cause.

    Args:
        weighed: explanations.
        none: the paper's model.
        gaps: by identity of model.
    """
    before = gaps[id(none)]
    fails = {
        each.effects
        for each in weighed
        if each.effects not in ((), UNKNOWN)
        and id(each.model) in gaps
        and not shrinks(each.model, before, gaps[id(each.model)])
    }
    return with_refuted(weighed, fails, none)


def without_refuted_unknown(
    weighed: Sequence[Weighed[Model]], none: Model, gaps: Mapping[int, HeldOut]
) -> tuple[Weighed[Model], ...]:
    """A cause in no catalogue is refuted where held-out data leave nothing unexplained beyond chance.

    The misfit of a fit may be noise that is stated too small; a cause would show in what the model predicts.
    It is kept where the data exclude that there is no effect, and the best explanation leaves most of the misfit or
    asks for impossible sizes: a change that differs from row to row at random is in no prediction of a row that is left
    out, and a small one does not stand out there. So it is where one cause that is in no catalogue was fitted and
    explains the misfit best: noise that is stated too small follows no such law.

    Args:
        weighed: explanations.
        none: the paper's model.
        gaps: by identity of model.
    """
    before = gaps[id(none)]
    leaves = any(each.stands_out for each in (before.inverse, before.direct) if each is not None)
    known = next((each.model for each in weighed if each.effects not in ((), UNKNOWN)), none)
    fails = known.misfit.certain > none.misfit.certain / 2 or impossibility(known.fit) > 0.0
    found = any(each.effects == UNKNOWN and LOCAL_CHANGE in each.model.ids for each in weighed)
    remains = (fails or found) and excludes_no_effect(weighed)
    return tuple(weighed) if leaves or remains else with_refuted(weighed, {UNKNOWN}, none)


def gaps_where_asked(gaps: dict[int, HeldOut], after: Model) -> Gaps:
    """Gaps and their floor: for the rows that are asked for, if none of them was measured; else gaps as they are.

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
    return Gaps({model: gap_on_unseen_rows(gap, unseen_floor) for model, gap in gaps.items()}, unseen_floor)
