"""Two effects at once: every other effect is added to each of the best ones, and then the other way round.

A single effect is fitted as if it were the only one. Where a wrong effect hides a large one, a pair shows it: that
second effect is fitted alone, from its values in the pair, and others are then added to it.
"""

from collections.abc import Sequence

import numpy as np

from analysis.gap.fit import CLOSE, fit
from analysis.gap.model import ENOUGH, Model, best_by_id, best_by_law
from analysis.gap.search import FITTED_AFTER_CLEAN, MOST_LAWS_FITTED, SETTLING_STEPS, Search, seeds

FITTED_PAIRS = 6
"""Second effects that are fitted on top of a first one."""
TURNS = 2
"""How often the second effect of the best pair becomes the first of further pairs."""
LED = 2
"""Pairs of which other laws are fitted too."""


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
        found += _with_second(search, seed, found)
        if not found:
            return []
    alone = list[Model]()
    for _ in range(TURNS):
        best = _leading(found, [*singles, *alone])[:1]
        if not best:
            break
        effects, start = best[0].effects[1:], np.delete(best[0].fit.scores, best[0].places(0))
        second = Model(effects, fit(search.simulation(effects), start, CLOSE, ENOUGH, SETTLING_STEPS))
        alike = [each for each in (*singles, *alone) if each.ids == second.ids]
        if all(second.log_evidence > each.log_evidence for each in alike):
            alone.append(second)
        if best[0].clean or any(second.effects == each.effects for each in firsts):
            break
        firsts.append(second)
        found += _with_second(search, second, found)
    for pair in _leading(found, [*singles, *alone])[:LED]:
        found += _with_other_laws(search, pair, firsts, singles)
    return sorted([*found, *alone], key=lambda model: -model.log_evidence)


def _with_second(search: Search, seed: Model, found: Sequence[Model]) -> list[Model]:
    """Every other effect added to one, except in pairs that are already fitted."""
    known = {frozenset(model.ids) for model in found}
    others = [each for each in search.candidates if frozenset((*seed.ids, each.id)) not in known]
    ranked = search.screened(seed, [each for each in others if each.id not in seed.ids])
    clean = seed.clean or any(model.clean for model in found)
    return search.fitted(seed, ranked, FITTED_AFTER_CLEAN if clean else FITTED_PAIRS, laws=1, known=found)


def _leading(found: Sequence[Model], singles: Sequence[Model]) -> list[Model]:
    """The best model of each pair that is above every single, and as clean as the best pair; the best first."""
    least = max((each.log_evidence for each in singles), default=-np.inf)
    above = [each for each in best_by_id(found) if each.log_evidence > least]
    return [each for each in above if each.clean or not above[0].clean]


def _with_other_laws(search: Search, pair: Model, firsts: Sequence[Model], singles: Sequence[Model]) -> list[Model]:
    """A pair with other laws of either effect.

    The best law of the first alone need not be the best in a pair; of the second only one law was fitted.
    """
    first, second = pair.effects
    (seed,) = (each for each in firsts if each.effects == (first,))
    laws = [each for each in search.candidates if each.id == second.id and each.law != second.law]
    found = search.fitted(seed, search.screened(seed, laws), 1, known=[pair])
    if pair.clean:
        return found
    rivals = best_by_law([each for each in singles if each.ids == seed.ids and each.effects != seed.effects])
    for rival in rivals[:MOST_LAWS_FITTED]:
        ranked = search.screened(rival, [each for each in search.candidates if each.id == second.id])
        found += search.fitted(rival, ranked, 1, known=[pair])
    return found
