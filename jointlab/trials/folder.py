"""The files of a trial: commitments, seals, answers, judgements. A trial that was killed continues from them."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jointlab.errors import JointlabError
from jointlab.trials.plan import Planned
from simlab.case.bundle import commitment, sealed, truth

TRIAL, COMMITMENTS = "trial.json", "commitments.json"
ARRAYS = ("predicted", "fitted")
"""Accelerances of an answer: for the rows asked for, and for those that were measured."""


@dataclass(frozen=True)
class TrialFolder:
    """The folder of one trial.

    ``commitments.json`` is complete before anything is diagnosed; ``sealed/`` holds what it commits to and is read
    again when a case has been answered. Bundles are kept elsewhere, and a worker gets its bundle alone.
    """

    path: Path

    def begin(self, settings: dict[str, Any]) -> None:
        """Make the folder, or find it as a trial with the same settings left it.

        Raises:
            JointlabError: it holds another trial, or cannot be made.
        """
        try:
            for name in ("sealed", "answers", "judged"):
                (self.path / name).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise JointlabError(f"{self.path} cannot be made: {error.strerror or error}") from error
        file = self.path / TRIAL
        if file.exists() and (found := read(file)) != settings:
            raise JointlabError(
                f"{self.path} holds another trial: {found}, not {settings}; go on with that one or name a new folder"
            )
        write(file, settings)

    @property
    def commitments(self) -> dict[str, str]:
        """SHA-256 of every case by name; empty before they are made."""
        file = self.path / COMMITMENTS
        return dict(read(file)) if file.exists() else {}

    def seal(self, case: Planned) -> str:
        """Draw a case, keep its truth sealed and return the commitment; a case that was sealed keeps its seal."""
        file = self._seal(case)
        if not file.exists():
            write(file, sealed(truth(case.draw())))
        return commitment(read(file))

    def commit(self, commitments: dict[str, str]) -> None:
        """Write all commitments at once."""
        write(self.path / COMMITMENTS, commitments)

    def open(self, case: Planned) -> dict[str, Any]:
        """The truth of a case that has been answered.

        Raises:
            JointlabError: it has not been answered, or its seal is not what was committed to.
        """
        if not self.answer_file(case).exists():
            raise JointlabError(f"case {case.name} has not been answered: its seal stays closed")
        seal = read(self._seal(case))
        if commitment(seal) != self.commitments.get(case.name):
            raise JointlabError(
                f"the seal of case {case.name} is not the one that was committed to: its truth was changed"
            )
        truth: dict[str, Any] = seal["truth"]
        return truth

    def answer_file(self, case: Planned) -> Path:
        """Path of the answer to a case."""
        return self.path / "answers" / f"{case.name}.json"

    def keep(self, case: Planned, answer: dict[str, Any]) -> None:
        """Keep an answer; its accelerances go beside the document."""
        file = self.answer_file(case)
        for name in ARRAYS:
            if (arrays := answer.pop(name, None)) is not None:
                np.savez_compressed(file.with_suffix(f".{name}.npz"), **arrays)
        write(file, answer)

    def answer(self, case: Planned) -> dict[str, Any] | None:
        """The answer to a case, with its accelerances in ``predicted`` and ``fitted``; None where there is none yet."""
        file = self.answer_file(case)
        if not file.exists():
            return None
        found: dict[str, Any] = read(file)
        for name in ARRAYS:
            if (arrays := file.with_suffix(f".{name}.npz")).exists():
                with np.load(arrays) as archive:
                    found[name] = dict(archive)
        return found

    def judgement_file(self, case: Planned) -> Path:
        """Path of the judgement on a case."""
        return self.path / "judged" / f"{case.name}.json"

    def _seal(self, case: Planned) -> Path:
        return self.path / "sealed" / f"{case.name}.json"


def read(file: Path) -> Any:
    """A JSON file."""
    return json.loads(file.read_text(encoding="utf-8"))


def write(file: Path, document: Any) -> None:
    """Write a JSON file that is whole or not there."""
    scratch = file.with_name(file.name + ".part")
    scratch.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    scratch.replace(file)
