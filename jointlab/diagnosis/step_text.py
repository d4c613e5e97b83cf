"""What a diagnosis does now, and its first answer, in words."""

from collections.abc import Callable, Mapping

from analysis.gap.diagnosis_step import DiagnosisStep, FirstAnswer, Stage
from analysis.gap.evidence.verdict import UNKNOWN
from jointlab.diagnosis.wording import RECORD_EFFECTS, named

DOING: Mapping[Stage, str] = {
    Stage.FAULTS: "looking for faults of the measurement",
    Stage.BASELINE: "fitting the simulation without effects",
    Stage.SINGLE_EFFECTS: "trying single effects",
    Stage.FURTHER_EFFECTS: "trying further effects",
    Stage.ALL_LINES: "weighing the best on all lines",
    Stage.HELD_OUT: "measuring the gap on held-out data",
    Stage.REMAINDER: "looking for the shape of what is left",
}
NEARLY_ALL = 0.99
"""Share of the misfit from which a first answer says no number: it is not final."""


def step_text(step: DiagnosisStep, title_of: Callable[[str], str]) -> str:
    """A step in words, with the first answer if there is one; empty when all is done."""
    if step.stage is Stage.DONE:
        return ""
    doing = DOING[step.stage]
    return doing if step.first is None else f"first answer, not final: {_answer(step.first, title_of)}; {doing}"


def _answer(first: FirstAnswer, title_of: Callable[[str], str]) -> str:
    if not first.effects:
        return "nothing beyond noise and stated tolerances"
    if first.effects == UNKNOWN:
        return "a cause in no catalogue"
    effects = named(first.effects, {each: title_of(each) for each in first.effects})
    if set(first.effects) <= RECORD_EFFECTS:
        return f"{effects} in the records of blows"
    explain = "explains" if len(first.effects) == 1 else "explain"
    share = "nearly all" if first.explained > NEARLY_ALL else f"{100 * first.explained:.0f} %"
    return f"{effects}, {explain} {share} of the misfit"
