"""The hammer bounces: a second contact a few milliseconds after the first.

Shows in the records of blows (`analysis.gap.record_faults`), where it is found before anything is fitted. H1 divides by
the force of both contacts, so that accelerances stay right and lose coherence where the force has its ripples.
"""

from __future__ import annotations

from dataclasses import dataclass

from analysis.gap.effect import Effect
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class DoubleHit(Effect):
    """A hammer that bounces."""

    id = "double_hit"
    title = "double hits of the hammer"
    law = "found in records"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("ratio", "1", 0.0, 0.4, least=0.0),)
