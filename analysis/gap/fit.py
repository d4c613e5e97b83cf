"""The most likely parameters of one model, with noise and all priors in Gaussian form.

All unknowns are scores with a standard normal prior: the shared parameters of both rigs, the gain of each hammer set,
and the offset of the blows of each row from their node.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from analysis.dof import Direction
from analysis.frequency_response import Complex, Real
from analysis.gap.measurement import HammerSet, Measurement
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
    """

    rig: str
    set_number: int
    row: int
    unknowns: NDArray[np.intp]
    normal: Real
    descent: Real
    chi_square: float
    data: int


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
    def _first_blow(self) -> list[int]:
        """Index of the first blow offset of each set among the unknowns, and the number of unknowns."""
        counts = [len(each.inputs) for each in self.measurement.sets]
        return list(len(self.simulation.shared) + len(counts) + np.cumsum([0, *counts]))

    @property
    def unknowns(self) -> int:
        """Number of unknowns."""
        return self._first_blow[-1]

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
        gains = tolerances.sensor_gain * scores[shared : shared + len(self.measurement.sets)]
        blows = [tolerances.impact_position * scores[slice(*ends)] for ends in pairwise(self._first_blow)]
        state = self.simulation.state(scores[:shared], gains, blows)
        if last is not None:
            last.scores, last.state = scores, state
        return state

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
            for each, found in zip(self.measurement.sets, predicted.accelerances, strict=True):
                total += _square((each.accelerance - found) / self.deviation(each))
            if self.measurement.points is not None:
                total += _square((self.measurement.points.stiffness - predicted.stiffness) / self.tester_deviation)
        if not np.isfinite(total):
            return NOWHERE
        return Trial(total, partial(self._linearised, values, state))

    def _linearised(self, values: Real, state: State) -> Linearised:
        with np.errstate(all="ignore"):
            return normal_equations(self.blocks(values, state.prediction()), values)

    def blocks(self, values: Real, predicted: Prediction | None = None) -> tuple[Block, ...]:
        """The normal equations of each row and of the tester, linearised at `values` (unknowns,)."""
        predicted, shared = predicted or self.predict(values), len(self.simulation.shared)
        tolerances, found = self.measurement.tolerances, list[Block]()
        for number, each in enumerate(self.measurement.sets):
            weight = 1 / self.deviation(each)
            accelerance = predicted.accelerances[number]
            left = (each.accelerance - accelerance) * weight
            gain = values[shared + number] * tolerances.sensor_gain
            by_gain = tolerances.sensor_gain / (1 + gain) * accelerance
            for row, dof in enumerate(each.inputs):
                columns = [*predicted.by_shared[number][:, row], by_gain[row]]
                unknowns = [*range(shared), shared + number]
                if dof.direction is Direction.Y:
                    columns.append(predicted.by_blow[number][row])
                    unknowns.append(self._first_blow[number] + row)
                found.append(_block("inverse", number, row, unknowns, np.array(columns) * weight[row], left[row]))
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
            weight = 1 / self.deviation(each)
            parts.append((predicted.by_shared[number] * weight).reshape(len(shared), -1))
            left.append(((each.accelerance - predicted.accelerances[number]) * weight).ravel())
        points = self.measurement.points
        if points is not None:
            parts.append(predicted.stiffness_by_shared / self.tester_deviation)
            left.append((points.stiffness - predicted.stiffness) / self.tester_deviation)
        return _as_parts(np.concatenate(parts, axis=1)), _as_parts(np.concatenate(left))

    def own_columns(self, values: Real) -> Real:
        """(sets and rows, data) whitened derivatives in the gain of each set and in the blow offset of each row."""
        predicted, first = self.predict(values, (0,)), len(self.simulation.shared)
        tolerances, found, place = self.measurement.tolerances, np.zeros((self.unknowns - first, self.data)), 0
        for number, each in enumerate(self.measurement.sets):
            weight = 1 / self.deviation(each)
            gain = 1 + values[first + number] * tolerances.sensor_gain
            by_gain = _as_parts(tolerances.sensor_gain / gain * predicted.accelerances[number] * weight)
            by_blow = _as_parts(predicted.by_blow[number] * weight)
            for row in range(len(each.inputs)):
                at = slice(place, place + by_gain.shape[1])
                found[number, at] = by_gain[row]
                found[self._first_blow[number] - first + row, at] = by_blow[row]
                place = at.stop
        return found


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
        start: (unknowns,) scores.
        schedule: fits one after the other; the last should be `FINAL`.
        tolerance: gain in chi-square (over chi-square per datum) at which the last of them ends.
        most_steps: of each.
        hopeless: cost at the end of a stage above which the fit is given up.
    """
    found: Minimum | None = None
    scores, last_state = start, LastState(start)
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
