"""`gap investigate`: diagnose, ask for the most informative experiment, diagnose again."""

import sys
from collections.abc import Mapping
from math import isfinite
from pathlib import Path

import typer

from api.commands.sequences import carry_out
from api.commands.terminal import open_catalogue, out, progress_bar, run_number, show_table
from jointlab.diagnosis.investigation import Answer, Asked, Budget, Data, Investigation, Load, Readings, Refused
from jointlab.diagnosis.investigation_folder import Experimenter, answered, begun, investigate, stored
from jointlab.diagnosis.investigation_text import (
    asked_text,
    how_to_answer,
    last_sentence,
    missing_sentences,
    read_value,
    steps_table,
)
from jointlab.diagnosis.reading_text import reading_label
from jointlab.errors import JointlabError
from jointlab.sequences.of_run import sequence_for_experiment
from jointlab.sequences.wording import step_text, total_text
from jointlab.settings import load_settings
from jointlab.supervision.stored_limits import stored_limits
from rig.tester.limits import TesterLimits
from store.provenance import who_is_here


class Later:
    """A person who brings files and readings with a later call."""

    def carry_out(self, _asked: Asked) -> Answer | None:
        """None: the answer comes later."""
        return None


class OnRig:
    """The rig of this configuration: each sequence runs when the operator consents.

    Attributes:
        run: whose sequence and article further ones are made of.
    """

    def __init__(self, run: int) -> None:
        self.run = run

    def carry_out(self, asked: Asked) -> Answer | None:
        """Data of a run, readings that are typed in, or a refusal; None where there is nobody to consent."""
        if not sys.stdin.isatty():
            return None
        out.print(asked_text(asked), markup=False)
        return self._read(asked) if asked.readings else self._measured(asked)

    def _read(self, asked: Asked) -> Answer:
        typed = {name: _typed_value(name, unit) for name, unit in asked.readings.items()}
        values = {name: value for name, value in typed.items() if value is not None}
        return Readings(values) if values else Refused("not read")

    def _measured(self, asked: Asked) -> Answer:
        settings = load_settings()
        with open_catalogue(settings) as catalogue:
            limits = stored_limits(catalogue, settings.rig) or TesterLimits()
            sequence = catalogue.read(sequence_for_experiment, self.run, asked.experiment, limits)
            for number, step in enumerate(sequence.steps, start=1):
                out.print(f"{number}. {step_text(step)}", markup=False)
            out.print(total_text(sequence.steps))
            if not typer.confirm("run this sequence on the rig now?"):
                return Refused("the operator did not consent")
            return Data(str(carry_out(settings, catalogue, sequence, lambda rig: rig.run(sequence, who_is_here()))))


def _typed_value(name: str, unit: str) -> float | None:
    """A reading that is typed in, asked for again until it is a number; None where it was not read."""

    def value(text: str) -> float | None:
        try:
            number = float(text) if text.strip() else None
        except ValueError as error:
            raise typer.BadParameter(f"{text!r} is no number") from error
        if number is not None and not isfinite(number):
            raise typer.BadParameter(f"{text} is no number to weigh")
        return number

    label = f"{reading_label(name, unit)}, empty if not read"
    found: float | None = typer.prompt(label, default="", show_default=False, value_proc=value)
    return found


def investigate_target(
    target: str, load: Load, folder: Path, given: Answer | None, limits: Mapping[str, float], *, on_rig: bool
) -> None:
    """Store an answer, go on as far as possible, and show all steps; limits that are not given stay as they are."""
    present = stored(folder)
    if given is not None:
        if present is None:
            raise JointlabError(f"{folder} holds no investigation that waits for an answer; begin it without one")
        answered(folder, begun(folder, target, None), given, load)
    before = Budget() if present is None else present.budget
    budget = Budget(**{**vars(before), **limits}) if limits else None
    show(investigate(folder, target, _laboratory(target, on_rig=on_rig), load, budget, progress_bar))


def _laboratory(target: str, *, on_rig: bool) -> Experimenter:
    if not on_rig:
        return Later()
    run = run_number(target)
    if run is None:
        raise JointlabError(f"--rig needs a run that was measured or imported, not {target}: import the bundle first")
    return OnRig(run)


def answer_of(data: str | None, readings: list[str], refusal: str | None) -> Answer | None:
    """The answer that options give.

    Raises:
        JointlabError: there are several, or a reading is no NAME=VALUE.
    """
    values = dict(map(read_value, readings))
    given: list[Answer] = []
    if data is not None:
        given.append(Data(data))
    if values:
        given.append(Readings(values))
    if refusal is not None:
        given.append(Refused(refusal))
    if len(given) > 1:
        raise JointlabError("an experiment has one answer: --data, --reading or --refuse")
    return given[0] if given else None


def show(state: Investigation) -> None:
    """All steps on one screen."""
    show_table(steps_table(state))
    for each in missing_sentences(state):
        out.print(each, markup=False)
    out.print(last_sentence(state), style="bold")
    if state.open_request is not None:
        out.print(how_to_answer(state.open_request))
