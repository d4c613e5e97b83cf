"""The effects a case can have: those of the catalogue by family, and novelties that no catalogue foresees."""

from types import ModuleType

from simlab.case.effects import chain, elastomer, novel, record, structure, tester
from simlab.case.effects.base import SimulatedEffect


def effects_by_name(*families: ModuleType) -> dict[str, type[SimulatedEffect]]:
    """The effects that the modules define, in their order: what is drawn depends on it."""
    return {
        kind.name: kind
        for family in families
        for kind in vars(family).values()
        if isinstance(kind, type) and issubclass(kind, SimulatedEffect) and kind.__module__ == family.__name__
    }


CATALOGUE = effects_by_name(elastomer, structure, chain, tester)
RECORD_EFFECTS = effects_by_name(record)
"""Effects of the catalogue that show in raw blows alone."""
NOVELTIES = effects_by_name(novel)

__all__ = ["CATALOGUE", "NOVELTIES", "RECORD_EFFECTS", "SimulatedEffect", "effects_by_name"]
