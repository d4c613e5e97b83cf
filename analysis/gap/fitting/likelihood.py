"""The likelihood of one model, with noise and all priors in Gaussian form.

All unknowns are scores with a standard normal prior: the shared parameters of both rigs, the gain of each hammer set
and the stiffness of its joints, offset and lean of the blows at each point and of each row and, where joints follow
motion, errors of their amplitudes for each point and row. Accelerances have noise and smooth errors (`model_error`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from analysis.dof import Dof
from analysis.frequency_response import Complex, Real
from analysis.gap.fitting.model_error import PointErrors, Row, RowErrors, smooth_errors
from analysis.gap.fitting.normal_equations import NormalBlock, as_parts, normal_equations
from analysis.gap.measurement import HammerSet, Measurement, Rig
from analysis.gap.parameter import Parameter
from analysis.gap.simulation.blow_motion import POINT_SCATTER, ROW_SCATTER
from analysis.gap.simulation.scales import Scales, log_prior
from analysis.gap.simulation.simulation_state import Prediction, SimulationState, state_of
from analysis.gap.simulation.two_rigs import Simulation
from analysis.inverse.levenberg_marquardt import NOWHERE, Linearised, Trial

FARTHEST = 50.0
"""Standard deviations from the prior that no parameter exceeds."""
BLOW_AT_POINT, BLOW_OF_ROW = float(np.sqrt(0.5)), float(np.sqrt(0.5))
"""Standard deviations of what the blows at a point have in common in all sets, and of what each set adds to it, over
that of offset and lean of a row. A mark in the wrong place and the stance of a person stay; it is not known how far."""


@dataclass(eq=False)
class LastState:
    """The state of a simulation that was computed last: the next stage of a fit begins where this one ended.

    Attributes:
        scores: (unknowns,).
        state: of both rigs at these scores.
    """

    scores: Real
    state: SimulationState | None = None


@dataclass(frozen=True, eq=False)
class Likelihood:
    """A sum of squares over unknown scores for one simulation.

    Attributes:
        simulation: with its measurement.
        inflation, tester_inflation: shares of the measured values that are added in quadrature to their standard
            deviations, of the beam rig and of the tester.
        last_state: shared by the likelihoods of one simulation; None where no state is kept.
    """

    simulation: Simulation
    inflation: float = 0.0
    tester_inflation: float = 0.0
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
    def struck(self) -> tuple[Dof, ...]:
        """Points struck in any set, in an order that does not depend on the sets."""
        return tuple(sorted({dof for each in self.measurement.sets for dof in each.inputs}))

    @cached_property
    def first_blow(self) -> list[int]:
        """Index of the first blow offset of the points among the unknowns, of each set, and of amplitude errors.

        Leans follow offsets, of all points as of the rows of each set.
        """
        counts = [2 * len(self.struck), *(2 * len(each.inputs) for each in self.measurement.sets)]
        first = self.setups[-1].stop if self.setups else len(self.simulation.shared)
        return list(first + np.cumsum([0, *counts]))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of the bench and of the effects."""
        return self.simulation.shared

    @property
    def scales(self) -> Scales:
        """Scales of the nuisances."""
        return self.simulation.baseline.scales

    @property
    def smooth_errors(self) -> tuple[PointErrors, ...]:
        """Smooth errors of all rows, by point; none where inflated noise hides them."""
        scales, sets = self.scales, self.measurement.sets
        if self.inflation or not scales.model_error or not sets:
            return ()
        return smooth_errors(sets, scales.model_error, scales.correlation, scales.common)

    @property
    def errors_of_rows(self) -> dict[Row, RowErrors]:
        """Smooth errors of each row, by set and row."""
        return {row: own for point in self.smooth_errors for row, own in zip(point.rows, point.errors, strict=True)}

    @cached_property
    def log_normalisation(self) -> float:
        """Log normalisation of the density with smooth errors over that of noise alone, with the scales' prior."""
        spread = sum(each.log_determinant for each in self.smooth_errors)
        return log_prior(self.scales, self.measurement.tolerances) - spread / 2

    @cached_property
    def points(self) -> tuple[Dof, ...]:
        """Points struck, each with its errors of the joints' amplitudes; none where no effect follows motion."""
        return self.struck if self.simulation.follows_motion else ()

    def blow_of_row(self, number: int, row: int) -> tuple[int, int]:
        """Indices of what a row adds to the offset and to the lean of the blows at its point among the unknowns."""
        offset = self.first_blow[1 + number] + row
        return offset, offset + len(self.measurement.sets[number].inputs)

    def blow_at_point(self, point: Dof) -> tuple[int, int]:
        """Indices of the offset and of the lean that the blows at a point have in all sets."""
        offset = self.first_blow[0] + self.struck.index(point)
        return offset, offset + len(self.struck)

    def amplitudes_of_point(self, point: Dof) -> range:
        """Indices of the amplitude errors of a point among the unknowns: one for each joint and axis."""
        return self._amplitudes(self.points.index(point)) if self.points else range(0)

    def amplitudes_of_row(self, number: int, row: int) -> range:
        """Indices of the amplitude errors of a row."""
        before = sum(len(each.inputs) for each in self.measurement.sets[:number])
        return self._amplitudes(len(self.points) + before + row) if self.points else range(0)

    def _amplitudes(self, place: int) -> range:
        each = 2 * len(self.measurement.drawing.joints)
        return range(self.first_blow[-1] + each * place, self.first_blow[-1] + each * (place + 1))

    @cached_property
    def unknowns(self) -> int:
        """Number of unknowns."""
        sets = self.measurement.sets
        if not self.points:
            return self.first_blow[-1]
        return self.amplitudes_of_row(len(sets) - 1, len(sets[-1].inputs) - 1).stop

    @property
    def data(self) -> int:
        """Number of real and imaginary parts."""
        points = self.measurement.points
        return 2 * (
            sum(each.accelerance.size for each in self.measurement.sets) + (0 if points is None else points.order.size)
        )

    def predict(self, scores: Real, derivatives: Sequence[int] | None = None, own: bool = True) -> Prediction:
        """Readings of both rigs for `scores` (unknowns,), with derivatives as of `SimulationState.prediction`."""
        return self.state(scores).prediction(derivatives, own)

    def state(self, scores: Real) -> SimulationState:
        """The state of both rigs for `scores` (unknowns,)."""
        last = self.last_state
        if last is not None and last.state is not None and np.array_equal(scores, last.scores):
            return last.state
        shared, tolerances = len(self.simulation.shared), self.measurement.tolerances
        of_setups = scores[shared : self.first_blow[0]].reshape(-1, 1 + len(self.measurement.drawing.joints))
        gains, stiffness = tolerances.sensor_gain * of_setups[:, 0], self.scales.setup_scatter * of_setups[:, 1:]
        blows = [self._blows(scores, number) for number in range(len(self.measurement.sets))]
        errors = [
            np.array([self._amplitude_errors(scores, number, row) for row in range(len(each.inputs))])
            for number, each in enumerate(self.measurement.sets)
        ]
        state = state_of(self.simulation, scores[:shared], gains, stiffness, blows, errors)
        if last is not None:
            last.scores, last.state = scores, state
        return state

    def _blows(self, scores: Real, number: int) -> Real:
        """(2, rows) offsets, m, and leans, rad, of the blows of a set."""
        points = np.array([self.blow_at_point(point) for point in self.measurement.sets[number].inputs])
        of_rows = scores[slice(*self.first_blow[1 + number : 3 + number])].reshape(2, -1)
        scatter = np.array([[self.measurement.tolerances.impact_position], [self.scales.blow_lean]])
        return np.asarray(scatter * (BLOW_AT_POINT * scores[points].T + BLOW_OF_ROW * of_rows))

    def _amplitude_errors(self, scores: Real, number: int, row: int) -> Real:
        """(2 joints,) logarithm of `BlowAmplitudes.error` for a row; empty where no effect follows motion."""
        point = self.measurement.sets[number].inputs[row]
        of_row = ROW_SCATTER * scores[self.amplitudes_of_row(number, row)]
        return np.asarray(POINT_SCATTER * scores[self.amplitudes_of_point(point)] + of_row)

    def deviation(self, hammer_set: HammerSet) -> Real:
        """(rows, lines) inflated standard deviation of a set."""
        return np.hypot(hammer_set.deviation, self.inflation * np.abs(hammer_set.accelerance))

    @cached_property
    def tester_deviation(self) -> Real:
        """(points,) inflated standard deviation of the tester."""
        points = self.measurement.points
        assert points is not None
        return np.hypot(points.deviation, self.tester_inflation * np.abs(points.stiffness))

    def at(self, values: Real) -> Trial:
        """Chi-square and the squared scores at `values` (unknowns,); `NOWHERE` for an impossible bench."""
        if np.max(np.abs(values)) > FARTHEST:
            return NOWHERE
        with np.errstate(all="ignore"):
            state = self.state(values)
            predicted, total = state.prediction(()), float(values @ values)
            pairs = zip(self.measurement.sets, predicted.accelerances, strict=True)
            left = [(each.accelerance - found) / self.deviation(each) for each, found in pairs]
            total += sum(_square(each) for each in left)
            total -= sum(point.explained([left[n][row] for n, row in point.rows]) for point in self.smooth_errors)
            if self.measurement.points is not None:
                total += _square((self.measurement.points.stiffness - predicted.stiffness) / self.tester_deviation)
        if not np.isfinite(total):
            return NOWHERE
        return Trial(total, partial(self._linearised, values, state))

    def _linearised(self, values: Real, state: SimulationState) -> Linearised:
        with np.errstate(all="ignore"):
            return normal_equations(self.blocks(values, state.prediction()), values)

    def blocks(self, values: Real, predicted: Prediction | None = None) -> tuple[NormalBlock, ...]:
        """The normal equations of each row and of the tester, linearised at `values` (unknowns,).

        Errors that several rows have in common are marginalised by `joint`.
        """
        predicted, errors, found = predicted or self.predict(values), self.errors_of_rows, list[NormalBlock]()
        for block, whole in self.rows(values, predicted):
            own = errors.get((block.set_number, block.row))
            if own is not None:
                block = block.under(own, *own.taken_from(whole))
            found.append(block)
        return (*found, *self.of_tester(predicted))

    def rows(self, values: Real, predicted: Prediction) -> Iterator[tuple[NormalBlock, Complex]]:
        """Each row of accelerances with noise alone, and (n + 1, lines) J and r of it."""
        tolerances, shared = self.measurement.tolerances, self.simulation.under_beam
        for number, each in enumerate(self.measurement.sets):
            weight = 1 / self.deviation(each)
            accelerance = predicted.accelerances[number]
            left = (each.accelerance - accelerance) * weight
            gain = values[self.setups[number][0]] * tolerances.sensor_gain
            by_gain = tolerances.sensor_gain / (1 + gain) * accelerance
            by_blow, by_amplitude = predicted.by_blow[number], predicted.by_amplitude[number]
            columns = [predicted.by_shared[number][shared], by_gain[None], predicted.by_setup[number]]
            columns += [BLOW_AT_POINT * by_blow, BLOW_OF_ROW * by_blow]
            columns += [POINT_SCATTER * by_amplitude, ROW_SCATTER * by_amplitude]
            whole = np.concatenate([weight * np.concatenate(columns), left[None]])  # (n + 1, rows, lines)
            for row, dof in enumerate(each.inputs):
                unknowns = [*shared, *self.setups[number]]
                unknowns += [*self.blow_at_point(dof), *self.blow_of_row(number, row)]
                unknowns += [*self.amplitudes_of_point(dof), *self.amplitudes_of_row(number, row)]
                own = whole[:, row]
                yield NormalBlock.of(Rig.BEAM, (number, row), dof, unknowns, own), own

    def of_tester(self, predicted: Prediction) -> Iterator[NormalBlock]:
        """All points of the tester, where there are any."""
        points = self.measurement.points
        if points is not None:
            weight = 1 / self.tester_deviation
            left = (points.stiffness - predicted.stiffness) * weight
            whole = np.concatenate([predicted.stiffness_by_shared * weight, left[None]])
            yield NormalBlock.of(Rig.TESTER, (-1, -1), None, range(len(whole) - 1), whole)

    def columns(self, values: Real, shared: Sequence[int]) -> tuple[Real, Real]:
        """(shared, data) whitened derivatives in some shared parameters, and (data,) the whitened residual."""
        predicted = self.predict(values, shared, own=False)
        columns = [each.reshape(len(shared), -1) for each in self._whitened(predicted.by_shared)]
        left = [each.ravel() for each in self.left_over(predicted)]
        points = self.measurement.points
        if points is not None:
            columns.append(predicted.stiffness_by_shared / self.tester_deviation)
            left.append((points.stiffness - predicted.stiffness) / self.tester_deviation)
        return as_parts(np.concatenate(columns, axis=1)), as_parts(np.concatenate(left))

    def own_columns(self, values: Real) -> Real:
        """(own unknowns, data) whitened derivatives in the unknowns of each set-up and of each row."""
        predicted, first = self.predict(values, (0,)), len(self.simulation.shared)
        tolerances = self.measurement.tolerances
        found = [np.zeros((self.unknowns - first, *each.accelerance.shape), complex) for each in self.measurement.sets]
        for number, (each, columns) in enumerate(zip(self.measurement.sets, found, strict=True)):
            own = np.array(self.setups[number]) - first
            gain = 1 + values[first + own[0]] * tolerances.sensor_gain
            columns[own[0]] = tolerances.sensor_gain / gain * predicted.accelerances[number]
            columns[own[1:]] = predicted.by_setup[number]
            for row, dof in enumerate(each.inputs):
                by_blow, at_point = predicted.by_blow[number][:, row], self.blow_at_point(dof)
                columns[np.array(at_point) - first, row] = BLOW_AT_POINT * by_blow
                columns[np.array(self.blow_of_row(number, row)) - first, row] = BLOW_OF_ROW * by_blow
                by_amplitude = predicted.by_amplitude[number][:, row]
                of_point, of_row = self.amplitudes_of_point(dof), self.amplitudes_of_row(number, row)
                for scale, errors in ((POINT_SCATTER, of_point), (ROW_SCATTER, of_row)):
                    columns[np.array(errors, dtype=np.intp) - first, row] = scale * by_amplitude
        parts = [each.reshape(len(each), -1) for each in self._whitened(found)]
        tester = self.data // 2 - sum(each.shape[1] for each in parts)
        return as_parts(np.concatenate([*parts, np.zeros((self.unknowns - first, tester), complex)], axis=1))

    def left_over(self, predicted: Prediction) -> list[Complex]:
        """For each set, (rows, lines) residual over noise and smooth errors."""
        pairs = zip(self.measurement.sets, predicted.accelerances, strict=True)
        return [each[0] for each in self._whitened([(each.accelerance - found)[None] for each, found in pairs])]

    def _whitened(self, values: Sequence[Complex]) -> list[Complex]:
        return self.whitened(
            [each / self.deviation(own) for each, own in zip(values, self.measurement.sets, strict=True)]
        )

    def whitened(self, values: Sequence[Complex]) -> list[Complex]:
        """For each set, (n, rows, lines) values over noise that are whitened for smooth errors, too."""
        found = [np.array(each) for each in values]
        for point in self.smooth_errors:
            rows = [found[number][:, row] for number, row in point.rows]
            there = np.any([np.any(each, axis=1) for each in rows], axis=0)
            for (number, row), each in zip(point.rows, point.whitened([each[there] for each in rows]), strict=True):
                found[number][there, row] = each
        return found


def _square(values: Complex) -> float:
    return float(np.vdot(values, values).real)
