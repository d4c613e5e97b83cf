"""Effects of one article in the simulation of another: from files to a document and sentences."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from analysis.gap.findings.carried_effect import Carried, carry
from analysis.gap.findings.model_values import ModelValues
from analysis.gap.simulation.scales import NAMES
from jointlab.diagnosis.document import gap_document
from jointlab.diagnosis.load import Subject
from jointlab.diagnosis.process_pool import processes
from jointlab.diagnosis.wording import estimate_with_unit, percent
from jointlab.identification.document import plain

FORMAT = "jointlab-carried-effect/1"
APART = 2.0
"""Distance from the other article's estimate, in its standard deviations, from which a parameter differs here."""


def carried(subject: Subject, other: ModelValues) -> dict[str, Any]:
    """The document of the result of another article's effects on this one; `write_model` accepts it like a diagnosis.

    Args:
        subject: this article's measurement.
        other: the other article's corrected simulation.

    Raises:
        AnalysisError: there is no effect in it, it cannot act here, or the measurement cannot be simulated.
    """
    with processes() as parallel_map:
        return _document(subject.title, carry(subject.measurement, other.effects, parallel_map))


def _document(title: str, found: Carried) -> dict[str, Any]:
    document: dict[str, Any] = plain(
        {
            "format": FORMAT,
            "title": title,
            "gap": gap_document(found.before, found.after, found.floor_percent),
            "verdict": {"status": "carried", "effects": [each.id for each in found.model.effects]},
            "lowers": found.lowers,
            "apart": found.apart,
            "nuisances": {name: getattr(found.nuisances, name) for name in NAMES},
            "model": asdict(found.model),
            "faults": found.faults,
        }
    )
    return document


def carried_sentences(document: Mapping[str, Any]) -> list[str]:
    """Sentences on the result of another article's effects here, and on those of their parameters that differ."""
    gap, model = document["gap"], document["model"]
    names = " + ".join(document["verdict"]["effects"])
    low, high = (percent(each) for each in gap["after_ci90_percent"])
    before, after = (percent(gap[moment]["percent"]) for moment in ("before", "after"))
    verb = "lowers the gap on held-out data" if document["lowers"] else "does NOT lower the gap on held-out data"
    found = [
        f"{names} of the other article {verb}: {before} without it, {after} with it ({low} to {high}); floor "
        f"{percent(gap['floor_percent'])}"
    ]
    for effect, apart in zip(model["effects"], document["apart"], strict=True):
        for name, known in effect["parameters"].items():
            value, interval = estimate_with_unit(known)
            off = f"; {apart[name]:+.1f} standard deviations from there" if abs(apart[name]) > APART else ""
            found.append(f"  {effect['id']}: {name} = {value} here, 90 % {interval}{off}")
    return found
