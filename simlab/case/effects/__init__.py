"""The effects a case can have: those of the catalogue by family, and novelties that no catalogue foresees."""

from __future__ import annotations

from simlab.case.effects import chain, elastomer, novel, record, structure, tester
from simlab.case.effects.base import SimulatedEffect

CATALOGUE: dict[str, type[SimulatedEffect]] = {
    kind.name: kind for family in (elastomer, structure, chain, tester) for kind in family.EFFECTS
}
RECORD_EFFECTS: dict[str, type[SimulatedEffect]] = {kind.name: kind for kind in record.EFFECTS}
"""Those of the catalogue that show in raw blows alone."""
NOVELTIES: dict[str, type[SimulatedEffect]] = {kind.name: kind for kind in novel.NOVELTIES}

__all__ = ["CATALOGUE", "NOVELTIES", "RECORD_EFFECTS", "SimulatedEffect"]
