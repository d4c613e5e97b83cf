"""How often the diagnosis of one simulator is right: cases drawn on it, under the conditions of a measurement.

Parameters come from their priors, one effect or none from the candidates. What an effect does is changed by a smooth
random share, unless its form is known, and every reading by a smooth random error. The diagnosis sees curves alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from pydantic import NonNegativeFloat, NonNegativeInt, ValidationError, model_validator

from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.gap.evidence.verdict import Status
from analysis.gap.structures.checks import check_simulator, effects_offered_by, usable
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.diagnosis import diagnose_curves
from analysis.gap.structures.effect import StructureEffect, showing
from analysis.gap.structures.likelihood import CurveLikelihood, fit_curves
from analysis.gap.structures.simulator import Simulator
from jointlab.errors import JointlabError
from rig.document import Document

NONE_SHARE = 0.25
"""Share of the cases without any effect."""
SIZES = (0.3, 1.5)
"""Standard deviations of its prior, between which an effect's parameters lie."""
LAW_ERROR, MODEL_ERROR = 0.05, 0.003
"""Rms of the smooth random change of what an effect does, unless its form is known, and of a reading; both relative."""
STRONG = 5.0
"""Standard deviations by which data show that the simulation lacks something, from which it is to be named."""
DRAWS = 50
"""Draws of a case at most, until one can be predicted."""


@dataclass(frozen=True)
class CaseScore:
    """One case.

    Attributes:
        truth: id of its effect; empty for none.
        strength: standard deviations that the simulation misses at best.
        answer: ids of the verdict.
        status: of the verdict.
        probability: of the first explanation.
        seconds: of the diagnosis.
    """

    truth: str
    strength: float
    answer: tuple[str, ...]
    status: Status
    probability: float
    seconds: float


class StrongCases(Document):
    """Cases with an effect that is clearly there, and those of them in which it was named alone."""

    cases: NonNegativeInt
    named: NonNegativeInt


class EmptyCases(Document):
    """Cases without an effect, and those of them in which one was named."""

    cases: NonNegativeInt
    false_alarms: NonNegativeInt


class TrialRecord(Document):
    """Scores of a trial of one simulator, as its file has them."""

    format: Literal["jointlab-structure-trial/1"] = "jointlab-structure-trial/1"
    simulator: str
    seed: int
    cases: NonNegativeInt
    strong: StrongCases
    none: EmptyCases
    longest_seconds: NonNegativeFloat

    @model_validator(mode="after")
    def _parts_within_wholes(self) -> Self:
        if self.strong.named > self.strong.cases or self.none.false_alarms > self.none.cases:
            raise ValueError("more cases are counted than there are")
        return self


def try_cases(
    simulator: Simulator,
    curves: Sequence[Curve],
    cases: int,
    seed: int,
    effects: Sequence[StructureEffect] | None = None,
    done: Callable[[int], None] | None = None,
) -> list[CaseScore]:
    """Draw cases and diagnose each.

    Args:
        simulator: of the structure.
        curves: whose conditions and deviations the cases have; their values are not used.
        cases: how many.
        seed: which.
        effects: candidates; those of the simulator by default.
        done: called with 1 after each.

    Raises:
        AnalysisError: the simulator fails, or no case of it can be predicted.
    """
    check_simulator(simulator)
    offered, _ = usable(effects_offered_by(simulator, curves) if effects is None else effects)
    candidates = showing(offered, curves)
    named = [each for each in candidates if not each.law_free]
    found = []
    for number in range(cases):
        random = np.random.default_rng([seed, number])
        truth, drawn, strength = _drawn(simulator, curves, named, random)
        answer = diagnose_curves(simulator, drawn, candidates)
        first = answer.ranking[0].probability if answer.ranking else 0.0
        found.append(CaseScore(truth, strength, answer.effects, answer.status, first, answer.seconds))
        if done is not None:
            done(1)
    return found


def _drawn(
    simulator: Simulator, curves: Sequence[Curve], effects: Sequence[StructureEffect], random: np.random.Generator
) -> tuple[str, list[Curve], float]:
    """A case: id of its effect, its curves, and how clearly they show that something is missing."""
    for _ in range(DRAWS):
        ids = sorted({each.id for each in effects})
        chosen = "" if random.random() < NONE_SHARE or not ids else str(random.choice(ids))
        own = [each for each in effects if each.id == chosen]
        effect = own[int(random.integers(len(own)))] if own else None
        try:
            exact = _readings(simulator, curves, effect, random)
        except AnalysisError:
            continue  # such a structure does not exist, as one whose response has no steady state
        likelihood = CurveLikelihood(simulator, (), tuple(exact))
        strength = float(np.sqrt(max(fit_curves(likelihood, np.zeros(likelihood.unknowns)).chi_square, 0.0)))
        return chosen, [_noisy(each, random) for each in exact], strength
    raise AnalysisError(f"simulator {simulator.name} could predict none of {DRAWS} drawn cases")


def _readings(
    simulator: Simulator, curves: Sequence[Curve], effect: StructureEffect | None, random: np.random.Generator
) -> list[Curve]:
    shared = CurveLikelihood(simulator, () if effect is None else (effect,), tuple(curves))
    scores = np.clip(0.7 * random.standard_normal(shared.unknowns), -2.0, 2.0)
    without = CurveLikelihood(simulator, (), tuple(curves))
    plain = np.delete(scores, range(len(without.parameters), len(shared.parameters)))
    if effect is not None:
        first = len(without.parameters)
        for place, parameter in enumerate(effect.parameters, start=first):
            size = random.uniform(*SIZES)
            scores[place] = size if np.isfinite(parameter.least) or random.random() < 0.5 else -size
    found = []
    for curve in curves:
        base, whole = without.predict(plain, curve), shared.predict(scores, curve)
        error = LAW_ERROR * _smooth(curve, random)
        exact = effect is None or effect.form_is_known
        values = whole if exact else base + (whole - base) * (1 + error)
        if not np.all(np.isfinite(values)):
            raise AnalysisError(f"no finite readings of {curve.name}")
        found.append(replace(curve, values=values * (1 + MODEL_ERROR * _smooth(curve, random))))
    return found


def _smooth(curve: Curve, random: np.random.Generator) -> Real:
    """(n,) a smooth random function along a curve, of rms one about."""
    phase = np.linspace(0.0, np.pi, curve.values.size)
    return np.asarray(sum(random.standard_normal() * np.cos(order * phase) for order in range(4)) / 2)


def _noisy(curve: Curve, random: np.random.Generator) -> Curve:
    deviation = np.where(curve.counted, curve.deviation, 0.0)
    real, imaginary = deviation * random.standard_normal((2, curve.values.size))
    return replace(curve, values=curve.values + real + (1j * imaginary if curve.is_complex else 0.0))


def trial_document(found: Sequence[CaseScore], simulator: str, seed: int) -> dict[str, Any]:
    """Scores as JSON, which `gap diagnose --record` takes."""
    strong = [each for each in found if each.truth and each.strength >= STRONG]
    empty = [each for each in found if not each.truth]
    return TrialRecord(
        simulator=simulator,
        seed=seed,
        cases=len(found),
        strong=StrongCases(cases=len(strong), named=sum(each.answer == (each.truth,) for each in strong)),
        none=EmptyCases(cases=len(empty), false_alarms=sum(bool(each.answer) for each in empty)),
        longest_seconds=max((each.seconds for each in found), default=0.0),
    ).model_dump(mode="json")


def read_record(path: Path, simulator: str) -> dict[str, Any]:
    """Scores of a trial.

    Raises:
        JointlabError: the file cannot be read, has none or only some, or has those of another simulator.
    """
    try:
        record = TrialRecord.model_validate_json(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise JointlabError(f"{path} cannot be read as scores of a trial: {error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the whole"
        raise JointlabError(f"{path} has no scores of `jointlab gap trial --model`: {where}: {first['msg']}") from error
    if record.simulator != simulator:
        raise JointlabError(f"{path} is of the simulator {record.simulator!r}, not of {simulator!r}")
    return record.model_dump(mode="json")
