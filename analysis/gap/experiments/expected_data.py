"""The data that each explanation of a diagnosis expects from an experiment: further data of the rigs, or a reading.

The model is linear about its fit. Parameters are as uncertain as the data so far leave them; a new set-up has its own
gain, joints and offsets of blows. No law is exact: under new conditions the response to an effect is off by a smooth
share, and a cause in no catalogue may change the data by as much as the gap. Under conditions that were measured
before, both act as they did.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from analysis.frequency_response import Complex, Real
from analysis.gap.effect import Effect
from analysis.gap.evidence.calibration import Calibration
from analysis.gap.evidence.contest import TOLERANCE
from analysis.gap.evidence.model_evidence import overdispersed
from analysis.gap.evidence.verdict import UNKNOWN, Weighed
from analysis.gap.experiments.information import Expectation
from analysis.gap.findings.intervals import own_overdispersion
from analysis.gap.fitting.fit import in_other_set_up
from analysis.gap.fitting.likelihood import LastState, Likelihood
from analysis.gap.fitting.model import Model
from analysis.gap.fitting.normal_equations import as_parts
from analysis.gap.measurement import Drawing, HammerSet, Indices, Measurement, Rig, TesterPoints
from analysis.gap.parameter import Parameter

ERROR_WIDTH = 150.0
"""Hz, over which the error of a law, or what an unknown cause does, is smooth."""
NEW_RATIO = 2.0
"""Ratio of two forces, amplitudes or frequencies at which data at one say little about the other."""
NEW_ORDER = 0.5
"""Difference in the share of the test that is done, at which data at one time say little about the other."""
STEP = 1e-4
"""Step of a score, for finite differences."""


@dataclass(frozen=True)
class Reading:
    """A parameter of an effect that an instrument reads.

    Attributes:
        effect: id.
        parameter: its name, or the beginning of it where each joint or point has its own.
        deviation: standard deviation of what is read, in its unit.
        reciprocal: whether the reading is 1 over the parameter, which is zero where the effect is not there.
    """

    effect: str
    parameter: str
    deviation: float
    reciprocal: bool = False

    def of(self, value: float) -> float:
        """The reading at a value of the parameter."""
        return 1 / value if self.reciprocal else value


def expected_data(
    weighed: Sequence[Weighed[Model]],
    none: Model | None,
    further: Measurement,
    rigs: Sequence[Rig],
    calibration: Calibration,
) -> tuple[Expectation, ...]:
    """The data that explanations expect from a further measurement.

    Args:
        weighed: explanations, the verdict first; an unknown cause may deviate freely from the model that comes closest.
        none: the paper's model; if None, the whole data count as the gap.
        further: with its inputs, lines and noise; its values do not matter.
        rigs: whose data count.
        calibration: how wrong laws may be.
    """
    seen = as_expected(weighed[0].model, further)
    kept = _of_rigs(seen, rigs)
    smooth, in_tester = _smooth(weighed[0].model, seen)
    verdict, paper = _readings(weighed[0].model, seen), None if none is None else _readings(none, seen)
    gaps = [_distances(_readings(each.model, seen), paper) for each in weighed]
    found = []
    for each, gap in zip(weighed, gaps, strict=True):
        likelihood, scores = in_other_set_up(each.model.fit, seen)
        likelihood = replace(likelihood, last_state=LastState(scores))
        columns, left = likelihood.columns(scores, range(len(likelihood.simulation.shared)))
        own = likelihood.own_columns(scores)
        shared = _factor(each.model, len(columns), calibration)
        known = all(effect.form_is_known for effect in each.model.effects)
        again, repeated = _missed_again(each.model, weighed[0].model, seen, calibration)
        missed = repeated * _distances(_readings(each.model, seen), verdict)
        unknown = each.effects == UNKNOWN
        sizes = np.max(gaps, axis=0) if unknown else np.maximum(calibration.form_errors(known)[1] * gap, missed)
        errors = sizes[in_tester][:, None] * smooth[:, kept]
        spread = np.concatenate([shared.T @ columns[:, kept], own[:, kept], errors])
        spread = spread[np.any(spread, axis=1)]
        found.append(Expectation(each.probability, (again - left)[kept], spread))
    return tuple(found)


def _missed_again(model: Model, verdict: Model, seen: Measurement, calibration: Calibration) -> tuple[Real, float]:
    """(data,) misfit of a model to the first data, beside the verdict's, which further data repeat, over noise.

    Repeated data are no new evidence against an explanation that the first data already contradict. The second value
    says how far they do: 0 where the model misses no more than the verdict, 1 where it is refuted.
    """
    more = max(0.0, model.misfit.certain - verdict.misfit.certain)
    first, likelihood = verdict.fit.likelihood.measurement, Likelihood(verdict.fit.likelihood.simulation.of(seen))
    own, best = ([*each] for each in (_first_readings(model), _first_readings(verdict)))
    repeated, missed = more / (more + calibration.patterns), [b - a for a, b in zip(own, best, strict=True)]
    parts = list[Complex]()
    for each in seen.sets:
        new, place = new_rows(first, seen.drawing, each)
        rows = np.zeros(each.accelerance.shape, dtype=complex)
        for row, (point, at) in enumerate(zip(each.inputs, place, strict=True)):
            if new[row] < 1:
                there = first.sets[at]
                values = missed[at][there.inputs.index(point)]
                rows[row] = np.interp(each.frequency, there.frequency, values)
        parts.append(np.asarray(rows[None] / likelihood.deviation(each), dtype=complex))
    parts = [each.ravel() for each in likelihood.whitened(parts)]
    if seen.points is not None:
        new, nearest = new_points(first.points, seen.points)
        values = missed[-1][nearest] if first.points is not None else np.zeros_like(seen.points.stiffness)
        parts.append(np.asarray((new < 1) * values / seen.points.deviation, dtype=complex))
    return repeated * as_parts(np.concatenate(parts)), repeated


def _first_readings(model: Model) -> list[Complex]:
    return [*model.fit.readings.accelerances, model.fit.readings.stiffness]


Read = tuple[str, Reading]
"""A name, as in `readable_names`, and the reading that gives it."""


def expected_readings(
    weighed: Sequence[Weighed[Model]], read: Sequence[Read], calibration: Calibration
) -> tuple[Expectation, ...]:
    """The readings that explanations expect, over their standard deviation.

    An explanation without an effect expects the trace of it that every bench has, and so does an unknown cause. What is
    read twice, as by two instruments, is one parameter or one trace.

    Args:
        weighed: explanations.
        read: what is read, each name with its instrument; all of them say something, as of `relevant_readings`.
        calibration: how wrong laws may be.
    """
    traces = np.array([_trace(weighed, *each) for each in read])
    return tuple(_expected_reading(each, read, traces, calibration) for each in weighed)


def readable_names(weighed: Sequence[Weighed[Model]], readings: Sequence[Reading]) -> tuple[Read, ...]:
    """Names of the parameters of any explanation that an instrument reads: effect and parameter, joined by a point.

    Where a law of one explanation has a parameter for each joint or point, and that of another has one for all, only
    those of each are named.
    """
    names = dict[str, Reading]()
    for each in weighed:
        for effect in _known_effects(each):
            for parameter in effect.parameters:
                name = f"{effect.id}.{parameter.name}"
                reading = reading_of(name, readings)
                if reading is not None:
                    names[name] = reading
    of_each = {f"{read.effect}.{read.parameter}" for name, read in names.items() if _is_of_one(name, read)}
    return tuple((name, read) for name, read in names.items() if name not in of_each)


def relevant_readings(
    weighed: Sequence[Weighed[Model]], readings: Sequence[Reading], names: Collection[str]
) -> tuple[Read, ...]:
    """The given names, each with its reading, that belong to a parameter of an effect in any explanation.

    A name without a joint or point is the mean over all of them, where a law has a parameter for each.
    """
    known = [effect for each in weighed for effect in _known_effects(each)]
    found = [(name, reading) for name in names if (reading := reading_of(name, readings)) is not None]
    return tuple(
        (name, reading) for name, reading in found if any(_parameters_read(effect, name, reading) for effect in known)
    )


def _trace(weighed: Sequence[Weighed[Model]], name: str, reading: Reading) -> float:
    """The trace to expect where an effect is not there, in standard deviations of its reading."""
    return max(
        0.0 if parameter.positive else TOLERANCE * parameter.spread / reading.deviation
        for each in weighed
        for effect in _known_effects(each)
        for parameter in _parameters_read(effect, name, reading)
    )


def reading_of(name: str, readings: Sequence[Reading]) -> Reading | None:
    """The reading that gives a parameter, by its name as of `readable_names`; None where no reading does."""
    effect, _, parameter = name.partition(".")
    for each in readings:
        if each.effect == effect and (parameter == each.parameter or parameter.startswith(f"{each.parameter}_")):
            return each
    return None


def _known_effects(each: Weighed[Model]) -> Sequence[Effect]:
    return each.model.effects if each.effects != UNKNOWN else ()


def _is_of_one(name: str, reading: Reading) -> bool:
    """Whether a name is that of one joint or point."""
    return name != f"{reading.effect}.{reading.parameter}"


def _parameters_read(effect: Effect, name: str, reading: Reading) -> Sequence[Parameter]:
    """The parameters of an effect whose mean is read under a name: one, or that of each joint; empty for others."""
    if effect.id != reading.effect:
        return ()
    own = {each.name: each for each in effect.parameters if reading_of(f"{effect.id}.{each.name}", (reading,))}
    wanted = name.partition(".")[2]
    if wanted in own:
        return (own[wanted],)
    if _is_of_one(name, reading):  # a law of equal ones
        return (own[reading.parameter],) if reading.parameter in own else ()
    return tuple(own.values())


def _expected_reading(
    each: Weighed[Model], read: Sequence[Read], traces: Real, calibration: Calibration
) -> Expectation:
    fit, model = each.model.fit, each.model
    factor = _factor(model, len(fit.likelihood.simulation.shared), calibration)
    mean, columns = np.zeros(len(read)), np.zeros((len(factor), len(read)))
    for column, (name, reading) in enumerate(read):
        for number, effect in enumerate(_known_effects(each)):
            parameters = _parameters_read(effect, name, reading)
            for place, parameter in zip(model.places(number), effect.parameters, strict=True):
                if parameter in parameters:
                    score, share = float(fit.scores[place]), 1 / (len(parameters) * reading.deviation)
                    at, moved = (share * reading.of(parameter.value(score + step)) for step in (0.0, STEP))
                    mean[column] += at
                    columns[place, column] = (moved - at) / STEP
    names = np.array([name for name, _ in read])
    own = np.maximum(traces, calibration.least_form_error * np.abs(mean)) * np.equal.outer(np.unique(names), names)
    return Expectation(each.probability, mean, np.concatenate([factor.T @ columns, own]))


def as_expected(model: Model, further: Measurement) -> Measurement:
    """The further measurement as a model expects it, without noise."""
    likelihood, scores = in_other_set_up(model.fit, further)
    found = likelihood.predict(scores, derivatives=())
    sets = tuple(
        replace(each, accelerance=a, reference=None) for each, a in zip(further.sets, found.accelerances, strict=True)
    )
    points = None if further.points is None else replace(further.points, stiffness=found.stiffness)
    return replace(further, sets=sets, points=points)


def _factor(model: Model, shared: int, calibration: Calibration) -> Real:
    """(shared, shared) Cholesky factor of the covariance of a model's shared parameters, which its misfit widens."""
    covariance = overdispersed(model.fit, own_overdispersion(model, calibration)).covariance[:shared, :shared]
    return np.asarray(np.linalg.cholesky(covariance))


def _readings(model: Model, seen: Measurement) -> list[Complex]:
    likelihood, scores = in_other_set_up(model.fit, seen)
    found = likelihood.predict(scores, derivatives=())
    return [*found.accelerances, found.stiffness]


def _distances(readings: Sequence[Complex], others: Sequence[Complex] | None) -> Real:
    """(2,) relative difference of two models' readings in the beam rig and in the tester; 1 if `others` is None."""
    if others is None:
        return np.ones(2)
    pairs = list(zip(readings, others, strict=True))
    shares = [float(np.linalg.norm(a - b) / np.linalg.norm(b)) if b.size else 0.0 for a, b in pairs]
    return np.array([max(shares[:-1], default=0.0), shares[-1]])


def _of_rigs(seen: Measurement, rigs: Sequence[Rig]) -> np.ndarray:
    """(data,) whether each real or imaginary part belongs to these rigs."""
    sets = 2 * sum(each.accelerance.size for each in seen.sets)
    points = 0 if seen.points is None else 2 * seen.points.order.size
    return np.concatenate([np.full(sets, Rig.BEAM in rigs), np.full(points, Rig.TESTER in rigs)])


def _smooth(model: Model, seen: Measurement) -> tuple[Real, Indices]:
    """(k, data) smooth errors of a relative size of one: of each row, and of each series of the tester.

    The second array, (k,), is 1 for errors of the tester, 0 for others.
    """
    likelihood, first = Likelihood(model.fit.likelihood.simulation.of(seen)), model.fit.likelihood.measurement
    rows = [_smooth_rows(likelihood, first, each) for each in seen.sets]
    whole = [np.zeros((sum(len(each) for each in rows), *each.accelerance.shape), complex) for each in seen.sets]
    place = 0
    for own, columns in zip(whole, rows, strict=True):
        own[place : place + len(columns)] = columns
        place += len(columns)
    beam = [as_parts(each.reshape(len(each), -1)) for each in likelihood.whitened(whole)]
    points = [] if seen.points is None else [_smooth_points(first, seen.points)]
    blocks = [*([np.concatenate(beam, axis=1)] if beam else []), *points]
    of_part = [np.full(len(each), number >= len(rows), dtype=np.intp) for number, each in enumerate([*rows, *points])]
    return block_diag(*blocks), np.concatenate(of_part)


def new_rows(first: Measurement, drawing: Drawing, each: HammerSet) -> tuple[Real, Indices]:
    """(rows,) novelty of each row: 0 where it repeats a row of the first measurement, 1 where no row tells about it.

    The second array, (rows,), is the index of the set with the nearest row.
    """
    nothing = np.zeros(len(each.inputs), dtype=np.intp)
    if drawing is not first.drawing or not first.sets:  # another accelerometer, or another place of it
        return np.ones(len(each.inputs)), nothing
    distance = np.array(
        [
            [
                abs(np.log(each.peak_force / other.peak_force)) / np.log(NEW_RATIO) if point in other.inputs else np.inf
                for other in first.sets
            ]
            for point in each.inputs
        ]
    )
    return _new(np.min(distance, axis=1)), np.argmin(distance, axis=1)


def new_points(first: TesterPoints | None, points: TesterPoints) -> tuple[Real, Indices]:
    """(points,) novelty of each point of the tester, as in `new_rows`, and (points,) index of the nearest point."""
    if first is None:
        return np.ones(points.order.size), np.zeros(points.order.size, dtype=np.intp)
    distance = np.hypot(
        np.subtract.outer(np.log(points.amplitude), np.log(first.amplitude)) / np.log(NEW_RATIO),
        np.subtract.outer(np.log(points.frequency), np.log(first.frequency)) / np.log(NEW_RATIO),
    )
    distance = np.hypot(distance, np.subtract.outer(points.fraction, first.fraction) / NEW_ORDER)
    alike = np.equal.outer(points.specimen, first.specimen) & np.equal.outer(points.configuration, first.configuration)
    distance = np.where(alike, distance, np.inf)
    return _new(np.min(distance, axis=1)), np.argmin(distance, axis=1)


def _new(distance: Real) -> Real:
    """Unknown share of a process whose correlation falls with distance as a Gaussian."""
    return np.asarray(np.sqrt(-np.expm1(-(distance**2))))


def _hats(frequency: Real) -> Real:
    """(knots, n) triangles over frequency that sum to one."""
    knots = np.linspace(frequency.min(), frequency.max(), 2 + int(np.ptp(frequency) // ERROR_WIDTH))
    if np.ptp(frequency) == 0.0:
        return np.ones((1, frequency.size))
    return np.array([np.interp(frequency, knots, row) for row in np.eye(knots.size)])


def _smooth_rows(likelihood: Likelihood, first: Measurement, each: HammerSet) -> Complex:
    """(k, rows, lines) smooth errors of the rows of a set, over noise."""
    hats, new = _hats(each.frequency), new_rows(first, likelihood.measurement.drawing, each)[0]
    over_noise = new[:, None] * each.accelerance / likelihood.deviation(each)
    columns = np.concatenate([hats, 1j * hats]) / np.sqrt(2)
    rows = np.eye(len(over_noise))[:, None, :, None] * columns[:, None] * over_noise
    return np.asarray(rows.reshape(-1, *over_noise.shape))


def _smooth_points(first: Measurement, points: TesterPoints) -> Real:
    hats, found = _hats(points.frequency), list[Real]()
    over_noise = new_points(first.points, points)[0] * points.stiffness / points.deviation
    series = np.stack([points.specimen, points.configuration, points.amplitude], axis=1)
    for own in np.unique(series, axis=0):
        columns = np.concatenate([hats, 1j * hats]) * over_noise * np.all(series == own, axis=1) / np.sqrt(2)
        found.append(as_parts(columns))
    return np.concatenate(found)
