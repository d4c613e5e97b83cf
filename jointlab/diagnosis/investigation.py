"""An investigation: its steps, the next one, and the answers to what it asks for.

A step diagnoses all data, weighs all readings, and asks for the experiment that tells most for its time. Answers are
data, readings or a refusal. `investigation_folder` keeps an investigation as files, `jointlab.jobs.investigations` as
jobs of the service.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from functools import reduce
from math import isfinite
from typing import Literal

from pydantic import TypeAdapter

from analysis.gap.diagnosis import Diagnosis
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.verdict import UNKNOWN, Status, Weighed, confounded_effects, leading
from analysis.gap.experiments.catalogue import (
    CHANGES_THE_BENCH,
    CHECKS,
    EXPERIMENTS,
    Experiment,
    FurtherMeasurement,
    SizeCheck,
    after_readings,
)
from analysis.gap.experiments.expected_data import readable_names, reading_of
from analysis.gap.experiments.joined_measurements import check_new, together
from analysis.gap.experiments.next_experiment import NextExperiment, experiments_in_turn
from analysis.gap.experiments.requested_data import Missing, compared
from analysis.gap.fitting.model import Model
from analysis.gap.measurement import Measurement
from jointlab.diagnosis.experiment_text import request, sentence
from jointlab.diagnosis.load import Subject
from jointlab.diagnosis.missing_text import missing_text
from jointlab.diagnosis.pipeline import Diagnosed, diagnosed
from jointlab.diagnosis.reading_text import reading_unit
from jointlab.diagnosis.rig_time import rig_time
from jointlab.errors import ConflictError, JointlabError
from store.progress import Progress, silent

FORMAT = "jointlab-investigation/1"
SHOWN_BESIDE = 2
"""The number of explanations beside the leading one that a step keeps."""
UNSEEN = 2.0
"""Standard deviations of a reading up to which an effect counts as absent; the next diagnosis then leaves it out."""
End = Literal["certain", "nothing would help", "budget"]


@dataclass(frozen=True)
class Budget:
    """The limits of an investigation.

    Attributes:
        minutes: largest rig time, as `jointlab.diagnosis.rig_time` expects it.
        experiments: largest number of experiments that are carried out.
        certain: probability of the verdict at which the investigation ends.
    """

    minutes: float = 240.0
    experiments: int = 3
    certain: float = 0.95


@dataclass(frozen=True)
class Data:
    """An answer: further data of the same bench. `source` is a bundle or the number of a run."""

    source: str


@dataclass(frozen=True)
class Readings:
    """An answer: readings of an instrument by name, "EFFECT.PARAMETER", in the units of `Asked.readings`."""

    values: dict[str, float]


@dataclass(frozen=True)
class Refused:
    """An answer: the experiment cannot be made."""

    reason: str


Answer = Data | Readings | Refused


@dataclass(frozen=True)
class Asked:
    """An experiment that is asked for.

    Attributes:
        experiment: with the information to expect and its minutes.
        text: a request with its purpose.
        readings: names of the readings that a check gives, with their units; empty where data are wanted.
    """

    experiment: NextExperiment
    text: str
    readings: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Probable:
    """An explanation by the ids of its effects, with its probability after all readings."""

    effects: tuple[str, ...]
    probability: float


@dataclass(frozen=True)
class Step:
    """One step of an investigation.

    Attributes:
        number: from 1.
        status: of the diagnosis of all data, before readings.
        effects, probability: of the leading explanation, after readings.
        asked: the experiment; None in the last step.
        answer: of the laboratory; None until it comes.
        ended: why it is the last step.
        beside: the next probable explanations, at most `SHOWN_BESIDE`.
        diagnosis: number of the stored diagnosis of all data; None where it is a file.
        otherwise: what is asked for in turn, where the experiment and those before it cannot be made; only of the last
            step, and empty where it was stored by an older version.
        missing: what was asked for and is not in the data that answer it.
    """

    number: int
    status: Status
    effects: tuple[str, ...]
    probability: float
    asked: Asked | None = None
    answer: Answer | None = None
    ended: End | None = None
    beside: tuple[Probable, ...] = ()
    diagnosis: int | None = None
    otherwise: tuple[Asked, ...] = ()
    missing: tuple[Missing, ...] = ()


@dataclass(frozen=True)
class Investigation:
    """All steps of an investigation.

    Attributes:
        target: the first data, a bundle or the number of a run.
        budget: for all steps.
        steps: the last of them may wait for an answer.
    """

    target: str
    budget: Budget
    steps: tuple[Step, ...] = ()
    format: str = FORMAT

    @property
    def open_request(self) -> Asked | None:
        """The experiment that has no answer yet; None where nothing is asked for."""
        last = self.steps[-1] if self.steps else None
        return None if last is None or last.answer is not None else last.asked

    @property
    def made(self) -> tuple[NextExperiment, ...]:
        """Experiments that were carried out."""
        return tuple(
            each.asked.experiment
            for each in self.steps
            if each.asked is not None and isinstance(each.answer, Data | Readings)
        )

    @property
    def minutes(self) -> float:
        """Rig time that was spent, minutes."""
        return sum(each.minutes for each in self.made)

    @property
    def sources(self) -> tuple[str, ...]:
        """Sources of all data, the first data first."""
        return (self.target, *(each.answer.source for each in self.steps if isinstance(each.answer, Data)))

    @property
    def readings(self) -> tuple[tuple[Experiment, dict[str, float]], ...]:
        """Readings of all checks."""
        return tuple(
            (each.asked.experiment.id, each.answer.values)
            for each in self.steps
            if each.asked and isinstance(each.answer, Readings)
        )

    @property
    def absent(self) -> frozenset[str]:
        """Ids of effects that every reading found within `UNSEEN` standard deviations of zero, if none is missing.

        A joint that was not measured may be off where the others are not.
        """
        sizes, missing = dict[str, list[float]](), self._unread
        for check, values in self.readings:
            for name, value in values.items():
                reading = reading_of(name, CHECKS[check].readings)
                if reading is not None:
                    sizes.setdefault(reading.effect, []).append(abs(value) / reading.deviation)
        return frozenset(each for each, found in sizes.items() if max(found) < UNSEEN and each not in missing)

    @property
    def _unread(self) -> frozenset[str]:
        """Ids of effects of which a reading that was asked for did not come."""
        checks = [each for each in self.steps if each.asked and isinstance(each.answer, Readings)]
        wanted = {name for each in checks if each.asked for name in each.asked.readings}
        read = {name for _, values in self.readings for name in values}
        return frozenset(name.partition(".")[0] for name in wanted - read)

    def untested(self, effects: Collection[str]) -> frozenset[str]:
        """The given effects that no instrument read, if no further data were taken either.

        The first data alone do not say how wrong a weighing is, so no such effect counts as certain.
        """
        read = {name.partition(".")[0] for _, values in self.readings for name in values}
        return frozenset() if len(self.sources) > 1 else frozenset(effects) - read

    @property
    def remaining_experiments(self) -> tuple[SizeCheck | FurtherMeasurement, ...]:
        """Experiments that may still be asked for: none that was asked for before, and none that changes the bench."""
        asked = {each.asked.experiment.id for each in self.steps if each.asked}
        return tuple(each for each in EXPERIMENTS if each.id not in asked and each.id not in CHANGES_THE_BENCH)


INVESTIGATION = TypeAdapter(Investigation)


Load = Callable[[str], Subject]
"""Function that reads a bundle or a run."""


def diagnosed_together(
    state: Investigation, load: Load, progress: Progress = silent, workers: int | None = None
) -> Diagnosed:
    """The diagnosis of all data, without the effects that readings have refuted.

    Raises:
        StoreError, AnalysisError: data cannot be read or diagnosed, or are not of one bench.
    """
    return diagnosed(all_data(state, load), state.absent, progress, workers)


def with_answer(state: Investigation, answer: Answer, name: str) -> Investigation:
    """The investigation with the answer to its open request; data are not looked at.

    Args:
        state: with the open request.
        answer: to it.
        name: of the investigation in an error.

    Raises:
        ConflictError: nothing is asked for.
        JointlabError: a reading was not asked for or is no number, or data were diagnosed before.
    """
    asked = state.open_request
    if asked is None:
        raise ConflictError(f"{name} has no open question; continue the investigation first, without an answer")
    wanted = asked.readings
    if isinstance(answer, Data) and wanted:
        raise JointlabError(f"the open question is answered by readings; give {', '.join(wanted)} in place of data")
    if isinstance(answer, Data) and answer.source in state.sources:
        raise JointlabError(f"{answer.source} is among the data of {name} already; name the further measurement")
    if isinstance(answer, Readings) and not (answer.values and set(answer.values) <= set(wanted)):
        given = ", ".join(answer.values) or "no reading"
        raise JointlabError(f"{given} does not answer the open question; give {', '.join(wanted) or 'data'}")
    for read, value in answer.values.items() if isinstance(answer, Readings) else ():
        if not isfinite(value):
            raise JointlabError(f"{read} is {value}, which is no number to weigh; leave out what was not read")
    return replace(state, steps=(*state.steps[:-1], replace(state.steps[-1], answer=answer)))


def with_missing(state: Investigation, before: Measurement, further: Measurement) -> Investigation:
    """The investigation with what is missing in the data that answer its last request; they may be incomplete.

    Args:
        state: answered by data.
        before: all data when they were asked for; of both measurements, only the conditions matter.
        further: the data that answer.

    Raises:
        JointlabError: nothing at all of what was asked for is there.
    """
    last = state.steps[-1]
    assert last.asked is not None
    assert isinstance(last.answer, Data)
    found = compared(last.asked.experiment.id, before, further)
    if found.nothing:
        source = last.answer.source
        raise JointlabError(
            f"{f'run {source}' if source.isdecimal() else source} has nothing of what is asked for: "
            f"{request(last.asked.experiment)}, with {missing_text(found.missing)}"
        )
    return replace(state, steps=(*state.steps[:-1], replace(last, missing=found.missing)))


def without_answer(state: Investigation) -> Investigation:
    """The investigation without the answer to its last request, which is open again."""
    if not state.steps:
        return state
    return replace(state, steps=(*state.steps[:-1], replace(state.steps[-1], answer=None, missing=())))


def next_step(state: Investigation, found: Diagnosis) -> Step:
    """The next step: the explanation by all data and readings, and the experiment to ask for."""
    weighed = after_readings(found.explanations, state.readings, UNCALIBRATED)
    verdict = leading(weighed)
    others = sorted((each for each in weighed if each is not verdict), key=lambda each: -each.probability)
    beside = tuple(Probable(each.effects, each.probability) for each in others[:SHOWN_BESIDE])
    step = Step(len(state.steps) + 1, found.status, verdict.effects, verdict.probability, beside=beside)
    if ended := _certain(state, verdict):
        return replace(step, ended=ended)
    status = Status.UNKNOWN if verdict.effects == UNKNOWN else found.status
    groups = confounded_effects(weighed)
    in_turn = experiments_in_turn(status, weighed, groups, UNCALIBRATED, rig_time(), state.remaining_experiments)
    return _asking(state, step, tuple(Asked(each, sentence(each), _wanted(each, weighed)) for each in in_turn))


def step_after_refusal(state: Investigation) -> Step | None:
    """The next step where the last request was refused: with the next of the experiments that are known already.

    A refusal tells nothing of the bench, so no diagnosis is needed. None where the answer was another one, or an older
    version stored the step without these experiments.
    """
    last = state.steps[-1] if state.steps else None
    if last is None or not last.otherwise or not isinstance(last.answer, Refused):
        return None
    return _asking(state, replace(last, number=last.number + 1, asked=None, answer=None, missing=()), last.otherwise)


def with_step(state: Investigation, step: Step) -> Investigation:
    """The investigation with one more step."""
    return replace(state, steps=(*(replace(each, otherwise=()) for each in state.steps), step))


def _asking(state: Investigation, step: Step, requests: tuple[Asked, ...]) -> Step:
    """The step with the first of the requests that the budget allows, or with the reason why it is the last one."""
    useful, left = [each for each in requests if each.experiment.information], state.budget.minutes - state.minutes
    if not useful:
        return replace(step, ended="nothing would help", otherwise=())
    first = next((each for each in useful if each.experiment.minutes <= left), None)
    if len(state.made) >= state.budget.experiments or first is None:
        return replace(step, ended="budget", otherwise=())
    return replace(step, asked=first, otherwise=tuple(each for each in requests if each is not first))


def _certain(state: Investigation, verdict: Weighed[Model]) -> End | None:
    known = verdict.effects != UNKNOWN and verdict.probability >= state.budget.certain
    return "certain" if known and state.made and state.untested(verdict.effects) == frozenset() else None


def _wanted(asked: NextExperiment, weighed: tuple[Weighed[Model], ...]) -> dict[str, str]:
    check = CHECKS.get(asked.id)
    if check is None:
        return {}
    units = {
        f"{effect.id}.{parameter.name}": parameter.unit
        for each in weighed
        for effect in each.model.effects
        for parameter in effect.parameters
    }
    return {name: reading_unit(name, units[name]) for name, _ in readable_names(weighed, check.readings)}


def all_data(state: Investigation, load: Load) -> Subject:
    """The first data and all further ones.

    Raises:
        StoreError, AnalysisError: data cannot be read, are not of one bench, or are there twice.
    """
    first, *further = (load(source) for source in state.sources)
    measurement = reduce(joined, (each.measurement for each in further), first.measurement)
    left_out = tuple(dict.fromkeys(sentence for each in (first, *further) for sentence in each.left_out))
    return Subject(first.title, measurement, left_out)


def joined(before: Measurement, further: Measurement) -> Measurement:
    """All data with further ones; AnalysisError where these are not of this bench, or are among them already."""
    both = together(before, further)
    check_new(before, further)
    return both


def with_budget(state: Investigation, budget: Budget) -> Investigation:
    """The investigation with another budget; one that had ended by its budget may go on."""
    if budget == state.budget:
        return state
    over = bool(state.steps) and state.steps[-1].ended == "budget"  # another budget may let it go on
    return replace(state, budget=budget, steps=state.steps[: len(state.steps) - over])
