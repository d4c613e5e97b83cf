"""What of an experiment that was asked for is missing in the further measurement that answers it.

Compared are the conditions under which data were taken: points, peak forces, mountings, amplitudes, frequencies and
their order. Values do not matter. Two questions are kept apart, because incomplete data are useful, too: what is
missing, and whether there is anything of it at all.

Something is there where a force, an amplitude or a frequency is new in the way that was asked for: nearer to the wanted
one than to any that was measured before, by ratio. Where any new one will do (`Experiment.OTHER_LEVELS`,
`Experiment.HIGHER_FREQUENCY`), it differs from those before by the ratio `NEW`.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from analysis.dof import Dof
from analysis.frequency_response import Real
from analysis.gap.experiments.catalogue import CHANGES_THE_BENCH, EXPERIMENTS, SAME, Experiment, FurtherMeasurement
from analysis.gap.experiments.missing_condition import MissingCondition
from analysis.gap.measurement import Configuration, HammerSet, Measurement, Rig, TesterPoints

TOLERANCE = 1 / 3
"""Share of the wanted force, amplitude or limit of frequency by which the measured one may miss it.

People strike with a scatter of 10 to 20 %, a hammer tip ends the range of lines where it will, and the tester's limits
may end a sweep early. Levels that experiments ask for differ by a factor of two from those before, so a third hides
none of them.
"""
NEW = 1.1
"""Ratio from which a level, an amplitude or a frequency is another one.

Amplitudes and frequencies are commanded, and the mean of a hundred blows scatters by a few percent.
"""
IN_ORDER = 0.9
"""Rank correlation from which an order counts as kept."""
SERIES, FEWEST = 5, 10
"""Points of a series, and points in all, from which an order is judged: fewer are in order by chance."""

Chosen = NDArray[np.bool_]

UNITS = {
    MissingCondition.FORCE: "N",
    MissingCondition.HIGHEST_LINE: "Hz",
    MissingCondition.AMPLITUDE: "m",
    MissingCondition.LOWEST_FREQUENCY: "Hz",
    MissingCondition.HIGHEST_FREQUENCY: "Hz",
}
"""Units of what has a wanted value."""


@dataclass(frozen=True)
class Mounting:
    """A specimen, by the name of its joint, in a configuration of the tester."""

    specimen: str
    configuration: Configuration


@dataclass(frozen=True)
class Missing:
    """One thing that was asked for and not measured.

    Attributes:
        what: of the experiment.
        wanted: peak force in N, amplitude zero to peak in m, or limit of frequency in Hz; None where any new one will
            do, and for all else.
        measured: the nearest one in the further measurement, in the same unit; None where there is none.
        points: that were not struck at the wanted level.
        mountings: that were not tested as wanted.
    """

    what: MissingCondition
    wanted: float | None = None
    measured: float | None = None
    points: tuple[Dof, ...] = ()
    mountings: tuple[Mounting, ...] = ()


@dataclass(frozen=True)
class Compared:
    """A further measurement beside the experiment that was asked for.

    Attributes:
        missing: what was asked for and is not there.
        nothing: whether nothing at all of the experiment is there.
    """

    missing: tuple[Missing, ...] = ()
    nothing: bool = False


def compared(asked: Experiment, before: Measurement, further: Measurement) -> Compared:
    """What of an experiment is missing in a further measurement.

    Forces, amplitudes and limits of frequency may miss the wanted ones by `TOLERANCE`, a third; points and mountings
    count by name. Nothing is compared for an experiment whose data are readings, or which changes the bench: such data
    are not diagnosed together with the first.

    Args:
        asked: the experiment.
        before: all data when it was asked for.
        further: the data that answer it, of the same bench.
    """
    found = next((each for each in EXPERIMENTS if each.id is asked), None)
    if not isinstance(found, FurtherMeasurement) or asked in CHANGES_THE_BENCH:
        return Compared()
    planned = found.planned(before)
    if planned is None:
        return Compared()
    parts = [_struck(asked, each, before, further) for each in planned.sets] if Rig.BEAM in found.rigs else []
    if Rig.TESTER in found.rigs and planned.points is not None:
        parts.append(_tested(asked, planned.points, before, further))
    return Compared(tuple(each for part in parts for each in part.missing), all(part.nothing for part in parts))


# --- hammer sets ---


def _struck(asked: Experiment, wanted: HammerSet, before: Measurement, further: Measurement) -> Compared:
    if not further.sets:
        return Compared((Missing(MissingCondition.HAMMER_SET),), nothing=True)
    any_new = asked is Experiment.OTHER_LEVELS
    level = None if any_new else wanted.peak_force
    forces = np.array([each.peak_force for each in further.sets])
    new = _new(forces, level, np.array([each.peak_force for each in before.sets]))
    near = float(forces[np.argmin(_apart(forces, wanted.peak_force))])
    chosen = [each for each, is_new in zip(further.sets, new, strict=True) if is_new]
    if not chosen:
        return Compared((Missing(MissingCondition.FORCE, level, near),), nothing=True)
    missing = list[Missing]()
    if level is not None and not _close(near, level):
        missing.append(Missing(MissingCondition.FORCE, level, near))
    there = {point for each in chosen for point in each.inputs}
    left = tuple(point for point in wanted.inputs if point not in there)
    if left:
        missing.append(Missing(MissingCondition.POINTS, points=left))
    wanted_line, line = (float(max(np.max(each.frequency) for each in sets)) for sets in ((wanted,), chosen))
    if line < (1 - TOLERANCE) * wanted_line:
        missing.append(Missing(MissingCondition.HIGHEST_LINE, wanted_line, line))
    return Compared(tuple(missing), nothing=len(left) == len(wanted.inputs))


# --- points of the tester ---


def _tested(asked: Experiment, wanted: TesterPoints, before: Measurement, further: Measurement) -> Compared:
    points, first = further.points, before.points
    if points is None or first is None:
        return Compared((Missing(MissingCondition.TESTER_POINTS),), nothing=True)
    new, lacking = NOVELTIES[asked](wanted, first, points)
    if not np.any(new):
        return Compared((lacking,), nothing=True)
    chosen, missing = points.only(new), list[Missing]()
    if asked in (Experiment.HALF_AMPLITUDE, Experiment.RANDOM_ORDER):  # others are satisfied with any amplitude
        for amplitude in np.unique(wanted.amplitude):
            near = _nearest(chosen.amplitude, float(amplitude))
            if not _close(near, float(amplitude)):
                missing.append(Missing(MissingCondition.AMPLITUDE, float(amplitude), near))
    there, all_wanted = _mountings(chosen, further), _mountings(wanted, before)
    left = tuple(each for each in all_wanted if each not in there)
    if left:
        missing.append(Missing(MissingCondition.MOUNTINGS, mountings=left))
    lowest, highest = float(np.min(wanted.frequency)), float(np.max(wanted.frequency))
    low, high = float(np.min(chosen.frequency)), float(np.max(chosen.frequency))
    if asked is not Experiment.HIGHER_FREQUENCY and low > (1 + TOLERANCE) * lowest:
        missing.append(Missing(MissingCondition.LOWEST_FREQUENCY, lowest, low))
    if high < (1 - TOLERANCE) * highest:
        missing.append(Missing(MissingCondition.HIGHEST_FREQUENCY, highest, high))
    return Compared(tuple(missing), nothing=len(left) == len(all_wanted))


def _at_new_amplitude(wanted: TesterPoints, first: TesterPoints, points: TesterPoints) -> tuple[Chosen, Missing]:
    amplitude = float(wanted.amplitude[0])
    lacking = Missing(MissingCondition.AMPLITUDE, amplitude, _nearest(points.amplitude, amplitude))
    return _new(points.amplitude, amplitude, first.amplitude), lacking


def _at_any_new_amplitude(_wanted: TesterPoints, first: TesterPoints, points: TesterPoints) -> tuple[Chosen, Missing]:
    return _new(points.amplitude, None, first.amplitude), Missing(MissingCondition.AMPLITUDE)


def _above(wanted: TesterPoints, first: TesterPoints, points: TesterPoints) -> tuple[Chosen, Missing]:
    lacking = Missing(
        MissingCondition.HIGHEST_FREQUENCY, float(np.max(wanted.frequency)), float(np.max(points.frequency))
    )
    return np.asarray(points.frequency > NEW * np.max(first.frequency)), lacking


def _in_random_order(_wanted: TesterPoints, first: TesterPoints, points: TesterPoints) -> tuple[Chosen, Missing]:
    kept = _frequency_follows_order(points) or _order_is_that_of(first, points)
    return np.full(points.order.size, not kept), Missing(MissingCondition.RANDOM_ORDER)


NOVELTIES: dict[Experiment, Callable[[TesterPoints, TesterPoints, TesterPoints], tuple[Chosen, Missing]]] = {
    Experiment.HALF_AMPLITUDE: _at_new_amplitude,
    Experiment.OTHER_LEVELS: _at_any_new_amplitude,
    Experiment.HIGHER_FREQUENCY: _above,
    Experiment.RANDOM_ORDER: _in_random_order,
}
"""Functions of wanted, earlier and further points: which further points are new as wanted, (points,), and what is
missing if none is."""


def _frequency_follows_order(points: TesterPoints) -> bool:
    """Whether frequency rises or falls through each series, a mounting at one amplitude."""
    series = np.stack([points.specimen, points.configuration, points.amplitude], axis=1)
    found = [points.only(np.all(series == own, axis=1)) for own in np.unique(series, axis=0)]
    long = [each for each in found if np.unique(each.frequency).size >= SERIES]
    if sum(each.order.size for each in long) < FEWEST:
        return False
    return float(np.mean([abs(_correlation(each.order, each.frequency)) for each in long])) > IN_ORDER


def _order_is_that_of(first: TesterPoints, points: TesterPoints) -> bool:
    """Whether the points that both have are in one order."""
    same = np.equal.outer(points.specimen, first.specimen) & np.equal.outer(points.configuration, first.configuration)
    same &= _apart(points.amplitude[:, None], first.amplitude) < np.log(SAME)
    same &= _apart(points.frequency[:, None], first.frequency) < np.log(SAME)
    shared = np.any(same, axis=1)
    if np.count_nonzero(shared) < FEWEST:
        return False
    return _correlation(points.order[shared], first.order[np.argmax(same[shared], axis=1)]) > IN_ORDER


def _correlation(one: Real, other: Real) -> float:
    """Rank correlation; 0 where all values of one are equal."""
    if np.ptp(one) == 0 or np.ptp(other) == 0:
        return 0.0
    return float(np.corrcoef(rankdata(one), rankdata(other))[0, 1])


def _mountings(points: TesterPoints, of: Measurement) -> tuple[Mounting, ...]:
    pairs = np.unique(np.stack([points.specimen, points.configuration], axis=1), axis=0)
    return tuple(Mounting(of.drawing.joints[int(s)].name, Configuration(int(c))) for s, c in pairs)


def _new(values: Real, wanted: float | None, before: Real) -> Chosen:
    """(n,) whether values are nearer to the wanted one than to any before, or any new ones where none is wanted."""
    known = np.min(_apart(values[:, None], before), axis=1)
    return np.asarray(known > np.log(NEW) if wanted is None else _apart(values, wanted) < known)


def _apart(one: Real, other: Real | float) -> Real:
    """Distance by ratio."""
    return np.asarray(np.abs(np.log(one / other)))


def _nearest(values: Real, wanted: float) -> float:
    return float(values[np.argmin(_apart(values, wanted))])


def _close(measured: float, wanted: float) -> bool:
    return abs(measured - wanted) <= TOLERANCE * wanted
