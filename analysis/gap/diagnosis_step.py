"""What a diagnosis tells while it works: its steps, and a first answer that later ones refine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np

from analysis.gap.evidence.fitted import AnyModel
from analysis.gap.evidence.verdict import UNKNOWN, Weighed


class Stage(StrEnum):
    """The work of a diagnosis, in order."""

    FAULTS = "faults"
    """Looking for faults of the measurement."""
    BASELINE = "baseline"
    """Fitting the simulation without effects."""
    SINGLE_EFFECTS = "single_effects"
    FURTHER_EFFECTS = "further_effects"
    ALL_LINES = "all_lines"
    """Weighing the best explanations on all lines."""
    HELD_OUT = "held_out"
    """Measuring gaps on data that fits did not see."""
    REMAINDER = "remainder"
    """Looking for the shape of what is left."""
    DONE = "done"


@dataclass(frozen=True)
class FirstAnswer:
    """The leading explanation of a search that is not over. It has no probability: held-out data did not confirm it.

    Attributes:
        effects: ids; empty for none, ("unknown",) for a cause in no catalogue.
        explained: share of the misfit beyond noise that these effects remove, 0 to 1. Effects that records show remove
            none.
    """

    effects: tuple[str, ...]
    explained: float


@dataclass(frozen=True)
class DiagnosisStep:
    """A step that begins.

    Attributes:
        stage: what is done.
        share: of the whole that is done before, 0 to 1; it never falls.
        first: the newest first answer; None before the first round of the search.
    """

    stage: Stage
    share: float
    first: FirstAnswer | None = None


StepListener = Callable[[DiagnosisStep], None]


def ignore_step(step: DiagnosisStep) -> None:
    """Tell nobody."""
    del step


@dataclass(eq=False)
class StepReport:
    """Tells steps, each with the newest first answer.

    Attributes:
        tell: called with each step.
        in_records: ids of effects that records show, whatever the search finds.
        step: the latest one.
    """

    tell: StepListener = ignore_step
    in_records: tuple[str, ...] = ()
    step: DiagnosisStep = DiagnosisStep(Stage.FAULTS, 0.0)

    def begin(self, stage: Stage, share: float) -> None:
        """Tell of a step, at the share of the whole that is done."""
        self.step = replace(self.step, stage=stage, share=share)
        self.tell(self.step)

    def answer(self, found: Weighed[Any], none: AnyModel) -> None:
        """Keep an explanation as the first answer of the steps that follow; `none` is the model without effects."""
        effects = () if found.effects == UNKNOWN and self.in_records else found.effects
        explained = explained_share(found.model, none) if effects not in ((), UNKNOWN) else 0.0
        self.step = replace(self.step, first=FirstAnswer((*effects, *self.in_records), explained))


def explained_share(model: AnyModel, none: AnyModel) -> float:
    """Share of the misfit beyond noise of `none` that a model removes, 0 to 1."""
    gap = none.misfit.certain
    return 1.0 if gap == 0.0 else float(np.clip(1 - model.misfit.certain / gap, 0.0, 1.0))
