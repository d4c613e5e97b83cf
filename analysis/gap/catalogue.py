"""The catalogue: every effect found in the files of `analysis.gap.effects`, with its rival laws."""

import pkgutil
from functools import cache
from importlib import import_module

from analysis.gap import effects
from analysis.gap.effect import Effect, acts_on
from analysis.gap.measurement import Measurement


@cache
def laws() -> tuple[type[Effect], ...]:
    """All laws of all effects, sorted by id; rival laws of one id in the order of their file."""
    found = list[type[Effect]]()
    for module in pkgutil.iter_modules(effects.__path__, f"{effects.__name__}."):
        names = vars(import_module(module.name)).values()
        classes = (each for each in names if isinstance(each, type) and issubclass(each, Effect))
        found += [each for each in classes if each.__module__ == module.name]
    return tuple(sorted(found, key=lambda law: law.id))


def effect_ids() -> tuple[str, ...]:
    """Ids of all effects, in order."""
    return tuple(dict.fromkeys(law.id for law in laws()))


def candidates(measurement: Measurement, without: frozenset[str] = frozenset()) -> tuple[Effect, ...]:
    """Every variant of every law that could show in what was measured, but for the ids in `without`."""
    found = [variant for law in laws() if law.id not in without for variant in law.variants(measurement)]
    return tuple(each for each in found if shows(each, measurement))


def shows(effect: Effect, measurement: Measurement) -> bool:
    """Whether any rig that was measured with could show the effect at all."""
    overridden = {name for name in ("cylinders", "mounting", "joints", "beam", "tester") if acts_on(effect, name)}
    in_beam = overridden & {"cylinders", "mounting", "joints", "beam"} and measurement.sets
    in_tester = overridden & {"cylinders", "mounting", "tester"} and measurement.points is not None
    return bool(effect.parameters and (in_beam or in_tester))
