"""The diagnosis of one measurement: where the gap lies, which effects cause it, how far it shrinks."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.gap.catalogue import candidates, law_free, mechanism_of
from analysis.gap.diagnosis_step import Stage, StepListener, StepReport, explained_share, ignore_step
from analysis.gap.effect import Mechanism, RecordEffect
from analysis.gap.evidence.calibration import UNCALIBRATED, Calibration
from analysis.gap.evidence.contest import Contest, contenders
from analysis.gap.evidence.verdict import (
    UNKNOWN,
    Status,
    Weighed,
    confounded_effects,
    leading,
    listed,
    model_of_verdict,
    unfit,
    weigh,
)
from analysis.gap.experiments.catalogue import PAPER_TIME, RigTime
from analysis.gap.experiments.next_experiment import NextExperiment, experiments_in_turn
from analysis.gap.faults.removal import examine
from analysis.gap.findings.effects_found import (
    IN_RECORDS,
    EffectFound,
    Remainder,
    effects_found,
    mechanisms_found,
    of_records,
    remainder_of,
)
from analysis.gap.findings.gaps import (
    COARSE_LINES,
    coarse_gaps,
    fine_gaps,
    gaps_where_asked,
    no_higher,
    without_refuted,
    without_refuted_unknown,
)
from analysis.gap.findings.intervals import estimates
from analysis.gap.findings.location import GapMap, GapPlace, maps, places
from analysis.gap.findings.missing_evidence import missing_evidence
from analysis.gap.findings.model_values import ModelValues, values_of
from analysis.gap.findings.set_up_changes import SetUpChange, set_up_changes
from analysis.gap.findings.shape_search import found_shape
from analysis.gap.fitting.fit import Fit
from analysis.gap.fitting.held_out import HeldOut
from analysis.gap.fitting.model import Model, refined, with_misfit_on, with_overdispersion
from analysis.gap.fitting.requested_rows import at_rows
from analysis.gap.measurement import Measurement
from analysis.gap.outside_catalogue.rivals import rivals_of
from analysis.gap.parameter import ParameterEstimate
from analysis.gap.search.forward_selection import selected
from analysis.gap.search.single_effects import LINES, ParallelMap, Search, search_of, serial_map
from analysis.gap.simulation.scales import Scales

MORE_LINES = 4 * LINES
"""Lines of each hammer set on which effects are sought that fewer lines do not show."""
FINE_LINES = 400
"""Lines of each hammer set on which explanations of a large gap are weighed; a small gap is weighed on all lines."""
LARGE_GAP = 1.2
"""Chi-square per datum of the paper's model from which `FINE_LINES` are enough."""
EXPLAINED_SHARE = 0.95
"""Share of the misfit beyond noise that has to be removed for a gap to count as explained."""
WHAT_TO_CHECK = "units, positions of nodes and joints, and which file belongs to which rig"
"""Where the paper's model does not fit at all."""
CERTAINTY = 0.99
"""Probability of an effect that records show; the checks themselves err far less often."""
SEARCHED = 0.7
"""Share of the whole that is done when the search ends."""


@dataclass(frozen=True, eq=False)
class Ranked:
    """One explanation: no effect, some, or an unknown one (`effects` is then ("unknown",)).

    Attributes:
        effects: ids.
        laws: of each effect, the most probable of its rivals.
        probability: all of a ranking sum to one.
        held_out: gap with these effects in the model; None for "unknown".
        parameters: by effect and name.
        explained: share of the misfit beyond noise that these effects remove, 0 to 1.
    """

    effects: tuple[str, ...]
    laws: tuple[str, ...]
    probability: float
    held_out: HeldOut | None
    parameters: dict[str, dict[str, ParameterEstimate]]
    explained: float


@dataclass(frozen=True, eq=False)
class Predicted:
    """Accelerances that were asked for: (lines,) Hz and, by (response, input) in order, (rows, lines) each."""

    frequency: Real
    before: Complex
    after: Complex


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """The result of a diagnosis.

    Attributes:
        status: whether, and how far, the verdict explains the gap.
        effects: ids of the verdict's effects; empty for none and unknown.
        before, after: gaps of the paper's model, and of the verdict's; where predictions are asked for rows that were
            not measured, the gaps to expect there.
        floor_percent: difference to expect when the same rows are measured again.
        where: places of the gap, the largest first.
        maps: misfit over rows and bands, for pictures.
        ranking: explanations, the most probable first.
        confounded: groups of effects that these data cannot tell apart from the verdict's.
        next_experiment: the one that tells most about the explanations for its rig time.
        faults: of the measurement itself, a sentence each.
        predicted: the predictions that were asked for; None where none were.
        seconds: duration of the diagnosis.
        readings: (points,) N/m of the tester by the paper's model and by the verdict's; None without a tester.
        missing_evidence: what could not be measured and so cannot be decided, a sentence each.
        included: effects that may be there, the most probable first.
        mechanisms: probability of each.
        remainder: the misfit that the verdict leaves.
        nuisances: their scales, as stated or estimated.
        set_up_changes: joints that differ between hammer sets by more than set-ups usually make.
        model: the corrected simulation by its values: the paper's where the verdict has no effect.
        explanations: with their fitted models, the most probable first; records and limits of trials do not count.
        corrected: the fitted model of the corrected simulation, whose gap `after` is.
    """

    status: Status
    effects: tuple[str, ...]
    before: HeldOut
    after: HeldOut
    floor_percent: float
    where: tuple[GapPlace, ...]
    maps: tuple[GapMap, ...]
    ranking: tuple[Ranked, ...]
    confounded: tuple[tuple[str, ...], ...]
    next_experiment: NextExperiment
    faults: tuple[str, ...]
    predicted: Predicted | None
    seconds: float
    readings: tuple[Complex, Complex] | None
    missing_evidence: tuple[str, ...]
    included: tuple[EffectFound, ...]
    mechanisms: dict[Mechanism, float]
    remainder: Remainder
    nuisances: Scales
    set_up_changes: tuple[SetUpChange, ...]
    model: ModelValues
    explanations: tuple[Weighed[Model], ...] = ()
    corrected: Model | None = None


def diagnose(
    measurement: Measurement,
    without: frozenset[str] = frozenset(),
    progress: StepListener = ignore_step,
    parallel_map: ParallelMap = serial_map,
    calibration: Calibration = UNCALIBRATED,
    time_of_rig: RigTime = PAPER_TIME,
) -> Diagnosis:
    """Diagnose the gap of a measurement.

    Args:
        measurement: of both rigs, or of one.
        without: ids of effects to leave out of the catalogue.
        progress: called as each step begins; its first answer is refined after each round of the search.
        parallel_map: runs independent fits, in parallel if it can.
        calibration: what trials say of laws and causes.
        time_of_rig: how long experiments take.

    Raises:
        AnalysisError: the measurement cannot be simulated.
    """
    started = time.perf_counter()
    report = StepReport(progress)
    report.begin(Stage.FAULTS, 0.0)
    given, sound = measurement, examine(measurement)
    measurement = sound.measurement
    shown = [each for each in sound.effects if each.id not in without]
    report.in_records = tuple(each.id for each in shown)
    left_out = frozenset(mechanism_of(effect) for effect in without)
    free = law_free(measurement, left_out)
    known = candidates(measurement, without)
    rivals = rivals_of(measurement)
    report.begin(Stage.BASELINE, 0.05)
    search, coarse, found = searched(
        measurement,
        lambda lines: search_of(measurement, known, lines, parallel_map, free, rivals),
        calibration,
        report,
    )
    report.begin(Stage.ALL_LINES, SEARCHED)
    none, weighed = _weighed_on_all_lines(coarse, found, measurement, parallel_map, calibration)
    report.answer(leading(weighed), none)
    report.begin(Stage.HELD_OUT, 0.85)
    weighed, measured = _on_held_out_data(none, weighed, measurement, parallel_map)
    verdict = leading(weighed)
    after = model_of_verdict(verdict, none)
    gaps = gaps_where_asked(measured, after)
    found_maps = maps(none.fit)
    status = _status(none, verdict, not gaps.above_the_floor(after))
    before, repaired = (gaps.by_model[id(each)].overall.percent for each in (none, after))
    does_not_fit = unfit("the paper's model", before, repaired, WHAT_TO_CHECK)
    if does_not_fit:
        status, after = Status.UNKNOWN, none
    ranking = tuple(_ranked(each, none, gaps.by_model.get(id(each.model)), calibration) for each in listed(weighed))
    confounded = confounded_effects(weighed)
    remainder = remainder_of(after, gaps.by_model[id(after)], verdict, calibration)
    on = next((each for each in (coarse, *found) if set(each.effects) == set(after.effects)), None)
    if status in (Status.UNKNOWN, Status.PARTIAL) and not does_not_fit and on is not None:
        report.answer(verdict, none)
        report.begin(Stage.REMAINDER, 0.95)
        lines, seen = measurement.thinned(COARSE_LINES), measured[id(after)]
        remainder = replace(remainder, curve=found_shape(search, on, found, lines, seen, calibration))
    result = Diagnosis(
        status=status,
        effects=verdict.effects if status in (Status.EXPLAINED, Status.PARTIAL) else (),
        before=gaps.by_model[id(none)],
        after=no_higher(gaps.by_model[id(after)], gaps.by_model[id(none)]),
        floor_percent=gaps.floor_percent,
        where=places(found_maps),
        maps=found_maps,
        ranking=_normalised(ranking),
        confounded=confounded,
        next_experiment=experiments_in_turn(
            status, weighed, confounded, calibration, time_of_rig, parallel_map=parallel_map
        )[0],
        faults=sound.faults,
        predicted=predictions(given, none.fit, after.fit),
        seconds=time.perf_counter() - started,
        readings=None if given.points is None else (_readings(none.fit), _readings(after.fit)),
        missing_evidence=(*does_not_fit, *missing_evidence(measurement)),
        included=effects_found(weighed, calibration, found),
        mechanisms=mechanisms_found(weighed),
        remainder=remainder,
        nuisances=after.fit.likelihood.scales,
        set_up_changes=set_up_changes(after, calibration),
        model=values_of(after, calibration),
        explanations=weighed,
        corrected=after,
    )
    report.begin(Stage.DONE, 1.0)
    return with_records(result, shown)


def searched(
    measurement: Measurement, search_on: Callable[[int], Search], calibration: Calibration, report: StepReport
) -> tuple[Search, Model, list[Model]]:
    """A search, the paper's model and every model that it visited.

    Where few lines show no effect, it is repeated on more of them: an effect that is spread evenly over the lines is
    twice as many standard deviations on four times as many.

    Args:
        measurement: of both rigs, or of one.
        search_on: a search on so many lines of each hammer set.
        calibration: what trials say.
        report: of its steps.
    """
    search = search_on(LINES)
    coarse = search.fit_paper_model()
    report.begin(Stage.SINGLE_EFFECTS, 0.15)

    def so_far(best: Weighed[Model]) -> None:
        report.answer(best, coarse)
        # nobody knows how many rounds follow
        report.begin(Stage.FURTHER_EFFECTS, (report.step.share + SEARCHED) / 2)

    found = selected(search, coarse, calibration, so_far)
    has_more = any(each.frequency.size > LINES for each in measurement.sets)
    if has_more and not leading(weigh(coarse, found, calibration)).effects:
        search = search_on(MORE_LINES)
        coarse = search.fit_paper_model()
        found = selected(search, coarse, calibration, so_far)
    return search, coarse, found


def _weighed_on_all_lines(
    coarse: Model, found: Sequence[Model], measurement: Measurement, parallel_map: ParallelMap, calibration: Calibration
) -> tuple[Model, tuple[Weighed[Model], ...]]:
    """The paper's model and the explanations by probability, fitted to all lines that count.

    They are compared under the scales of the best one: a wrong model would hide its misfit behind wide scales. Under
    these a wrong model may fit best far off, though, so the paper's keeps its own fit for what is said of it.
    """
    fine = measurement if coarse.fit.per_datum < LARGE_GAP else measurement.thinned(FINE_LINES)
    chosen = contenders(Contest(coarse, found, calibration))
    first = [coarse, *sorted(chosen, key=lambda each: -each.log_evidence)[:1]]
    closer = list(parallel_map(partial(refined, measurement=fine), first))
    best = max(closer, key=lambda each: each.log_evidence)
    alike = partial(refined, measurement=fine, scales=best.fit.likelihood.scales)
    models = list(parallel_map(alike, [*closer, *(each for each in chosen if each is not first[-1])]))
    if fine is not measurement:
        models = list(parallel_map(partial(with_misfit_on, measurement=measurement), models))
    overdispersion = Contest(models[0], models[1:], calibration).overdispersion
    none, *contest = parallel_map(partial(with_overdispersion, overdispersion=overdispersion), models)
    paper = replace(closer[0], compared_misfit=none.misfit)
    weighed = weigh(none, contest, calibration, left_out=True)
    return paper, tuple(replace(each, model=paper) if each.model is none else each for each in weighed)


def _on_held_out_data(
    none: Model, weighed: tuple[Weighed[Model], ...], measurement: Measurement, parallel_map: ParallelMap
) -> tuple[tuple[Weighed[Model], ...], dict[int, HeldOut]]:
    """The explanations after a check of their predictions against held-out data, and the gaps on these data."""
    measured = coarse_gaps(none, weighed, measurement, parallel_map)
    weighed = without_refuted(weighed, none, measured)
    measured = fine_gaps(none, weighed, measured, parallel_map)
    return without_refuted_unknown(weighed, none, measured), measured


def locate(measurement: Measurement) -> tuple[tuple[GapPlace, ...], tuple[GapMap, ...], tuple[str, ...]]:
    """Only where the gap lies: places, maps and faults of the measurement.

    Raises:
        AnalysisError: the measurement cannot be simulated.
    """
    sound = examine(measurement)
    search = search_of(sound.measurement, ())
    found = maps(refined(search.fit_paper_model(), sound.measurement.thinned(FINE_LINES)).fit)
    return places(found), found, sound.faults


def with_records(found: Diagnosis, shown: Sequence[RecordEffect]) -> Diagnosis:
    """A diagnosis with the effects that records show added to the verdict and to each explanation."""
    if not shown:
        return found
    ids, unknown = tuple(each.id for each in shown), found.status is Status.UNKNOWN
    inside = [each for each in found.ranking if each.effects != UNKNOWN]
    ranking = [_beside_records(each, shown) for each in inside]
    remaining = (1 - CERTAINTY) * sum(each.probability for each in inside)
    for each in found.ranking:
        if not each.effects:
            ranking.append(replace(each, probability=remaining))
        if each.effects == UNKNOWN:  # what no model explains may be what the records show
            ranking.append(replace(each, probability=(1 - CERTAINTY) * each.probability))
            alone = next(place for place, other in enumerate(ranking) if other.effects == ids)
            more = ranking[alone].probability + CERTAINTY * each.probability
            ranking[alone] = replace(ranking[alone], probability=more)
    return replace(
        found,
        status={Status.NONE: Status.EXPLAINED, Status.UNKNOWN: Status.PARTIAL}.get(found.status, found.status),
        effects=ids if unknown else (*found.effects, *ids),
        ranking=_normalised(tuple(sorted(ranking, key=lambda each: -each.probability))),
        included=(*(of_records(each, CERTAINTY) for each in shown), *found.included),
        mechanisms=found.mechanisms | {mechanism_of(each.id): CERTAINTY for each in shown},
        next_experiment=replace(found.next_experiment, corrections=ids),
    )


def _beside_records(each: Ranked, shown: Sequence[RecordEffect]) -> Ranked:
    return replace(
        each,
        effects=(*each.effects, *(found.id for found in shown)),
        laws=(*each.laws, *(IN_RECORDS for _ in shown)),
        parameters=each.parameters | {found.id: found.parameters for found in shown},
        probability=CERTAINTY * each.probability,
    )


def predictions(measurement: Measurement, before: Fit, after: Fit) -> Predicted | None:
    """Accelerances that were asked for, as the accelerometer of the reference set would read them."""
    asked = measurement.predict
    if not asked or not measurement.sets:
        return None
    own = measurement.drawing.accelerometer
    for response, _ in asked:
        if response != own:
            raise AnalysisError(f"a prediction for {response} is asked for; the accelerometer sits at {own}")
    inputs = tuple(point for _, point in asked)
    frequency = measurement.sets[0].frequency
    return Predicted(frequency, _predicted(before, inputs, frequency), _predicted(after, inputs, frequency))


def _readings(found: Fit) -> Complex:
    simulation, points = found.likelihood.simulation, found.likelihood.measurement.points
    assert points is not None, "asked for where there is a tester only"
    return simulation.tester(simulation.values(found.scores[: len(simulation.shared)].tolist()), points)


def _predicted(found: Fit, inputs: tuple[Dof, ...], frequency: Real) -> Complex:
    whole, scores = at_rows(found.likelihood, found.scores, inputs, frequency)
    return whole.predict(scores, ()).accelerances[0][-len(inputs) :]


def _status(none: Model, verdict: Weighed[Model], at_the_floor: bool) -> Status:
    if verdict.effects == UNKNOWN:
        return Status.UNKNOWN
    if not verdict.effects:
        return Status.NONE
    explained = at_the_floor and explained_share(verdict.model, none) >= EXPLAINED_SHARE
    return Status.EXPLAINED if explained else Status.PARTIAL


def _ranked(each: Weighed[Model], none: Model, gap: HeldOut | None, calibration: Calibration) -> Ranked:
    unknown = each.effects == UNKNOWN
    found = () if unknown else estimates(each.model, calibration)
    return Ranked(
        effects=each.effects,
        laws=each.laws,
        probability=each.probability,
        held_out=None if unknown else gap,
        parameters={} if unknown else {effect: found[each.place_of(effect)] for effect in each.effects},
        explained=1.0 if unknown else explained_share(each.model, none),
    )


def _normalised(ranking: tuple[Ranked, ...]) -> tuple[Ranked, ...]:
    total = sum(each.probability for each in ranking)
    return tuple(replace(each, probability=each.probability / total) for each in ranking)
