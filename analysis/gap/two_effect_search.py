"""Two effects at once: to each of the best effects every other is tried, and then the other way round.

A single effect is fitted as if nothing else were there. Where a large effect hides behind a wrong one, a pair shows it:
that second effect, fitted alone from where the pair left it, is what others are tried to next.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.gap.fit import CLOSE, fit
from analysis.gap.model import ENOUGH, Model, best_by_id, best_by_law
from analysis.gap.search import AFTER_CLEAN, LAWS, SETTLING_STEPS, Search, seeds

FITTED_PAIRS = 6
TURNS = 2
"""Times that the second effect of the best pair becomes the first of others."""
LED = 2
"""Pairs of which other laws are tried."""


def pairs(search: Search, singles: Sequence[Model]) -> list[Model]:
    """The most promising pairs, fitted, and single effects that only a pair has shown; the best first.

    Where nothing on top of the best single promises anything, no other can do better with two.

    Args:
        search: that found the singles.
        singles: fitted, with one effect each.
    """
    firsts, found = list[Model](), list[Model]()
    for seed in seeds(singles):
        firsts.append(seed)
        found += _beside(search, seed, found)
        if not found:
            return []
    alone = list[Model]()
    for _ in range(TURNS):
        best = _leading(found, [*singles, *alone])[:1]
        if not best:
            break
        second = _second_alone(search, best[0])
        if _better(second, [*singles, *alone]):
            alone.append(second)
        if best[0].clean or any(second.effects == each.effects for each in firsts):
            break
        firsts.append(second)
        found += _beside(search, second, found)
    for pair in _leading(found, [*singles, *alone])[:LED]:
        found += _with_other_laws(search, pair, firsts, singles)
    return sorted([*found, *alone], key=lambda model: -model.log_evidence)


def _beside(search: Search, seed: Model, found: Sequence[Model]) -> list[Model]:
    """Every other effect tried to one, but for pairs that are found already."""
    known = {frozenset(model.ids) for model in found}
    others = [each for each in search.candidates if frozenset((*seed.ids, each.id)) not in known]
    ranked = search.screened(seed, [each for each in others if each.id not in seed.ids])
    clean = seed.clean or any(model.clean for model in found)
    return search.fitted(seed, ranked, AFTER_CLEAN if clean else FITTED_PAIRS, laws=1, known=found)


def _leading(found: Sequence[Model], singles: Sequence[Model]) -> list[Model]:
    """Of each pair of effects the best model, where it is above every single, and as clean as the best; that first."""
    least = max((each.log_evidence for each in singles), default=-np.inf)
    above = [each for each in best_by_id(found) if each.log_evidence > least]
    return [each for each in above if each.clean or not above[0].clean]


def _second_alone(search: Search, pair: Model) -> Model:
    """The second effect of a pair by itself, from where the pair left it."""
    effects, start = pair.effects[1:], np.delete(pair.fit.scores, pair.places(0))
    return Model(effects, fit(search.simulation(effects), start, CLOSE, ENOUGH, SETTLING_STEPS))


def _better(single: Model, singles: Sequence[Model]) -> bool:
    """Whether it is above what was found of this effect."""
    return all(single.log_evidence > each.log_evidence for each in singles if each.ids == single.ids)


def _with_other_laws(search: Search, pair: Model, firsts: Sequence[Model], singles: Sequence[Model]) -> list[Model]:
    """A pair of which either effect follows other laws.

    By itself the first may follow one that fits it less beside another; of the second only one law was tried.
    """
    first, second = pair.effects
    (seed,) = (each for each in firsts if each.effects == (first,))
    laws = [each for each in search.candidates if each.id == second.id and each.law != second.law]
    found = search.fitted(seed, search.screened(seed, laws), 1, known=[pair])
    if pair.clean:
        return found
    rivals = best_by_law([each for each in singles if each.ids == seed.ids and each.effects != seed.effects])
    for rival in rivals[:LAWS]:
        ranked = search.screened(rival, [each for each in search.candidates if each.id == second.id])
        found += search.fitted(rival, ranked, 1, known=[pair])
    return found
