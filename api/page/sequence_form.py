"""What a technician asks to be measured: a sequence that is kept, with fewer or other points, blows and sines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from api.page.sequence_of_run import sequence_again
from api.service.context import Services
from jointlab.errors import JointlabError
from jointlab.sequences import BUILT_IN, sequence_named
from rig.sequence import HammerStep, Sequence, SweepStep, sequence_from
from store.sequence_documents import list_sequences

FIELDS = {
    "title": "Title",
    "article_name": "Test article",
    "points": "Points to strike",
    "blows": "Blows at each point",
    "specimens": "Joints in the tester",
    "configurations": "Configurations",
    "amplitudes": "Amplitudes, mm peak to peak",
    "frequencies": "Frequencies: first, last, step, Hz",
}
HAMMER_FIELDS = ("points", "blows")
SWEEP_FIELDS = ("specimens", "configurations", "amplitudes", "frequencies")
Choices = Mapping[str, str]


def sequence_names(services: Services) -> tuple[str, ...]:
    """Names of the sequences that can be measured."""
    with services.catalogue.reading() as session:
        return (BUILT_IN, *(kept.name for kept in list_sequences(session)))


def base_sequence(services: Services, query: Mapping[str, str]) -> Sequence:
    """The sequence to begin with: that of the run `like`, or the one that `sequence` names.

    Raises:
        StoreError: there is no such run or sequence.
        RigError: what is kept is no sequence.
    """
    like = query.get("like", "")
    with services.catalogue.reading() as session:
        if like.isdecimal():
            return sequence_again(session, int(like))
        return sequence_named(session, query.get("sequence") or BUILT_IN)


def choices_of(sequence: Sequence) -> dict[str, str]:
    """What a sequence asks for, as the texts of a form."""
    said = {"title": sequence.title, "article_name": sequence.article_name}
    for step in sequence.steps:
        if isinstance(step, HammerStep):
            said |= {"points": " ".join(step.points), "blows": str(step.blows)}
        elif isinstance(step, SweepStep):
            span = step.frequencies
            said |= {
                "specimens": " ".join(step.specimens),
                "configurations": " ".join(step.configurations),
                "amplitudes": " ".join(f"{amplitude:g}" for amplitude in step.amplitudes_pp_mm),
                "frequencies": f"{span.first:g} {span.last:g} {span.step:g}",
            }
    return said


def wanted_sequence(base: Sequence, parts: str, choices: Choices) -> Sequence:
    """`base` with these choices; of its steps only the `parts` hammer or sweep, or all.

    Raises:
        RigError: what comes of it is no sequence that can be measured.
        JointlabError: a choice is not written as numbers.
    """
    document: dict[str, Any] = base.model_dump(mode="json", exclude_none=True)
    kinds = {"hammer": {"hammer", "prompt"}, "sweep": {"sweep", "blank", "soak", "prompt"}}.get(parts)
    steps = [step for step in document["steps"] if kinds is None or step["step"] in kinds]
    if all(step["step"] == "prompt" for step in steps):
        raise JointlabError(f"{base.title}: it has no {parts} step; choose another part or another sequence")
    for step in steps:
        if step["step"] == "hammer":
            step |= {"points": choices["points"].split(), "blows": _whole(choices["blows"], "blows")}
        elif step["step"] == "sweep":
            step |= _sines(choices)
    document |= {"title": choices["title"], "article_name": choices["article_name"], "steps": steps}
    return sequence_from(document, "what you asked for")


def numbers(text: str, what: str) -> list[float]:
    """Numbers with blanks between them, decimals after a point or a comma.

    Raises:
        JointlabError: something in `text` is no number.
    """
    try:
        return [float(word.replace(",", ".")) for word in text.replace(";", " ").split()]
    except ValueError as error:
        raise JointlabError(
            f"{what}: {text!r} are no numbers; write them with blanks between, such as 0.1 0.05"
        ) from error


def _whole(text: str, what: str) -> int:
    found = numbers(text, what)
    if len(found) != 1 or not found[0].is_integer():
        raise JointlabError(f"{what}: {text!r} is no whole number")
    return int(found[0])


def _sines(choices: Choices) -> dict[str, Any]:
    span = numbers(choices["frequencies"], "frequencies")
    if len(span) != 3:
        raise JointlabError(f"frequencies: {choices['frequencies']!r}; give the first, the last and the step in Hz")
    return {
        "specimens": choices["specimens"].split(),
        "configurations": choices["configurations"].split(),
        "amplitudes_pp_mm": numbers(choices["amplitudes"], "amplitudes"),
        "frequencies": dict(zip(("first", "last", "step"), span, strict=True)),
    }
