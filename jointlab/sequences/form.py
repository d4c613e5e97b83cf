"""A sequence as the texts of a form, and back: the points, blows and sines that a technician may change."""

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from jointlab.errors import JointlabError
from rig.sequences.sequence import HammerStep, Sequence, SequenceError, SweepStep, sequence_from
from store.validation import FieldPath, fault_of, place_of, place_text

HAMMER_FIELDS = ("points", "blows")
SWEEP_FIELDS = ("specimens", "configurations", "amplitudes", "frequencies")
STEPS_OF_PART = {"hammer": {"hammer", "prompt"}, "sweep": {"sweep", "blank", "soak", "prompt"}}
"""Kinds of the steps that belong to a part of a sequence."""


def form_of(sequence: Sequence) -> dict[str, str]:
    """The texts of a form for `sequence`, by field."""
    texts = {"title": sequence.title, "article_name": sequence.article_name}
    for step in sequence.steps:
        if isinstance(step, HammerStep):
            texts |= {"points": " ".join(step.points), "blows": str(step.blows)}
        elif isinstance(step, SweepStep):
            span = step.frequencies
            texts |= {
                "specimens": " ".join(step.specimens),
                "configurations": " ".join(step.configurations),
                "amplitudes": " ".join(f"{amplitude:g}" for amplitude in step.amplitudes_pp_mm),
                "frequencies": f"{span.first:g} {span.last:g} {span.step:g}",
            }
    return texts


def sequence_of_form(base: Sequence, part: str, form: Mapping[str, str]) -> Sequence:
    """`base`, changed as a form says.

    Args:
        base: the sequence to change.
        part: of its steps that is kept: hammer or sweep, anything else for all.
        form: texts by field, as `form_of` gives them.

    Raises:
        RigError: the result cannot be measured.
        JointlabError: a text is not written as numbers.
    """
    document: dict[str, Any] = base.model_dump(mode="json", exclude_none=True)
    kinds = STEPS_OF_PART.get(part)
    steps = [step for step in document["steps"] if kinds is None or step["step"] in kinds]
    if all(step["step"] == "prompt" for step in steps):
        raise JointlabError(f"{base.title}: it has no {part} step; choose another part or another sequence")
    for step in steps:
        if step["step"] == "hammer":
            step |= {"points": form["points"].split(), "blows": _whole(form["blows"], "blows")}
        elif step["step"] == "sweep":
            step |= _sines(form)
    document |= {"title": form["title"], "article_name": form["article_name"], "steps": steps}
    try:
        return sequence_from(document, "the form")
    except SequenceError as error:
        faults = error.__cause__
        if not isinstance(faults, ValidationError):
            raise
        raise SequenceError(
            "; ".join(f"{_field(place_of(each))}: {fault_of(each)}" for each in faults.errors())
        ) from error


def _field(place: FieldPath) -> str:
    """The name of the field of a form that has a place of a sequence: that of its step, where it is in one."""
    match place:
        case ("steps", int(), str(), str(field), *_):
            return field
    return place_text(place, "the form")


def numbers(text: str, field: str) -> list[float]:
    """Numbers separated by spaces, semicolons or a comma and a space, such as "0.1, 0.05"; 0,1 is a tenth as well.

    Raises JointlabError where something in `text` is no number.
    """
    try:
        return [float(word.replace(",", ".")) for word in text.replace(";", " ").replace(", ", " ").split()]
    except ValueError as error:
        raise JointlabError(
            f"{field}: {text!r} is not a list of numbers; separate numbers by spaces, such as 0.1 0.05"
        ) from error


def _whole(text: str, field: str) -> int:
    found = numbers(text, field)
    if len(found) != 1 or not found[0].is_integer():
        raise JointlabError(f"{field}: {text!r} is not a whole number")
    return int(found[0])


def _sines(form: Mapping[str, str]) -> dict[str, Any]:
    span = numbers(form["frequencies"], "frequencies")
    if len(span) != 3:
        raise JointlabError(f"frequencies: {form['frequencies']!r}; give the first, the last and the step in Hz")
    return {
        "specimens": form["specimens"].split(),
        "configurations": form["configurations"].split(),
        "amplitudes_pp_mm": numbers(form["amplitudes"], "amplitudes"),
        "frequencies": dict(zip(("first", "last", "step"), span, strict=True)),
    }
