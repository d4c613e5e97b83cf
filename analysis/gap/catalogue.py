"""The catalogue: every effect found in the files of `analysis.gap.effects`, with its rival laws."""

import pkgutil
from collections.abc import Sequence
from functools import cache
from importlib import import_module

from analysis.gap import effects
from analysis.gap.effect import Effect, Mechanism, acts_on_rig
from analysis.gap.measurement import Measurement, Rig


@cache
def laws() -> tuple[type[Effect], ...]:
    """All laws of all effects, sorted by id; rival laws of one id in the order of their file.

    A class without an id is a base class of laws, not a law.
    """
    found = list[type[Effect]]()
    for module in pkgutil.iter_modules(effects.__path__, f"{effects.__name__}."):
        names = vars(import_module(module.name)).values()
        classes = (each for each in names if isinstance(each, type) and issubclass(each, Effect))
        found += [each for each in classes if each.__module__ == module.name and hasattr(each, "id")]
    return tuple(sorted(found, key=lambda law: law.id))


def effect_ids() -> tuple[str, ...]:
    """Ids of all effects, in order; smooth functions in place of a law do not count."""
    return tuple(dict.fromkeys(law.id for law in laws() if not law.law_free))


def mechanism_of(effect_id: str) -> Mechanism:
    """The mechanism of an effect.

    Raises:
        KeyError: the catalogue has no such effect.
    """
    return {law.id: law.mechanism for law in laws()}[effect_id]


def candidates(measurement: Measurement, without: frozenset[str] = frozenset()) -> tuple[Effect, ...]:
    """Every variant of every law that could show in what was measured, except laws with an id in `without`."""
    return _showing([law for law in laws() if not law.law_free and law.id not in without], measurement)


def law_free(measurement: Measurement, without: frozenset[Mechanism] = frozenset()) -> tuple[Effect, ...]:
    """Every smooth function in place of a law that could show in what was measured: one or more for each mechanism."""
    return _showing([law for law in laws() if law.law_free and law.mechanism not in without], measurement)


def _showing(chosen: Sequence[type[Effect]], measurement: Measurement) -> tuple[Effect, ...]:
    variants = [variant for law in chosen for variant in law.variants(measurement)]
    return tuple(each for each in variants if shows(each, measurement))


def shows(effect: Effect, measurement: Measurement) -> bool:
    """Whether the effect acts on a rig that was used in the measurement."""
    used = {Rig.BEAM: bool(measurement.sets), Rig.TESTER: measurement.points is not None}
    return bool(effect.parameters) and any(acts_on_rig(effect, rig) for rig in used if used[rig])
