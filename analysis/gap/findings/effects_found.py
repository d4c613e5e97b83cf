"""Findings of a diagnosis beside its verdict: probability of each effect and mechanism, and the remainder."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.gap.catalogue import mechanism_of
from analysis.gap.effect import Effect, Mechanism, RecordEffect
from analysis.gap.evidence.calibration import Calibration
from analysis.gap.evidence.fitted import AnyModel
from analysis.gap.evidence.plausibility import CHANCE, PLAUSIBLE
from analysis.gap.evidence.verdict import UNKNOWN, Weighed, included, leading
from analysis.gap.findings.intervals import estimates
from analysis.gap.findings.law_found import LawFound, law_found
from analysis.gap.findings.location import GapPlace, maps, places
from analysis.gap.fitting.fit import Fit
from analysis.gap.fitting.held_out import HeldOut
from analysis.gap.fitting.model import Model
from analysis.gap.outside_catalogue.local_change import LOCAL_CHANGE
from analysis.gap.outside_catalogue.shape import FoundShape
from analysis.gap.parameter import ParameterEstimate


@dataclass(frozen=True)
class EffectFound:
    """An effect that may be there.

    Attributes:
        id: in the catalogue.
        probability: that it is part of the explanation, over all models that were visited.
        mechanism: that it belongs to.
        law: its most probable one.
        law_is_known: whether that is a law of the catalogue; otherwise a smooth function describes it better, and the
            effect is the closest that is known.
        parameters: by name, of that law.
        out_of_range: names of parameters beyond their plausible range.
        law_found: how joints follow it; None for an effect that is no law of the joints, and for one that is neither
            likely nor in the verdict.
    """

    id: str
    probability: float
    mechanism: Mechanism
    law: str
    law_is_known: bool
    parameters: Mapping[str, ParameterEstimate]
    out_of_range: tuple[str, ...] = ()
    law_found: LawFound | None = None


@dataclass(frozen=True)
class LocalFinding:
    """A change that is in no catalogue, at one place of the beam or from one point of the test on.

    Attributes:
        kind: what it does.
        parameters: by name; `position` is its place on the beam, m from the left end; `from` the time, displacement or
            force of the tester from which it acts.
    """

    kind: str
    parameters: Mapping[str, ParameterEstimate]


@dataclass(frozen=True)
class Remainder:
    """The misfit that the verdict leaves.

    Attributes:
        percent: rms difference of the corrected model, as fitted, and the response, without noise; of the beam rig, or
            of the tester where the beam was not struck.
        sigma: rms of the misfit beyond noise, over noise.
        significant: whether it is more than noise alone would show.
        where: its places, the largest first; empty where it is not significant.
        acts_at: what explains it best, where that is one change of the beam or of the tester.
        curve: the smooth function at one place that would take up most of it, where the verdict does not explain it.
    """

    percent: float
    sigma: float
    significant: bool
    where: tuple[GapPlace, ...]
    acts_at: LocalFinding | None = None
    curve: FoundShape | None = None


IN_RECORDS = "found in records"
"""Law of an effect that records show without any fit."""
LEAST = 0.01
"""Probability from which an effect is listed."""
LIKELY = 0.5
"""Probability above which the law of an effect is given, also where the verdict does not have it."""


def effects_found(
    weighed: Sequence[Weighed[Model]], calibration: Calibration, visited: Sequence[Model] = ()
) -> tuple[EffectFound, ...]:
    """Effects by the probability that they are part of the explanation, each as its best explanation has it.

    Args:
        weighed: explanations.
        calibration: how wrong laws may be.
        visited: models that were fitted; a law among them is the closest that is known to a smooth function.
    """
    found, verdict = [], leading(weighed).effects
    for effect, probability in included(weighed).items():
        if probability < LEAST:
            continue
        best = next(each for each in weighed if effect in each.effects)
        place = best.place_of(effect)
        law = best.model.effects[place]
        shown = probability > LIKELY or effect in verdict
        closest = _closest_law(effect, law, visited)
        found.append(
            EffectFound(
                id=effect,
                probability=probability,
                mechanism=law.mechanism,
                law=law.law,
                law_is_known=not law.law_free,
                parameters=estimates(best.model, calibration)[place],
                out_of_range=out_of_range(best.model, place),
                law_found=law_found(best.model, place, calibration, closest) if shown else None,
            )
        )
    return tuple(found)


def _closest_law(effect: str, law: Effect, visited: Sequence[Model]) -> str:
    """The closest law that has a name, where one deviates from it or is a smooth function in its place; else empty."""
    if not law.law_free:
        return law.named_law if law.named_law != law.law else ""
    named = [
        (model.log_evidence, each.named_law)
        for model in visited
        for each in model.effects
        if each.id == effect and not each.law_free
    ]
    return max(named, default=(0.0, ""))[1]


def of_records(shown: RecordEffect, probability: float) -> EffectFound:
    """An effect that records show."""
    return EffectFound(shown.id, probability, mechanism_of(shown.id), IN_RECORDS, True, shown.parameters)


def mechanisms_found(weighed: Sequence[Weighed[Model]]) -> dict[Mechanism, float]:
    """Probability of each mechanism that any of its effects is part of the explanation, the largest first."""
    found = dict[Mechanism, float]()
    for each in weighed:
        for mechanism in {mechanism_of(effect) for effect in each.effects if each.effects != UNKNOWN}:
            found[mechanism] = found.get(mechanism, 0.0) + each.probability
    return dict(sorted(found.items(), key=lambda each: -each[1]))


def remainder_of(after: Model, gap: HeldOut, verdict: Weighed[Model], calibration: Calibration) -> Remainder:
    """The remainder of a model.

    Args:
        after: the model.
        gap: its gap on held-out data.
        verdict: that it belongs to.
        calibration: how wrong laws may be.
    """
    misfit, percent = after.misfit, misfit_percent(after.fit)
    significant = misfit.significance > CHANCE and gap.overall.remaining_percent > 0.0 and percent > 0.0
    return Remainder(
        percent=percent,
        sigma=float(np.sqrt(max(misfit.energy, misfit.excess, 0.0) / after.fit.likelihood.data)),
        significant=significant,
        where=places(maps(after.fit)) if significant else (),
        acts_at=_local(verdict.model, calibration) if verdict.effects == UNKNOWN else None,
    )


def misfit_percent(found: Fit) -> float:
    """Rms difference of a fit and the response beyond noise, over the response, in per cent; 0 where noise explains it.

    The fit knows the gain of each set and where its blows fell. On rows that are left out both differ by chance, and a
    smooth error of accelerances takes up a part of what the model does not explain.
    """
    measurement, readings = found.likelihood.measurement, found.readings
    parts = [
        (each.accelerance, accelerance, each.deviation)
        for each, accelerance in zip(measurement.sets, readings.accelerances, strict=True)
    ]
    if not parts:
        assert measurement.points is not None
        parts = [(measurement.points.stiffness, readings.stiffness, measurement.points.deviation)]
    left = sum(float(np.sum(np.abs(of - fitted) ** 2 - 2 * deviation**2)) for of, fitted, deviation in parts)
    return 100 * float(np.sqrt(max(0.0, left) / sum(float(np.sum(np.abs(of) ** 2)) for of, _, _ in parts)))


def _local(model: Model, calibration: Calibration) -> LocalFinding | None:
    if model.ids != (LOCAL_CHANGE,):
        return None
    return LocalFinding(model.effects[0].law, estimates(model, calibration)[0])


def out_of_range(model: AnyModel, effect: int) -> tuple[str, ...]:
    """Names of the parameters of one effect of a model that are beyond their plausible range."""
    own = zip(model.effects[effect].parameters, model.places(effect), strict=True)
    return tuple(parameter.name for parameter, place in own if abs(model.fit.scores[place]) > PLAUSIBLE)
