"""How often the diagnosis of one simulator is right: cases drawn on it, under the conditions of a measurement.

Parameters come from their priors, one effect or none from the candidates. What an effect does is changed by a smooth
random share, unless its form is known, and every reading by a smooth random error. The diagnosis sees curves alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from pydantic import NonNegativeFloat, NonNegativeInt, ValidationError, model_validator

from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.gap.evidence.verdict import Status
from analysis.gap.parameter import Parameter
from analysis.gap.structures.checks import check_simulator, effects_offered_by, usable
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.diagnosis import CurveDiagnosis, diagnose_curves
from analysis.gap.structures.effect import StructureEffect, Variant, label_of, showing, variant_of
from analysis.gap.structures.likelihood import CurveLikelihood, fit_curves
from analysis.gap.structures.search import Failure
from analysis.gap.structures.simulator import Simulator
from analysis.gap.structures.smooth_error import HALF_NORMAL
from jointlab.errors import JointlabError
from rig.document import Document

NONE_SHARE = 0.25
"""Share of the cases without any effect."""
SIZES = (0.3, 1.5)
"""Standard deviations of its prior, between which an effect's parameters lie."""
LAW_ERROR, MODEL_ERROR = 0.05, HALF_NORMAL
"""Rms of the smooth random change of what an effect does, unless its form is known, and of a reading; both relative."""
STRONG = 5.0
"""Standard deviations by which data show that the simulation lacks something, from which it is to be named."""
DRAWS = 50
"""Draws of a case at most, until one can be predicted."""
SAME = 1e-6
"""Share by which the prior of a parameter may differ from that of a record."""


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
        label: id and law of its effect.
        variant: place, part or sensor of its effect.
        reported: variants of the verdict's effect, between which the data do not decide.
        failures: candidates that failed in its diagnosis.
        not_drawn: effects that were to be in it, and could not be predicted.
    """

    truth: str
    strength: float
    answer: tuple[str, ...]
    status: Status
    probability: float
    seconds: float
    label: str = ""
    variant: Variant = field(default_factory=dict)
    reported: tuple[Variant, ...] = ()
    failures: tuple[Failure, ...] = ()
    not_drawn: tuple[Failure, ...] = ()

    @property
    def named(self) -> bool:
        """Whether the verdict is its effect alone, at its place where it has one."""
        return self.answer == (self.truth,) and any(_agree(self.variant, each) for each in self.reported)


def _agree(one: Variant, other: Variant) -> bool:
    """Whether fields that both have are the same; laws of one effect may have different fields."""
    return all(one[name] == other[name] for name in one.keys() & other.keys())


class Prior(Document):
    """Prior of a parameter of the simulator."""

    name: str
    centre: float
    spread: float

    def is_of(self, parameter: Parameter) -> bool:
        """Whether a parameter has this prior."""
        own = (parameter.centre, parameter.spread)
        return self.name == parameter.name and bool(np.allclose((self.centre, self.spread), own, rtol=SAME, atol=0.0))


class FailedEffect(Document):
    """An effect that failed in every case."""

    effect: str
    reason: str


class StrongCases(Document):
    """Cases with an effect that is clearly there, and those of them in which it was named alone, at its place."""

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
    parameters: tuple[Prior, ...]
    effects: tuple[str, ...]
    failures: tuple[FailedEffect, ...] = ()
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
        case = _drawn(simulator, curves, named, random)
        answer = diagnose_curves(simulator, case.curves, candidates)
        found.append(_score(case, answer))
        if done is not None:
            done(1)
    return found


@dataclass(frozen=True, eq=False)
class _Case:
    """A drawn case: its effect, its curves, how clearly they show that something is missing, and draws that failed."""

    effect: StructureEffect | None
    curves: list[Curve]
    strength: float
    not_drawn: tuple[Failure, ...]


def _score(case: _Case, answer: CurveDiagnosis) -> CaseScore:
    ids, effect = answer.effects, case.effect
    verdict = next((each for each in answer.ranking if each.effects == ids), None)
    alone = ids[0] if len(ids) == 1 else None
    return CaseScore(
        truth="" if effect is None else effect.id,
        strength=case.strength,
        answer=ids,
        status=answer.status,
        probability=answer.ranking[0].probability if answer.ranking else 0.0,
        seconds=answer.seconds,
        label="" if effect is None else label_of(effect),
        variant={} if effect is None else variant_of(effect),
        reported=() if alone is None or verdict is None else answer.alike.get(alone, (verdict.variants[alone],)),
        failures=answer.failures,
        not_drawn=case.not_drawn,
    )


def never_tried(found: Sequence[CaseScore]) -> list[Failure]:
    """Effects that failed in the diagnosis of every case, or in every draw of them."""
    drawn, in_all = {each.label for each in found}, dict[str, Failure]()
    for each in found[0].failures if found else ():
        if all(each.effect in {other.effect for other in case.failures} for case in found):
            in_all.setdefault(each.effect, each)
    for case in found:
        for each in case.not_drawn:
            if each.effect not in drawn:
                in_all.setdefault(each.effect, each)
    return list(in_all.values())


def _drawn(
    simulator: Simulator, curves: Sequence[Curve], effects: Sequence[StructureEffect], random: np.random.Generator
) -> _Case:
    """A case that can be predicted."""
    failed = list[Failure]()
    for _ in range(DRAWS):
        ids = sorted({each.id for each in effects})
        chosen = "" if random.random() < NONE_SHARE or not ids else str(random.choice(ids))
        own = [each for each in effects if each.id == chosen]
        effect = own[int(random.integers(len(own)))] if own else None
        try:
            exact = _readings(simulator, curves, effect, random)
        except AnalysisError as error:  # such a structure does not exist, as one whose response has no steady state
            if effect is not None:
                failed.append(Failure(label_of(effect), str(error)))
            continue
        likelihood = CurveLikelihood(simulator, (), tuple(exact), smooth_error=MODEL_ERROR)
        strength = float(np.sqrt(max(fit_curves(likelihood, np.zeros(likelihood.unknowns)).chi_square, 0.0)))
        return _Case(effect, [_noisy(each, random) for each in exact], strength, tuple(failed))
    last = f"; the last error: {failed[-1].reason}" if failed else ""
    raise AnalysisError(f"simulator {simulator.name} could predict none of {DRAWS} drawn cases{last}")


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


def trial_document(
    found: Sequence[CaseScore], simulator: Simulator, effects: Sequence[StructureEffect], seed: int
) -> dict[str, Any]:
    """Scores as JSON, which `gap diagnose --record` takes; `effects` are the candidates."""
    strong = [each for each in found if each.truth and each.strength >= STRONG]
    empty = [each for each in found if not each.truth]
    return TrialRecord(
        simulator=simulator.name,
        parameters=tuple(
            Prior(name=each.name, centre=each.centre, spread=each.spread) for each in _parameters_of(simulator)
        ),
        effects=_ids_of(effects),
        failures=tuple(FailedEffect(effect=each.effect, reason=each.reason) for each in never_tried(found)),
        seed=seed,
        cases=len(found),
        strong=StrongCases(cases=len(strong), named=sum(each.named for each in strong)),
        none=EmptyCases(cases=len(empty), false_alarms=sum(bool(each.answer) for each in empty)),
        longest_seconds=max((each.seconds for each in found), default=0.0),
    ).model_dump(mode="json")


def _parameters_of(simulator: Simulator) -> tuple[Parameter, ...]:
    return (*simulator.parameters, *simulator.local)


def _ids_of(effects: Sequence[StructureEffect]) -> tuple[str, ...]:
    return tuple(sorted({each.id for each in effects}))


def _listed(ids: Sequence[str]) -> str:
    return ", ".join(ids) or "none"


def read_record(path: Path, simulator: Simulator, effects: Sequence[StructureEffect]) -> dict[str, Any]:
    """Scores of a trial of a simulator with these candidates.

    Raises:
        JointlabError: the file cannot be read, has none or only some, or has those of another simulator, of other
            priors of its parameters, or of other candidates.
    """
    try:
        record = TrialRecord.model_validate_json(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise JointlabError(f"{path} cannot be read as scores of a trial: {error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the whole"
        raise JointlabError(f"{path} has no scores of `jointlab gap trial --model`: {where}: {first['msg']}") from error
    if record.simulator != simulator.name:
        raise JointlabError(f"{path} is of the simulator {record.simulator!r}, not of {simulator.name!r}")
    again = "run `jointlab gap trial --model` again"
    own, ids = _parameters_of(simulator), _ids_of(effects)
    if len(own) != len(record.parameters) or not all(map(Prior.is_of, record.parameters, own)):
        raise JointlabError(f"{path} is of other parameters than simulator {simulator.name!r} has now; {again}")
    if record.effects != ids:
        raise JointlabError(
            f"{path} is of the effects {_listed(record.effects)}; this diagnosis tries {_listed(ids)}; {again}"
        )
    return record.model_dump(mode="json")
