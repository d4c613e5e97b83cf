"""An investigation in a folder, one stored step after the other.

A laboratory answers at once or later: every step is stored before and after, so the same call goes on where the last
one ended.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Protocol

from pydantic import ValidationError

from analysis.gap.experiments.joined_measurements import check_same_bench
from jointlab.diagnosis.investigation import (
    FORMAT,
    INVESTIGATION,
    Answer,
    Asked,
    Budget,
    Data,
    Investigation,
    Load,
    all_data,
    diagnosed_together,
    joined,
    next_step,
    step_after_refusal,
    with_answer,
    with_budget,
    with_missing,
    with_step,
)
from jointlab.diagnosis.pipeline import Diagnosed
from jointlab.errors import JointlabError
from store.progress import Progress, silent

FILE = "investigation.json"


class Experimenter(Protocol):
    """Carries out experiments: a person with files, the rig, or a simulated bench."""

    def carry_out(self, asked: Asked) -> Answer | None:
        """The answer to a request; None where it comes later."""


def investigate(
    folder: Path,
    target: str,
    laboratory: Experimenter,
    load: Load,
    budget: Budget | None = None,
    progress: Progress = silent,
    workers: int | None = None,
) -> Investigation:
    """Begin an investigation or go on with it, until it ends or the laboratory owes an answer.

    Args:
        folder: for the files ``investigation.json``, and ``diagnosis_1.json`` and so on, one for each step.
        target: the first data.
        laboratory: carries out experiments.
        load: reads data.
        budget: of all steps; None keeps the budget that a stored investigation has.
        progress: shows how far a diagnosis is.
        workers: processes that share a diagnosis.

    Raises:
        JointlabError: the folder holds another investigation, or cannot be written.
        StoreError, AnalysisError: data cannot be read or diagnosed; the step stays open.
    """
    state = begun(folder, target, budget)
    if state.steps and state != stored(folder):
        save(folder, state)  # the budget holds for later calls, too, which may not name it
    found: Diagnosed | None = None
    without = state.absent
    while True:
        if not state.steps or state.steps[-1].answer is not None:
            step = step_after_refusal(state)
            if step is None:
                if found is None or isinstance(state.steps[-1].answer, Data) or state.absent != without:
                    without = state.absent
                    _check_writable(folder)
                    found = diagnosed_together(state, load, progress, workers)
                    _write(folder / f"diagnosis_{len(state.steps) + 1}.json", found.document)
                step = next_step(state, found.diagnosis)
            state = with_step(state, step)
            save(folder, state)
        last = state.steps[-1]
        if last.ended or last.asked is None:
            return state
        answer = laboratory.carry_out(last.asked)
        if answer is None:
            return state
        state = answered(folder, state, answer, load)


def answered(folder: Path, state: Investigation, answer: Answer, load: Load) -> Investigation:
    """Store the answer to the open step, once it is checked.

    Raises:
        JointlabError: nothing is asked for, a reading was not asked for or is no number, or the data have nothing of
            what was asked for.
        StoreError, AnalysisError: the data cannot be read, are not of this bench, or are among the first ones.
    """
    after = with_answer(state, answer, str(folder))
    if isinstance(answer, Data):
        before, further = all_data(state, load).measurement, load(answer.source).measurement
        check_same_bench(before.drawing, further.drawing)
        after = with_missing(after, before, further)
        joined(before, further)
    save(folder, after)
    return after


def begun(folder: Path, target: str, budget: Budget | None) -> Investigation:
    """The stored investigation, with another budget if one is given, or a new one.

    Raises:
        JointlabError: the folder holds another investigation.
    """
    state = stored(folder)
    if state is None:
        return Investigation(target, budget or Budget())
    if state.target != target:
        raise JointlabError(f"{folder} holds an investigation of {state.target}, not of {target}; name a new folder")
    return state if budget is None else with_budget(state, budget)


def stored(folder: Path) -> Investigation | None:
    """The investigation in a folder; None where there is none.

    Raises:
        JointlabError: its file is damaged, or of another version.
    """
    file = folder / FILE
    if not file.exists():
        return None
    try:
        found = INVESTIGATION.validate_json(file.read_bytes())
    except (OSError, ValidationError) as error:
        raise JointlabError(f"{file} is not a stored investigation: {error}") from error
    if found.format != FORMAT:
        raise JointlabError(f"{file} is in the format {found.format}; this version reads {FORMAT}: name a new folder")
    return found


def save(folder: Path, state: Investigation) -> None:
    """Store an investigation; if writing fails, the old file stays.

    Raises:
        JointlabError: it cannot be written.
    """
    _write(folder / FILE, asdict(state))


def _check_writable(folder: Path) -> None:
    """Do nothing where files can be written, before a diagnosis that takes minutes; JointlabError where they cannot."""
    scratch = folder / f"{FILE}.part"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        scratch.touch()
        scratch.unlink()
    except OSError as error:
        raise JointlabError(f"{folder} cannot be written: {error.strerror or error}; name another folder") from error


def _write(file: Path, document: Mapping[str, Any]) -> None:
    scratch = file.with_name(file.name + ".part")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        scratch.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
        scratch.replace(file)
    except OSError as error:
        raise JointlabError(f"{file} cannot be written: {error.strerror or error}") from error
