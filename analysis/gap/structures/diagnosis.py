"""The diagnosis of any structure: which effects explain the gap, and how far it shrinks on parts that were left out."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex
from analysis.gap.diagnosis_step import Stage, StepListener, StepReport, ignore_step
from analysis.gap.evidence.calibration import UNCALIBRATED, Calibration
from analysis.gap.evidence.contest import Contest, contenders
from analysis.gap.evidence.plausibility import CHANCE
from analysis.gap.evidence.residual_structure import CHANCE_LIMIT, LOUDEST
from analysis.gap.evidence.verdict import (
    INSEPARABLE,
    UNKNOWN,
    Status,
    Weighed,
    confounded_effects,
    included,
    leading,
    listed,
    unfit,
    weigh,
    with_refuted,
)
from analysis.gap.findings.intervals import estimates
from analysis.gap.parameter import ParameterEstimate
from analysis.gap.structures.checks import check_simulator, effects_offered_by, known_ids, usable
from analysis.gap.structures.curve import Curve, checked, parts_of
from analysis.gap.structures.effect import StructureEffect, Variant, showing, variant_of
from analysis.gap.structures.error_scale import likely_scale
from analysis.gap.structures.left_out import (
    LeftOutPrediction,
    by_part,
    is_worse,
    left_out,
    percent_of,
    predicted,
    share_left,
)
from analysis.gap.structures.misreading import misread
from analysis.gap.structures.pulls import Pull, pulls_of
from analysis.gap.structures.search import SEARCH_AGAIN, CurveModel, CurveSearch, Failure
from analysis.gap.structures.simulator import Simulator

EXPLAINED_SHARE = 0.95
"""Share of the misfit beyond noise that has to be removed for a gap to count as explained."""


WHAT_TO_CHECK = (
    "units of the measured values, their conditions and the parameters, and which curve has which observable"
)
"""Where a simulation does not fit at all."""
MOST_LEFT = 0.5
"""Largest share of the gap on left-out data that may remain, beyond noise, where a gap counts as explained."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """One explanation.

    Attributes:
        effects, laws: ids and names; ("unknown",) without a law for a cause in no catalogue.
        probability: all of a ranking sum to one.
        parameters: of each effect by name.
        variants: place, part or sensor of each effect by name.
        percent: gap on data that were left out.
    """

    effects: tuple[str, ...]
    laws: tuple[str, ...]
    probability: float
    parameters: dict[str, dict[str, ParameterEstimate]]
    variants: dict[str, Variant]
    percent: float | None


@dataclass(frozen=True, eq=False)
class CurveDiagnosis:
    """A diagnosis of any structure.

    Attributes:
        status: whether, and how far, the verdict explains the gap.
        effects: ids of the verdict's effects.
        before, after: gaps on data that were left out in turn, per cent, without and with these effects. Where the
            given simulation was fitted to some parts (`fitted_to`), `before` is its gap on all parts.
        never_shown: the same two for parts that no fit has seen; None where all parts were shown.
        by_part: gaps before and after of each part that was left out or never shown, per cent.
        ranking: explanations, the most probable first.
        included: probability of each effect.
        confounded: groups of effects that these data cannot tell apart.
        alike: for each effect of the verdict by name, its variants that these data cannot tell apart, its own first;
            only where there are several.
        remainder_significant: whether the verdict leaves more than noise would.
        pulls: parameters of the simulator that the model of the verdict has far from their priors; where one of them
            is implausible, the status is neither NONE nor EXPLAINED.
        does_not_fit: sentences where the simulation predicts nothing and no effect repairs that, or where the values
            fit far better in another unit, sign or time convention, in which case none is named; else empty.
        failures: candidates that could not be computed.
        none, model: the given simulation, fitted to `fitted_to`, and the corrected one of the verdict.
        seconds: duration.
    """

    status: Status
    effects: tuple[str, ...]
    before: float
    after: float
    never_shown: tuple[float, float] | None
    by_part: dict[str, tuple[float, float]]
    ranking: tuple[Explanation, ...]
    included: dict[str, float]
    confounded: tuple[tuple[str, ...], ...]
    alike: dict[str, tuple[Variant, ...]]
    remainder_significant: bool
    pulls: tuple[Pull, ...]
    does_not_fit: tuple[str, ...]
    failures: tuple[Failure, ...]
    none: CurveModel
    model: CurveModel
    seconds: float


def diagnose_curves(
    simulator: Simulator,
    curves: Sequence[Curve],
    effects: Sequence[StructureEffect] | None = None,
    hold_out: Sequence[str] = (),
    without: frozenset[str] = frozenset(),
    progress: StepListener = ignore_step,
    calibration: Calibration = UNCALIBRATED,
    fitted_to: Sequence[str] = (),
    failed: Sequence[Failure] = (),
) -> CurveDiagnosis:
    """Diagnose the gap between a simulator and measured curves.

    Args:
        simulator: of the structure.
        curves: measured.
        effects: candidates; those of the simulator by default.
        hold_out: parts that no fit sees; only `never_shown` uses them.
        without: ids to leave out.
        progress: called as each step begins; its first answer is refined after each round of the search.
        calibration: what trials say.
        fitted_to: parts that the given simulation was fitted to, for gaps before; by default all that are seen.
        failed: candidates that could not be made at all, to be reported with the others.

    Raises:
        AnalysisError: there is too little to diagnose, the simulator fails, or a part or an effect that is named does
            not exist.
    """
    started, report = time.perf_counter(), StepReport(progress)
    absent = [each for each in (*hold_out, *fitted_to) if each not in parts_of(curves)]
    if absent:
        raise AnalysisError(f"no part is called {absent[0]!r}; there are {', '.join(parts_of(curves))}")
    if both := set(hold_out) & set(fitted_to):
        raise AnalysisError(f"part {min(both)!r} cannot be held out and fitted")
    seen = checked([each for each in curves if each.part not in hold_out])
    check_simulator(simulator)
    offered = effects_offered_by(simulator, seen) if effects is None else effects
    known = known_ids(offered, failed)
    if nowhere := sorted(without - set(known)):
        raise AnalysisError(f"no effect is called {nowhere[0]!r}; there are {', '.join(known)}")
    candidates, failures = usable(offered, without)
    failures += [each for each in failed if each.effect not in without]
    shown = showing(candidates, seen)
    search = CurveSearch(simulator, seen, shown, calibration, report, [*failures])
    report.begin(Stage.BASELINE, 0.0)
    given = none = search.fit_simulation()  # a wrong simulation that has smooth errors is fitted to little of the data
    found = search.run(none)
    misreading = misread(none.fit, [each.fit for each in found])
    found = [] if misreading else found
    scale = 0.0 if misreading else likely_scale(Contest(none, found, calibration, search.catalogue))
    if scale:
        search = CurveSearch(simulator, seen, shown, calibration, report, [*failures], scale, SEARCH_AGAIN)
        none = search.fit_simulation()
        found = search.run(none)
    report.begin(Stage.HELD_OUT, SEARCH_AGAIN[1])
    gaps = {id(none): left_out(given)}
    while True:
        chosen = contenders(Contest(none, found, calibration, search.catalogue))
        weighed = weigh(none, chosen, calibration, left_out=True, catalogue=search.catalogue)
        gaps |= {id(each.model): left_out(each.model) for each in listed(weighed) if id(each.model) not in gaps}
        if not (worse := outdone(weighed, found, none, gaps)):
            break
        found = [each for each in found if each not in worse]
    weighed = without_refuted(weighed, none, gaps)
    verdict = leading(weighed)
    after = none if verdict.effects == UNKNOWN else verdict.model
    if id(after) not in gaps:
        gaps[id(after)] = left_out(after)
    status = _status(none, verdict, gaps[id(none)], gaps[id(after)])
    does_not_fit = misreading or _unfit(simulator, status, gaps[id(none)], gaps[id(after)])
    if does_not_fit:
        status, after = Status.UNKNOWN, none
    pulls = pulls_of(after.fit)
    remainder = after.misfit.significance > CHANCE
    after = given if after is none else after
    gaps[id(given)] = gaps[id(none)]
    before, without_it = given, gaps[id(given)]
    if fitted_to:
        own = tuple(each for each in seen if each.part in fitted_to)
        before = CurveSearch(simulator, own, (), calibration, report).fit_simulation()
        without_it = [predicted(before.fit, each) for each in seen]
        after = before if after is given else after
    with_it = without_it if after is before else gaps[id(after)]
    unseen = [each for each in curves if each.part in hold_out]
    never = [[predicted(model.fit, each) for each in unseen] for model in (before, after)]
    parts = [by_part([*of, *more]) for of, more in zip((without_it, with_it), never, strict=True)]
    report.begin(Stage.DONE, 1.0)
    return CurveDiagnosis(
        status=status,
        effects=() if status is Status.UNKNOWN else verdict.effects,
        before=percent_of(without_it),
        after=percent_of(with_it),
        never_shown=(percent_of(never[0]), percent_of(never[1])) if unseen else None,
        by_part={part: (parts[0][part], parts[1][part]) for part in parts[0]},
        ranking=tuple(_explanation(each, gaps, calibration) for each in listed(weighed)),
        included=dict(included(weighed)),
        confounded=() if does_not_fit else confounded_effects(weighed),
        alike={} if does_not_fit else variants_alike(verdict, Contest(none, found, calibration, search.catalogue)),
        remainder_significant=remainder,
        pulls=pulls,
        does_not_fit=does_not_fit,
        failures=tuple(search.failures),
        none=before,
        model=after,
        seconds=time.perf_counter() - started,
    )


Gaps = Mapping[int, Sequence[LeftOutPrediction]]
"""Predictions of left-out data by identity of a model."""


def outdone(
    weighed: Sequence[Weighed[CurveModel]], models: Sequence[CurveModel], none: CurveModel, gaps: Gaps
) -> list[CurveModel]:
    """Models that raise the gap on left-out data, although another law of the same effects may not."""
    return [
        each.model
        for each in _worse(weighed, none, gaps)
        if any(tuple(sorted(other.ids)) == each.effects and other is not each.model for other in models)
    ]


def _worse(weighed: Sequence[Weighed[CurveModel]], none: CurveModel, gaps: Gaps) -> list[Weighed[CurveModel]]:
    """Explanations that raise the gap on left-out data, beyond chance."""
    known = [each for each in weighed if each.effects not in ((), UNKNOWN) and id(each.model) in gaps]
    return [each for each in known if is_worse(gaps[id(each.model)], gaps[id(none)], none.fit.likelihood.smooth_error)]


def without_refuted(
    weighed: Sequence[Weighed[CurveModel]], none: CurveModel, gaps: Gaps
) -> tuple[Weighed[CurveModel], ...]:
    """Explanations; those that raise the gap on left-out data have lost their probability.

    So has no effect, where a few values show a gap by their stated deviations.
    """
    fails = {each.effects for each in _worse(weighed, none, gaps)}
    if _few_show_gap(none):
        fails.add(())
    return with_refuted(weighed, fails, none)


def _few_show_gap(none: CurveModel) -> bool:
    """Whether so few values that neighbours cannot tell a misfit from loud noise are beyond noise of `LOUDEST`."""
    count = none.fit.likelihood.data
    return count <= CHANCE**2 and none.misfit.excess > CHANCE_LIMIT * LOUDEST * np.sqrt(2 * count)


def _status(
    none: CurveModel,
    verdict: Weighed[CurveModel],
    before: Sequence[LeftOutPrediction],
    after: Sequence[LeftOutPrediction],
) -> Status:
    if verdict.effects == UNKNOWN:
        return Status.UNKNOWN
    implausible = any(each.implausible for each in pulls_of(verdict.model.fit))
    if not verdict.effects:
        return Status.UNKNOWN if implausible else Status.NONE
    gap, left = none.misfit.certain, verdict.model.misfit.certain
    # Effects can follow few data wherever these are, and then predict none of them.
    predicts = share_left(before, after, none.fit.likelihood.smooth_error) <= MOST_LEFT
    return Status.EXPLAINED if predicts and not implausible and left <= (1 - EXPLAINED_SHARE) * gap else Status.PARTIAL


def _unfit(
    simulator: Simulator,
    status: Status,
    before: Sequence[LeftOutPrediction],
    after: Sequence[LeftOutPrediction],
) -> tuple[str, ...]:
    """A sentence where a simulation predicts nothing; noise may be as large as what was measured."""
    if status is Status.NONE or not np.isfinite(gap := percent_of(before)):
        return ()
    return unfit(f"Simulator {simulator.name}", gap, percent_of(after), WHAT_TO_CHECK)


def _explanation(
    each: Weighed[CurveModel], gaps: dict[int, list[LeftOutPrediction]], calibration: Calibration
) -> Explanation:
    unknown = each.effects == UNKNOWN
    own = () if unknown else estimates(each.model, calibration)
    acting = {} if unknown else {effect: each.model.effects[each.place_of(effect)] for effect in each.effects}
    return Explanation(
        effects=each.effects,
        laws=each.laws,
        probability=each.probability,
        parameters={} if unknown else {effect: own[each.place_of(effect)] for effect in each.effects},
        variants={effect: variant_of(found) for effect, found in acting.items()},
        percent=None if unknown or id(each.model) not in gaps else percent_of(gaps[id(each.model)]),
    )


def variants_alike(verdict: Weighed[CurveModel], contest: Contest[CurveModel]) -> dict[str, tuple[Variant, ...]]:
    """For each effect of a verdict, variants between which these data do not decide, such as places of a mass."""
    if not verdict.effects or verdict.effects == UNKNOWN:
        return {}
    own, alike = verdict.model, dict[str, tuple[Variant, ...]]()
    least = contest.score(own) + np.log(INSEPARABLE)
    close = [each for each in contest.models if set(each.ids) == set(own.ids) and contest.score(each) > least]
    for effect in own.effects:
        rest = set(own.effects) - {effect}
        others = [next(iter(set(each.effects) - rest)) for each in close if len(set(each.effects) - rest) == 1]
        variants = [variant_of(effect), *(variant_of(each) for each in others if each.law == effect.law)]
        different = tuple(each for place, each in enumerate(variants) if each not in variants[:place])
        if len(different) > 1:
            alike[effect.id] = different
    return alike


def curve_of(found: CurveDiagnosis, curve: Curve) -> tuple[Complex, Complex]:
    """(n,) readings of one curve by the given simulation, and with the verdict's effects."""
    return found.none.fit.likelihood.predict(found.none.fit.scores, curve), found.model.fit.likelihood.predict(
        found.model.fit.scores, curve
    )
