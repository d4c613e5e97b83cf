"""Rows of accelerances in a wrong unit, dead, of wrong polarity or swapped: corrected or left out, and named.

A wrong unit shows in the size of the rows over frequency. Where hammer sets differ in which of two rows is which, most
of them are right, or else the model decides. Two rows that are swapped in all sets lead the fit astray, so an exchange
is believed only if a fit to the exchanged rows confirms it. Two rows along the beam are hardly larger than the error of
the paper's model: for these, only a majority of three or more sets decides.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from analysis.dof import Direction, Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.gap.faults.rough_fit import RoughFit, rough_fit, size_of
from analysis.gap.measurement import HammerSet, Measurement

STANDARD_GRAVITY = 9.80665  # m/s^2
STRANGE, ALIKE = 0.5, 0.8
"""Correlation of the middle row with what is expected of it: below the first the unit is doubted, above the second it
is right."""
FAR, NEAR = 4.0, 2.0
"""Ratio of sizes, measured over expected or its inverse: above the first the unit is doubted, below the second
right."""


UNITS: Mapping[str, Callable[[Real], Complex]] = {
    "accelerances in g/N": lambda frequency: np.full(frequency.shape, STANDARD_GRAVITY, dtype=complex),
    "receptances in m/N": lambda frequency: np.asarray((2j * np.pi * frequency) ** 2),
    "mobilities in (m/s)/N": lambda frequency: np.asarray(2j * np.pi * frequency),
}
"""Quantities that a set may hold instead of accelerance, with (lines,) factors to it for (lines,) frequencies in Hz."""


def with_units_corrected(rough: RoughFit) -> tuple[RoughFit, tuple[str, ...]]:
    """A rough fit to accelerances in (m/s^2)/N, and a sentence about sets that held something else.

    The same fit where all sets look as expected, or where no other unit does.
    """
    measurement = rough.measurement
    doubted = [number for number in range(len(rough.thin)) if not _looks_right(rough, number, STRANGE, FAR)]
    for numbers in (doubted, *([number] for number in doubted if len(doubted) > 1)):
        for unit in UNITS if numbers else ():
            sets = [_converted(each, UNITS[unit]) if n in numbers else each for n, each in enumerate(measurement.sets)]
            again = rough_fit(replace(measurement, sets=tuple(sets)))
            if all(_looks_right(again, number, ALIKE, NEAR) for number in doubted):
                which = f"hammer set{'s' if len(numbers) > 1 else ''} {', '.join(str(n + 1) for n in numbers)}"
                return again, (f"{which}: {unit}, not accelerances in (m/s^2)/N; corrected",)
    return rough, ()


def _looks_right(rough: RoughFit, number: int, correlation: float, size: float) -> bool:
    middle = float(np.median(rough.size(number)))
    return bool(np.median(rough.correlation(number)) > correlation and 1 / size < middle < size)


def _converted(each: HammerSet, to_accelerance: Callable[[Real], Complex]) -> HammerSet:
    factor = to_accelerance(each.frequency)
    accelerance, deviation = factor * each.accelerance, np.abs(factor) * each.deviation
    return replace(each, accelerance=accelerance, deviation=deviation, reference=None)


Places = dict[int, list[int]]
"""Indices of two rows, by number of the set."""

TRIED = 1.5
"""Unlikeness of two exchanged rows over that without exchange, below which a fit to the exchanged rows is made."""
BELIEVED, OF_TWO_SETS = 0.5, 0.9
"""The ratio that this fit must reach, and the one that suffices where one of two sets must be wrong."""
DIFFERENT = 0.9
"""Unlikeness of two rows between two sets, exchanged over not exchanged, below which one set may have swapped them."""
OUTVOTED = 0.5
"""The same ratio of one set to every other set, below which this set is wrong even if the model disagrees. Where joints
soften with the force of blows, two rows along the beam differ as little from each other as one row between sets."""
ITSELF = 0.3
"""Unlikeness of a measured and an expected row, up to which they may be the same row."""
MOST_TRIED = 2
"""Exchanges that are fitted, the most promising first."""
CLEAR = 6.0
"""Least gain in chi-square by a correction: odds of twenty to one. Turning all rows along the beam is a mirror image of
the bench, which fits as well but for cylinders that are stiffer in shear than in compression."""


@dataclass(frozen=True, eq=False)
class RowExchange:
    """Two rows that may be swapped, in one set or in several.

    Attributes:
        places: of the rows.
        believed: unlikeness over that without exchange, below which the exchange is right.
    """

    places: Places
    believed: float


def _possible(rough: RoughFit) -> Iterator[RowExchange]:
    sets = rough.measurement.sets
    for pair in dict.fromkeys(frozenset(two) for each in sets for two in combinations(each.inputs, 2)):
        places = {
            number: [row for row, dof in enumerate(each.inputs) if dof in pair]
            for number, each in enumerate(sets)
            if pair <= set(each.inputs)
        }
        inconsistent_blows = {
            number: sum(_crossed(rough, places, number, other) < DIFFERENT for other in places if other != number)
            for number in places
        }
        accused = [number for number, sets_against in inconsistent_blows.items() if 2 * sets_against > len(places) - 1]
        across = any(dof.direction is Direction.Y for dof in pair)
        if len(accused) == 1:
            others = [number for number in places if number != accused[0]]
            if max(_crossed(rough, places, accused[0], other) for other in others) < OUTVOTED:
                yield RowExchange({accused[0]: places[accused[0]]}, np.inf)
        elif accused and across:
            yield from (RowExchange({number: places[number]}, OF_TWO_SETS) for number in accused)
        elif not accused and across and _gain(_block(rough, places)) < TRIED:
            yield RowExchange(places, BELIEVED)


def _block(rough: RoughFit, places: Places) -> Real:
    """(2, 2) unlikeness of two measured rows with the two expected, over some sets."""
    return np.asarray(sum(rough.unlikeness(number)[np.ix_(rows, rows)] for number, rows in places.items()))


def _crossed(rough: RoughFit, places: Places, number: int, other: int) -> float:
    """Ratio of the unlikeness of two rows between two sets, crossed over straight; the same either way round."""
    return _gain(_between(rough, places, number, other) + _between(rough, places, other, number))


def _between(rough: RoughFit, places: Places, number: int, other: int) -> Real:
    """(2, 2) unlikeness of two rows of one set with the same of another, which may list them in another order."""
    if not np.array_equal(rough.thin[number].frequency, rough.thin[other].frequency):
        return np.array([[0.0, 1.0], [1.0, 0.0]])  # nothing to compare: taken as agreed
    inputs, others = rough.thin[number].inputs, rough.thin[other].inputs
    same = [others.index(inputs[row]) for row in places[number]]
    return np.asarray(rough.unlikeness_between(number, other)[np.ix_(places[number], same)])


def _gain(block: Real) -> float:
    """Ratio of the unlikeness with the two rows exchanged to that without exchange."""
    return float((block[0, 1] + block[1, 0]) / max(block[0, 0] + block[1, 1], 1e-12))


REVERSED = -0.6
"""Correlation of a measured and an expected row, below which the polarity is wrong."""
SILENT, DEAD = 1e-3, 0.02
"""Size of a dead row, relative to the other rows of its set, and to its expected size."""
MOST = 8
"""Faults that are corrected in one measurement; with more, the operator has to check the cables."""


def correct_rows(measurement: Measurement) -> tuple[Measurement, tuple[str, ...]]:
    """Leave out dead rows, correct others, and give a sentence for each fault; the same object where there is none.

    Raises:
        AnalysisError: every row is dead.
    """
    # a row without any signal would draw a fit of relative errors to zero
    measurement, silent = _without_dead(
        measurement, [_share(size_of(each.accelerance)) for each in measurement.sets], SILENT
    )
    rough, units = with_units_corrected(rough_fit(measurement))
    measurement, dead = _without_dead(
        rough.measurement, [_share(rough.size(number)) for number in range(len(rough.thin))], DEAD
    )
    if dead:
        rough = rough_fit(measurement)
    faults = [*silent, *units, *dead]
    tried_anywhere = False
    for _ in range(MOST):
        found = _with_swap_corrected(rough) or _with_polarity_corrected(rough)
        if found is None and not rough.holds and not tried_anywhere:
            # typical cylinders show best which row is which, unless these are far from typical
            found, tried_anywhere = (rough_fit(rough.measurement, rough, anywhere=True), ()), True
        if found is None:
            break
        rough, fault = found
        faults += fault
    return rough.measurement, tuple(faults)


def _share(size: Real) -> Real:
    """(rows,) sizes over their median."""
    return np.asarray(size / max(float(np.median(size)), float(np.finfo(float).tiny)))


def _without_dead(measurement: Measurement, sizes: Sequence[Real], least: float) -> tuple[Measurement, list[str]]:
    """The measurement without rows below the least size, and a sentence for each of them."""
    alive = [size > least for size in sizes]
    if all(np.all(rows) for rows in alive):
        return measurement, []
    if not any(np.any(rows) for rows in alive):
        raise AnalysisError("all rows of all hammer sets are dead; check the accelerometer and its cable")
    faults = [
        f"hammer set {number + 1}: row {dof} is dead (it has {100 * size:.2g} % of the size expected); left out"
        for number, each in enumerate(measurement.sets)
        for dof, size in zip(each.inputs, sizes[number], strict=True)
        if not size > least
    ]
    kept = [each.rows(rows) for each, rows in zip(measurement.sets, alive, strict=True) if np.any(rows)]
    return replace(measurement, sets=tuple(kept)), faults


Corrected = tuple[RoughFit, tuple[str, ...]]
"""A fit to corrected rows with a sentence for the fault, or a better fit to the rows as they are without one."""


def _believed(rough: RoughFit, again: RoughFit) -> tuple[bool, RoughFit]:
    """Whether a fit to corrected rows is clearly better than any to the rows as they are, and the best one to these.

    A fit may end in a minimum that is not the lowest, and wrong rows may then seem to fit better: a poor fit to right
    rows is no reason to change them.
    """
    before = min(rough, rough_fit(rough.measurement, also_from=again, anywhere=True), key=lambda each: each.cost)
    return again.cost < before.cost - CLEAR, before


def _with_polarity_corrected(rough: RoughFit) -> Corrected | None:
    """The fit with those rows turned that have the wrong polarity in the first set that has any."""
    for number, each in enumerate(rough.measurement.sets):
        wrong = rough.correlation(number) < REVERSED
        if np.any(wrong):
            accelerance = np.where(wrong[:, None], -each.accelerance, each.accelerance)
            turned = replace(each, accelerance=accelerance, reference=None)
            sets = (*rough.measurement.sets[:number], turned, *rough.measurement.sets[number + 1 :])
            names = [dof for dof, is_wrong in zip(each.inputs, wrong, strict=True) if is_wrong]
            said = f"row {names[0]} has" if len(names) == 1 else f"rows {_listed(names)} have"
            again = rough_fit(replace(rough.measurement, sets=sets), also_from=rough)
            believed, before = _believed(rough, again)
            if believed:
                return again, (f"hammer set {number + 1}: {said} the wrong polarity; corrected",)
            if before is not rough:
                return before, ()
    return None


def _with_swap_corrected(rough: RoughFit) -> Corrected | None:
    """The fit with two rows exchanged that were swapped beyond doubt."""
    found = list[tuple[float, RoughFit, RowExchange]]()
    for exchange in sorted(_possible(rough), key=lambda each: _gain(_block(rough, each.places)))[:MOST_TRIED]:
        sets = list(rough.measurement.sets)
        for number, rows in exchange.places.items():
            accelerance, deviation = sets[number].accelerance.copy(), sets[number].deviation.copy()
            accelerance[rows], deviation[rows] = accelerance[rows[::-1]], deviation[rows[::-1]]
            sets[number] = replace(sets[number], accelerance=accelerance, deviation=deviation, reference=None)
        again = rough_fit(replace(rough.measurement, sets=tuple(sets)), also_from=rough)
        before, after = (float(np.trace(_block(each, exchange.places))) for each in (rough, again))
        outvoted = exchange.believed == np.inf
        if (after < ITSELF * 2 * len(exchange.places) or outvoted) and after < exchange.believed * before:
            believed, as_it_is = (True, rough) if outvoted else _believed(rough, again)
            if believed:
                found.append((after / before, again, exchange))
            elif as_it_is is not rough:
                return as_it_is, ()
    if not found:
        return None
    _, again, exchange = min(found, key=lambda each: each[0])
    number, rows = next(iter(exchange.places.items()))
    where = _listed([number + 1 for number in exchange.places])
    said = f"hammer set{'s' if len(exchange.places) > 1 else ''} {where}"
    names = _listed([rough.measurement.sets[number].inputs[row] for row in rows])
    return again, (f"{said}: rows {names} are swapped; corrected",)


def _listed(names: Sequence[Dof | int]) -> str:
    *first, last = map(str, names)
    return f"{', '.join(first)} and {last}" if first else last
