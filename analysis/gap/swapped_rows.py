"""Rows of accelerances that were taken for each other.

Where hammer sets differ in which of two rows is which, most of them are right, or else the model says which. What all
sets show alike is swapped in all or in none; two swapped rows lead the fit astray, so that none is believed before a
fit to the exchanged rows says so. Two rows along the bar are hardly more than what the paper's model leaves out: of
these, only most of three sets or more tell.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from analysis.dof import Direction, Dof
from analysis.frequency_response import Real
from analysis.gap.measurement import HammerSet
from analysis.gap.rough_fit import RoughFit, rough_fit

Places = dict[int, list[int]]
"""Of two rows, by the number of the set."""

TRIED = 1.5
"""Unlikeness of two exchanged rows over that without exchange, below which a fit to the exchanged rows is made."""
BELIEVED, OF_TWO_SETS = 0.5, 0.9
"""What that fit has to bring it to, and what suffices where one of two sets has to be wrong."""
DIFFERENT = 0.9
"""Unlikeness of two rows of a set with the same of another crossed over straight, below which they differ."""
ITSELF = 0.3
"""Unlikeness of a row with what is expected of it, up to which it may be itself."""
MOST_TRIED = 2


@dataclass(frozen=True, eq=False)
class Exchange:
    """Two rows that may be swapped, in one set or in several.

    Attributes:
        places: of the rows.
        believed: unlikeness over that without exchange, below which the exchange is right.
    """

    places: Places
    believed: float


def exchanged(rough: RoughFit) -> tuple[RoughFit, Exchange] | None:
    """A rough fit in which the two rows are exchanged that were swapped beyond doubt; None where there are none."""
    found = list[tuple[float, RoughFit, Exchange]]()
    for exchange in sorted(_possible(rough), key=lambda each: _gain(_block(rough, each.places)))[:MOST_TRIED]:
        sets = list(rough.measurement.sets)
        for number, rows in exchange.places.items():
            sets[number] = _with_exchanged(sets[number], rows)
        again = rough_fit(replace(rough.measurement, sets=tuple(sets)))
        before, after = (float(np.trace(_block(each, exchange.places))) for each in (rough, again))
        itself = after < ITSELF * 2 * len(exchange.places) or exchange.believed == np.inf
        if itself and after < exchange.believed * before:
            found.append((after / before, again, exchange))
    if not found:
        return None
    _, again, exchange = min(found, key=lambda each: each[0])
    return again, exchange


def _possible(rough: RoughFit) -> Iterator[Exchange]:
    sets = rough.measurement.sets
    for pair in dict.fromkeys(frozenset(two) for each in sets for two in combinations(each.inputs, 2)):
        places = {number: _places(each, pair) for number, each in enumerate(sets) if pair <= set(each.inputs)}
        inconsistent_blows = {
            number: sum(
                _gain(_between(rough, places, number, other)) < DIFFERENT for other in places if other != number
            )
            for number in places
        }
        accused = [number for number, sets_against in inconsistent_blows.items() if 2 * sets_against > len(places) - 1]
        told = any(dof.direction is Direction.Y for dof in pair)
        if len(accused) == 1:
            yield Exchange({accused[0]: places[accused[0]]}, np.inf)
        elif accused and told:
            yield from (Exchange({number: places[number]}, OF_TWO_SETS) for number in accused)
        elif not accused and told and _gain(_block(rough, places)) < TRIED:
            yield Exchange(places, BELIEVED)


def _places(each: HammerSet, pair: frozenset[Dof]) -> list[int]:
    return [row for row, dof in enumerate(each.inputs) if dof in pair]


def _block(rough: RoughFit, places: Places) -> Real:
    """(2, 2) unlikeness of two measured rows with the two expected, over some sets."""
    return np.asarray(sum(rough.unlikeness(number)[np.ix_(rows, rows)] for number, rows in places.items()))


def _between(rough: RoughFit, places: Places, number: int, other: int) -> Real:
    """(2, 2) unlikeness of two rows of one set with the same of another, which may list them in another order."""
    if not np.array_equal(rough.thin[number].frequency, rough.thin[other].frequency):
        return np.array([[0.0, 1.0], [1.0, 0.0]])  # nothing to compare: taken as agreed
    inputs, others = rough.thin[number].inputs, rough.thin[other].inputs
    same = [others.index(inputs[row]) for row in places[number]]
    return np.asarray(rough.unlikeness_between(number, other)[np.ix_(places[number], same)])


def _gain(block: Real) -> float:
    """Unlikeness crossed over unlikeness straight."""
    return float((block[0, 1] + block[1, 0]) / max(block[0, 0] + block[1, 1], 1e-12))


def _with_exchanged(each: HammerSet, rows: list[int]) -> HammerSet:
    accelerance, deviation = each.accelerance.copy(), each.deviation.copy()
    accelerance[rows], deviation[rows] = accelerance[rows[::-1]], deviation[rows[::-1]]
    return replace(each, accelerance=accelerance, deviation=deviation)
