"""The most likely parameters of one model, with noise and all priors in Gaussian form.

All unknowns are scores with a standard normal prior: the shared parameters of both rigs, the gain of each hammer set
and the stiffness of its joints, the offset of the blows of each row from their node, and where joints follow motion
doubts about it for each point and row. Accelerances have noise and smooth errors (`model_error`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from analysis.dof import Direction, Dof
from analysis.frequency_response import Complex, Real
from analysis.gap.blow_motion import POINT_DOUBT, ROW_DOUBT
from analysis.gap.measurement import HammerSet, Measurement
from analysis.gap.model_error import SmoothErrors, smooth_errors
from analysis.gap.scales import Scales, log_prior
from analysis.gap.simulation import Prediction, Simulation, State
from analysis.inverse.levenberg_marquardt import NOWHERE, Linearised, Minimum, Trial, inverse, minimise


@dataclass(frozen=True)
class Stage:
    """One of several fits in a row, which avoid local minima.

    Attributes:
        inflation: share of |H| by which the noise of accelerances is inflated.
        highest: end of the band, Hz.
        tester: share of |k| by which the noise of the tester is inflated.
    """

    inflation: float = 0.0
    highest: float = np.inf
    tester: float = 0.0


FINAL = Stage()
FROM_AFAR = (
    *(Stage(share, highest, share) for share, highest in ((0.5, 150.0), (0.3, 300.0), (0.1, 600.0))),
    *(Stage(share, tester=share) for share in (0.03, 0.01)),
    FINAL,
)
"""For a start at the centre of the priors."""
CLOSE = (Stage(0.1, tester=0.1), Stage(0.03, tester=0.03), FINAL)
"""For a start near the solution."""
FROM_TESTER = (Stage(1.0), Stage(0.3), Stage(0.1), Stage(0.03), FINAL)
"""For a law of the elastomer: the tester shows it, and the beam follows in later stages."""
FARTHEST = 50.0
"""Standard deviations from the prior that no parameter exceeds."""
EARLY_GAIN = 30.0
"""Gain in chi-square (over chi-square per datum) at which all stages but the last end."""


@dataclass(frozen=True, eq=False)
class Block:
    """The normal equations of one row of accelerances, or of all points of the tester, in some of the unknowns.

    Attributes:
        rig: "inverse" or "direct".
        set_number, row: indices of the row; -1 in the tester.
        unknowns: (n,) indices of the unknowns that it depends on.
        normal: (n, n) J^t J.
        descent: (n,) J^t r.
        chi_square: r^t r.
        data: number of real and imaginary parts.
        smooth: (n + 1, K) J and r along the modes of smooth errors, already left out of the above; None without them.
    """

    rig: str
    set_number: int
    row: int
    unknowns: NDArray[np.intp]
    normal: Real
    descent: Real
    chi_square: float
    data: int
    smooth: Complex | None = None

    def less(self, share: Real) -> Block:
        """Without a (K,) share of the squares along the modes of smooth errors; a negative share adds them."""
        assert self.smooth is not None, "a block of accelerances"
        products = _as_parts(self.smooth * share) @ _as_parts(self.smooth).T
        return replace(
            self,
            normal=self.normal - products[:-1, :-1],
            descent=self.descent - products[:-1, -1],
            chi_square=self.chi_square - float(products[-1, -1]),
        )


@dataclass(eq=False)
class LastState:
    """The state of a simulation that was computed last: the next stage of a fit begins where this one ended.

    Attributes:
        scores: (unknowns,).
        state: of both rigs at these scores.
    """

    scores: Real
    state: State | None = None


@dataclass(frozen=True, eq=False)
class Likelihood:
    """A sum of squares over unknown scores for one simulation.

    Attributes:
        simulation: with its measurement.
        inflation, tester: shares of the measured values that are added to their standard deviation, for each rig.
        last_state: shared by the likelihoods of one simulation; None where no state is kept.
    """

    simulation: Simulation
    inflation: float = 0.0
    tester: float = 0.0
    last_state: LastState | None = None

    @property
    def measurement(self) -> Measurement:
        """The data that are fitted."""
        return self.simulation.baseline.measurement

    @cached_property
    def setups(self) -> tuple[range, ...]:
        """For each set, the indices of its gain and of the stiffness of each joint among the unknowns."""
        first, each = len(self.simulation.shared), 1 + len(self.measurement.drawing.joints)
        return tuple(range(first + each * n, first + each * (n + 1)) for n in range(len(self.measurement.sets)))

    @cached_property
    def first_blow(self) -> list[int]:
        """Index of the first blow offset of each set among the unknowns, and of the first doubt about motion."""
        counts = [len(each.inputs) for each in self.measurement.sets]
        first = self.setups[-1].stop if self.setups else len(self.simulation.shared)
        return list(first + np.cumsum([0, *counts]))

    @property
    def scales(self) -> Scales:
        """Of what differs on every bench."""
        return self.simulation.baseline.scales

    def smooth_errors(self, number: int) -> SmoothErrors | None:
        """Of one hammer set; None where inflated noise hides them."""
        if self.inflation or not self.scales.model_error:
            return None
        return smooth_errors(self.measurement.sets[number], self.scales.correlation)

    @cached_property
    def log_normalisation(self) -> float:
        """Of the density of smooth errors over that of noise alone, with the prior of the scales."""
        errors = [self.smooth_errors(number) for number in range(len(self.measurement.sets))]
        spread = sum(each.log_determinant(self.scales.model_error) for each in errors if each is not None)
        return log_prior(self.scales, self.measurement.tolerances) - spread / 2

    @cached_property
    def points(self) -> tuple[Dof, ...]:
        """Points that were struck, each with its doubts about the motion of the joints; none where no effect asks."""
        struck = dict.fromkeys(dof for each in self.measurement.sets for dof in each.inputs)
        return tuple(struck) if self.simulation.follows_motion else ()

    def point_doubts(self, point: Dof) -> range:
        """Indices of the doubts of a point among the unknowns: one for each joint and axis."""
        return self._doubts(self.points.index(point)) if self.points else range(0)

    def row_doubts(self, number: int, row: int) -> range:
        """Indices of the further doubts of a row."""
        place = len(self.points) + self.first_blow[number] - self.first_blow[0] + row
        return self._doubts(place) if self.points else range(0)

    def _doubts(self, place: int) -> range:
        each = 2 * len(self.measurement.drawing.joints)
        return range(self.first_blow[-1] + each * place, self.first_blow[-1] + each * (place + 1))

    @cached_property
    def unknowns(self) -> int:
        """Number of unknowns."""
        sets = self.measurement.sets
        return self.row_doubts(len(sets) - 1, len(sets[-1].inputs) - 1).stop if self.points else self.first_blow[-1]

    @property
    def data(self) -> int:
        """Number of real and imaginary parts."""
        points = self.measurement.points
        return 2 * (
            sum(each.accelerance.size for each in self.measurement.sets) + (0 if points is None else points.order.size)
        )

    def predict(self, scores: Real, derivatives: Sequence[int] | None = None) -> Prediction:
        """Readings of both rigs for `scores` (unknowns,), with derivatives in some shared parameters, or in all."""
        return self._state(scores).prediction(derivatives)

    def _state(self, scores: Real) -> State:
        """The state of both rigs for `scores` (unknowns,)."""
        last = self.last_state
        if last is not None and last.state is not None and np.array_equal(scores, last.scores):
            return last.state
        shared, tolerances = len(self.simulation.shared), self.measurement.tolerances
        of_setups = scores[shared : self.first_blow[0]].reshape(-1, 1 + len(self.measurement.drawing.joints))
        gains, stiffness = tolerances.sensor_gain * of_setups[:, 0], self.scales.setup_scatter * of_setups[:, 1:]
        blows = [tolerances.impact_position * scores[slice(*ends)] for ends in pairwise(self.first_blow)]
        doubts = [
            np.array([self._doubt(scores, number, row) for row in range(len(each.inputs))])
            for number, each in enumerate(self.measurement.sets)
        ]
        state = self.simulation.state(scores[:shared], gains, stiffness, blows, doubts)
        if last is not None:
            last.scores, last.state = scores, state
        return state

    def _doubt(self, scores: Real, number: int, row: int) -> Real:
        """(2 joints,) logarithm of `Felt.doubt` for a row; empty where no effect follows motion."""
        point = self.measurement.sets[number].inputs[row]
        of_row = ROW_DOUBT * scores[self.row_doubts(number, row)]
        return np.asarray(POINT_DOUBT * scores[self.point_doubts(point)] + of_row)

    def deviation(self, hammer_set: HammerSet) -> Real:
        """(rows, lines) inflated standard deviation of a set."""
        return np.hypot(hammer_set.deviation, self.inflation * np.abs(hammer_set.accelerance))

    @cached_property
    def tester_deviation(self) -> Real:
        """(points,) inflated standard deviation of the tester."""
        points = self.measurement.points
        assert points is not None
        return np.hypot(points.deviation, self.tester * np.abs(points.stiffness))

    def at(self, values: Real) -> Trial:
        """Chi-square and the squared scores at `values` (unknowns,); `NOWHERE` for an impossible bench."""
        if np.max(np.abs(values)) > FARTHEST:
            return NOWHERE
        with np.errstate(all="ignore"):
            state = self._state(values)
            predicted, total = state.prediction(()), float(values @ values)
            for number, (each, found) in enumerate(zip(self.measurement.sets, predicted.accelerances, strict=True)):
                left = (each.accelerance - found) / self.deviation(each)
                total += _square(left) - self._smooth(number, left)
            if self.measurement.points is not None:
                total += _square((self.measurement.points.stiffness - predicted.stiffness) / self.tester_deviation)
        if not np.isfinite(total):
            return NOWHERE
        return Trial(total, partial(self._linearised, values, state))

    def _smooth(self, number: int, left: Complex) -> float:
        """The part of the square of whitened rows (rows, lines) that smooth errors explain."""
        errors, scale = self.smooth_errors(number), self.scales.model_error
        if errors is None:
            return 0.0
        along = [errors.along(row, each[None])[0] for row, each in enumerate(left)]
        return sum(float(errors.share(row, scale) @ np.abs(each) ** 2) for row, each in enumerate(along))

    def _linearised(self, values: Real, state: State) -> Linearised:
        with np.errstate(all="ignore"):
            return normal_equations(self.blocks(values, state.prediction()), values)

    def blocks(self, values: Real, predicted: Prediction | None = None) -> tuple[Block, ...]:
        """The normal equations of each row and of the tester, linearised at `values` (unknowns,)."""
        predicted, shared = predicted or self.predict(values), len(self.simulation.shared)
        tolerances, found = self.measurement.tolerances, list[Block]()
        for number, each in enumerate(self.measurement.sets):
            weight, errors = 1 / self.deviation(each), self.smooth_errors(number)
            accelerance = predicted.accelerances[number]
            left = (each.accelerance - accelerance) * weight
            gain = values[self.setups[number][0]] * tolerances.sensor_gain
            by_gain = tolerances.sensor_gain / (1 + gain) * accelerance
            for row, dof in enumerate(each.inputs):
                columns = [*predicted.by_shared[number][:, row], by_gain[row], *predicted.by_setup[number][:, row]]
                unknowns = [*range(shared), *self.setups[number]]
                if dof.direction is Direction.Y:
                    columns.append(predicted.by_blow[number][row])
                    unknowns.append(self.first_blow[number] + row)
                by_doubt = predicted.by_doubt[number][:, row]
                columns += [*(POINT_DOUBT * by_doubt), *(ROW_DOUBT * by_doubt)]
                unknowns += [*self.point_doubts(dof), *self.row_doubts(number, row)]
                weighted = np.array(columns) * weight[row]
                block = _block("inverse", number, row, unknowns, weighted, left[row])
                if errors is not None:
                    along = errors.along(row, np.concatenate([weighted, left[row : row + 1]]))
                    block = replace(block, smooth=along).less(errors.share(row, self.scales.model_error))
                found.append(block)
        points = self.measurement.points
        if points is not None:
            weight = 1 / self.tester_deviation
            left = (points.stiffness - predicted.stiffness) * weight
            columns_of_points = predicted.stiffness_by_shared * weight
            found.append(_block("direct", -1, -1, list(range(shared)), columns_of_points, left))
        return tuple(found)

    def columns(self, values: Real, shared: Sequence[int]) -> tuple[Real, Real]:
        """(shared, data) whitened derivatives in some shared parameters, and (data,) the whitened residual."""
        predicted, parts, left = self.predict(values, shared), list[Complex](), list[Complex]()
        for number, each in enumerate(self.measurement.sets):
            columns = self._whitened(number, predicted.by_shared[number])
            parts.append(columns.reshape(len(shared), -1))
            left.append(self._whitened(number, each.accelerance - predicted.accelerances[number]).ravel())
        points = self.measurement.points
        if points is not None:
            parts.append(predicted.stiffness_by_shared / self.tester_deviation)
            left.append((points.stiffness - predicted.stiffness) / self.tester_deviation)
        return _as_parts(np.concatenate(parts, axis=1)), _as_parts(np.concatenate(left))

    def own_columns(self, values: Real) -> Real:
        """(own unknowns, data) whitened derivatives in those of each set-up and of each row."""
        predicted, first = self.predict(values, (0,)), len(self.simulation.shared)
        tolerances, found, place = self.measurement.tolerances, np.zeros((self.unknowns - first, self.data)), 0
        for number, each in enumerate(self.measurement.sets):
            own = np.array(self.setups[number]) - first
            gain = 1 + values[first + own[0]] * tolerances.sensor_gain
            by_gain = tolerances.sensor_gain / gain * predicted.accelerances[number][None]
            doubts = [scale * predicted.by_doubt[number] for scale in (POINT_DOUBT, ROW_DOUBT)]
            by_row = [predicted.by_blow[number][None], *doubts]
            columns = _as_parts(self._whitened(number, np.concatenate([by_gain, predicted.by_setup[number], *by_row])))
            for row, dof in enumerate(each.inputs):
                at = slice(place, place + columns.shape[2])
                doubts_of = *self.point_doubts(dof), *self.row_doubts(number, row)
                of_row = self.first_blow[number] + row, *doubts_of
                found[[*own, *np.array(of_row) - first], at] = columns[:, row]
                place = at.stop
        return found

    def residuals(self, scores: Real) -> tuple[Complex, ...]:
        """For each set, (rows, lines) what is left over noise and smooth errors."""
        pairs = zip(self.measurement.sets, self.predict(scores, ()).accelerances, strict=True)
        return tuple(self._whitened(n, each.accelerance - found) for n, (each, found) in enumerate(pairs))

    def _whitened(self, number: int, values: Complex) -> Complex:
        """(..., rows, lines) values of one set over noise and smooth errors."""
        found, errors = values / self.deviation(self.measurement.sets[number]), self.smooth_errors(number)
        if errors is None:
            return found
        rows = range(found.shape[-2])
        whole = [errors.whitened(n, np.atleast_2d(found[..., n, :]), self.scales.model_error) for n in rows]
        return np.asarray(np.stack(whole, axis=-2).reshape(found.shape))


def normal_equations(blocks: Sequence[Block], values: Real) -> Linearised:
    """The sum of the normal equations of some blocks and of the prior."""
    normal, descent, cost = np.eye(values.size), -values.copy(), float(values @ values)
    for block in blocks:
        normal[np.ix_(block.unknowns, block.unknowns)] += block.normal
        descent[block.unknowns] += block.descent
        cost += block.chi_square
    return Linearised(cost, descent, normal)


def _block(rig: str, number: int, row: int, unknowns: list[int], columns: Complex, left: Complex) -> Block:
    parts, residual = _as_parts(columns), _as_parts(left)
    normal, descent, chi_square = parts @ parts.T, parts @ residual, float(residual @ residual)
    return Block(rig, number, row, np.array(unknowns), normal, descent, chi_square, residual.size)


def _as_parts(values: Complex) -> Real:
    """(..., 2 n) real and imaginary parts of (..., n)."""
    return np.ascontiguousarray(values).view(np.float64)


def _square(values: Complex) -> float:
    return float(np.vdot(values, values).real)


@dataclass(frozen=True, eq=False)
class Fit:
    """The most likely parameters of one model.

    Attributes:
        likelihood: that was maximised.
        scores: (unknowns,).
        at: the normal equations at `scores`.
        converged: whether the search ended before its limit of steps.
    """

    likelihood: Likelihood
    scores: Real
    at: Linearised
    converged: bool

    @property
    def chi_square(self) -> float:
        """Without the priors."""
        return self.at.cost - float(self.scores @ self.scores)

    @property
    def per_datum(self) -> float:
        """Chi-square per real or imaginary part."""
        return self.chi_square / self.likelihood.data

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """The normal equations of each row and of the tester."""
        return self.likelihood.blocks(self.scores)

    @cached_property
    def covariance(self) -> Real:
        """(unknowns, unknowns) of the scores."""
        return inverse(self.at.normal)

    @property
    def deviations(self) -> Real:
        """(unknowns,) standard deviations of the scores."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def value(self, name: str) -> float:
        """Of a shared parameter."""
        for parameter, score in zip(self.likelihood.simulation.shared, self.scores, strict=False):
            if parameter.name == name:
                return float(np.real(parameter.value(float(score))))
        raise KeyError(name)


def evaluated(likelihood: Likelihood, scores: Real) -> Fit:
    """A likelihood evaluated at `scores`, which need not be its maximum."""
    return Fit(likelihood, scores, likelihood.at(scores).linearised(), converged=False)


def as_unknowns(scores: Real, likelihood: Likelihood) -> Real:
    """(unknowns,) of the first of them, or of more: those of doubts that are missing are zero."""
    rest = likelihood.unknowns - scores.size
    return np.concatenate([scores, np.zeros(rest)]) if rest > 0 else scores[: likelihood.unknowns]


def in_other_set_up(found: Fit, measurement: Measurement) -> tuple[Likelihood, Real]:
    """The likelihood of another measurement, and (unknowns,) scores: the shared ones of a fit, and zero for its own."""
    likelihood = Likelihood(found.likelihood.simulation.of(measurement))
    scores, shared = np.zeros(likelihood.unknowns), len(likelihood.simulation.shared)
    scores[:shared] = found.scores[:shared]
    return likelihood, scores


def fit(
    simulation: Simulation,
    start: Real,
    schedule: Sequence[Stage] = FROM_AFAR,
    tolerance: float = 1e-2,
    most_steps: int = 30,
    hopeless: Mapping[Stage, float] = MappingProxyType({}),
) -> Fit:
    """Find the most likely parameters.

    Args:
        simulation: the model.
        start: (unknowns,) scores, with or without doubts about motion.
        schedule: fits one after the other; the last should be `FINAL`.
        tolerance: gain in chi-square (over chi-square per datum) at which the last of them ends.
        most_steps: of each.
        hopeless: cost at the end of a stage above which the fit is given up.
    """
    found: Minimum | None = None
    scores = as_unknowns(start, Likelihood(simulation))
    last_state = LastState(scores)
    for stage in schedule:
        whole = stage.highest == np.inf
        seen = simulation if whole else _below(simulation, stage.highest)
        likelihood = Likelihood(seen, stage.inflation, stage.tester, last_state if whole else None)
        found = minimise(likelihood, scores, tolerance if stage is schedule[-1] else EARLY_GAIN, most_steps)
        scores = found.values
        if stage != FINAL and found.at.cost > hopeless.get(stage, np.inf):
            return replace(
                evaluated(Likelihood(simulation, last_state=last_state), scores), likelihood=Likelihood(simulation)
            )
    assert found is not None
    return Fit(replace(likelihood, last_state=None), found.values, found.at, found.converged)


def _below(simulation: Simulation, highest: float) -> Simulation:
    """The simulation of what was measured up to `highest` Hz."""
    measurement = simulation.baseline.measurement
    sets = tuple(each.lines(each.frequency <= highest) for each in measurement.sets)
    return simulation.of(replace(measurement, sets=sets))
