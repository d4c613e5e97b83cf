"""An effect that records show by themselves, and no fit has to look for."""

from __future__ import annotations

from dataclasses import dataclass

from analysis.gap.estimate import Estimate


@dataclass(frozen=True)
class RecordEffect:
    """What was found of an effect of the catalogue in the records of blows, or in their averages.

    Attributes:
        id: in the catalogue.
        parameters: by name.
        fault: a sentence that says so.
    """

    id: str
    parameters: dict[str, Estimate]
    fault: str
