"""Frame compliance, transducer lag and fixture inertia from runs on known pieces.

A blank far stiffer than the frame shows the compliance of the frame. A known mass, or the empty tester, shows the
inertia of the fixture. Each shows the lag. All runs are fitted together by weighted least squares with the model of
`corrections`, and chi-square tests whether they agree.
"""

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.special import chdtrc

from analysis.direct.corrections import PARAMETERS, RigCorrections, TesterEffect
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.point_covariance import whitening
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real

RANK = 1e-6  # tolerance of the rank of the scaled columns: below, a parameter is not determined
INCONSISTENT = 0.01  # p-value of chi-square below which the runs disagree
FEWEST_FREQUENCIES = 3


@dataclass(frozen=True)
class KnownSpecimen:
    """The piece in the tester: a blank, a mass or, with zeros, none.

    Attributes:
        stiffness: of a blank, N/m; `math.inf` where it is rigid beside the frame.
        mass: that moves in addition to the fixture, kg.
        stiffness_standard_error: of the blank's stiffness, N/m.
    """

    stiffness: complex = 0.0
    mass: float = 0.0
    stiffness_standard_error: float = 0.0

    @property
    def is_rigid(self) -> bool:
        """Whether its stiffness is infinite."""
        return math.isinf(self.stiffness.real)


@dataclass(frozen=True)
class CalibrationRun:
    """Points measured on a known piece."""

    specimen: KnownSpecimen
    points: tuple[DynamicStiffness, ...]


@dataclass(frozen=True, eq=False)
class RigCalibration:
    """Parameters of the tester, and whether the runs agree.

    Attributes:
        corrections: ready to apply, without the parameters that the runs do not determine.
        chi_square: weighted sum of squares of the residual.
        degrees_of_freedom: of chi-square.
        warnings: faults of this calibration, one sentence each.
    """

    corrections: RigCorrections
    chi_square: float
    degrees_of_freedom: int
    warnings: tuple[str, ...]


def calibrate_rig(
    runs: Sequence[CalibrationRun], effects: Sequence[TesterEffect] = tuple(TesterEffect)
) -> RigCalibration:
    """Identify the parameters of `effects` from `runs`, those that the runs determine.

    Where chi-square contradicts the model, the errors are widened by the root of chi-square per degree of freedom, with
    a warning.

    Args:
        runs: on blanks, masses or nothing, each at several frequencies.
        effects: of the rig; others are taken to be zero.

    Raises:
        AnalysisError: there is no point, or no effect that the runs determine; or a rigid blank without a frame
            compliance to find.
    """
    if not any(run.points for run in runs):
        raise AnalysisError("no point of a calibration run; measure a blank, a known mass or the empty tester")
    if any(run.specimen.is_rigid for run in runs) and TesterEffect.FRAME_COMPLIANCE not in effects:
        raise AnalysisError("a rigid blank shows nothing but the frame's compliance, which was left out")
    model = _Model(tuple((run.specimen, point) for run in runs for point in run.points))
    wanted = [effect for effect in TesterEffect if effect in effects]
    start = {effect: model.start(effect) for effect in wanted}
    determined = _determined(model, wanted, start)
    warnings = [
        f"{effect}: these runs do not determine {PARAMETERS[effect][0]}; it is taken to be zero"
        for effect in wanted
        if effect not in determined
    ]
    if not determined:
        raise AnalysisError("; ".join(warnings) or "there is no effect to look for; name one at least")
    values, slopes, residual = _fit(model, determined, start)
    chi_square, freedom = float(residual @ residual), residual.size - len(determined)
    contradiction = freedom > 0 and float(chdtrc(freedom, chi_square)) < INCONSISTENT
    if contradiction:
        warnings.append(
            f"chi-square is {chi_square:.4g} on {freedom} degrees of freedom: the runs contradict each other or the "
            f"model; errors are widened by {math.sqrt(chi_square / freedom):.2g}"
        )
    scale = np.linalg.norm(slopes, axis=0)
    solution = np.linalg.pinv(slopes / scale) / scale[:, None]
    blanks = solution @ model.blank_errors(values)
    widening = chi_square / freedom if contradiction else 1.0
    covariance = widening * solution @ solution.T + blanks @ blanks.T
    corrections = RigCorrections.correlated(values, covariance, math.inf, source="rig calibration")
    warnings += _warnings(corrections, len({round(point.frequency, 3) for _, point in model.points}), residual.size)
    return RigCalibration(corrections, chi_square, freedom, tuple(warnings))


def _warnings(corrections: RigCorrections, frequencies: int, numbers: int) -> list[str]:
    """Warnings of parameters with a large error, and of too few data."""
    count = len(corrections.values)
    found = []
    if frequencies < FEWEST_FREQUENCIES or numbers < count + FEWEST_FREQUENCIES:
        found.append(
            f"{frequencies} frequencies and {numbers} numbers for {count} parameters are too few to see whether the "
            "model holds"
        )
    for effect, value in corrections.values.items():
        error = corrections.estimate(effect).standard_error
        if abs(value) < 2 * error:
            symbol, unit = PARAMETERS[effect]
            found.append(f"{effect}: {symbol} = {value:.3g} +- {error:.2g} {unit} cannot be distinguished from zero")
    return found


class _Model:
    """Prediction of the runs, and its derivatives."""

    def __init__(self, points: tuple[tuple[KnownSpecimen, DynamicStiffness], ...]) -> None:
        self.points = points
        self.whitening: Real = np.array([whitening(point) for _, point in points])

    def start(self, effect: TesterEffect) -> float:
        """A first guess of a parameter, from the runs that show it most."""
        if effect is TesterEffect.FRAME_COMPLIANCE:
            found = [
                (1 / point.complex_stiffness).real - (0.0 if known.is_rigid else (1 / known.stiffness).real)
                for known, point in self.points
                if known.stiffness
            ]
        elif effect is TesterEffect.FIXTURE_INERTIA:
            found = [
                (known.stiffness - point.complex_stiffness).real / (2 * math.pi * point.frequency) ** 2 - known.mass
                for known, point in self.points
                if not known.stiffness
            ]
        else:
            found = []
        return float(np.median(found)) if found else 0.0

    def residual(self, values: Mapping[TesterEffect, float]) -> Real:
        """(2 points,) model less measurement, whitened."""
        return self._whitened(
            np.array(
                [_predict(known, point.frequency, values)[0] - point.complex_stiffness for known, point in self.points]
            )
        )

    def slopes(self, values: Mapping[TesterEffect, float], effects: Sequence[TesterEffect]) -> Real:
        """(2 points, effects) derivatives of `residual` at `values` by the parameters of `effects`."""
        by_point = [_predict(known, point.frequency, values)[1] for known, point in self.points]
        columns = [self._whitened(np.array([slope[effect] for slope in by_point])) for effect in effects]
        return np.stack(columns, axis=-1)

    def blank_errors(self, values: Mapping[TesterEffect, float]) -> Real:
        """(2 points, blanks) change of `residual` by one standard deviation of each blank's stiffness."""
        blanks = sorted({known for known, _ in self.points if known.stiffness_standard_error}, key=repr)
        moves = np.zeros((len(blanks), len(self.points)), dtype=complex)
        for place, (known, point) in enumerate(self.points):
            if known in blanks:
                slope = _predict(known, point.frequency, values)[1][TesterEffect.FIXTURE_INERTIA]
                by_stiffness = -slope / (2 * math.pi * point.frequency) ** 2
                moves[blanks.index(known), place] = by_stiffness * known.stiffness_standard_error
        return np.reshape([self._whitened(move) for move in moves], (len(blanks), 2 * len(self.points))).T

    def _whitened(self, stiffness: Complex) -> Real:
        parts = np.stack([stiffness.real, stiffness.imag], axis=-1)
        return np.asarray((self.whitening @ parts[..., None]).ravel())


def _predict(
    known: KnownSpecimen, frequency: float, values: Mapping[TesterEffect, float]
) -> tuple[complex, dict[TesterEffect, complex]]:
    """Measured stiffness of a known piece by the model of `corrections`, and its derivatives by the parameters."""
    omega = 2 * math.pi * frequency
    compliance = values.get(TesterEffect.FRAME_COMPLIANCE, 0.0)
    turn = cmath.exp(1j * omega * values.get(TesterEffect.TRANSDUCER_LAG, 0.0))
    if known.is_rigid:
        in_series, by_sprung = complex(1 / compliance), 0j
    else:
        sprung = known.stiffness - omega**2 * (known.mass + values.get(TesterEffect.FIXTURE_INERTIA, 0.0))
        in_series, by_sprung = sprung / (1 + compliance * sprung), 1 / (1 + compliance * sprung) ** 2
    return in_series * turn, {
        TesterEffect.TRANSDUCER_LAG: 1j * omega * in_series * turn,
        TesterEffect.FRAME_COMPLIANCE: -(in_series**2) * turn,
        TesterEffect.FIXTURE_INERTIA: -(omega**2) * by_sprung * turn,
    }


def _determined(
    model: _Model, effects: Sequence[TesterEffect], start: Mapping[TesterEffect, float]
) -> list[TesterEffect]:
    """The effects whose columns are neither zero nor sums of those before them."""
    kept: list[TesterEffect] = []
    for effect in effects:
        columns = model.slopes(start, [*kept, effect])
        size = np.linalg.norm(columns, axis=0)
        if size[-1] > 0 and np.linalg.matrix_rank(columns / size, tol=RANK) == size.size:
            kept.append(effect)
    return kept


def _fit(
    model: _Model, effects: Sequence[TesterEffect], start: Mapping[TesterEffect, float]
) -> tuple[dict[TesterEffect, float], Real, Real]:
    """Parameters, their scaled columns and the residual at the optimum."""

    def named(parameters: Real) -> dict[TesterEffect, float]:
        return {effect: float(value) for effect, value in zip(effects, parameters * scale, strict=True)}

    scale: Real = 1 / np.linalg.norm(model.slopes(start, effects), axis=0)
    found = least_squares(
        lambda parameters: model.residual(named(parameters)),
        np.array([start[effect] for effect in effects]) / scale,
        jac=lambda parameters: model.slopes(named(parameters), effects) * scale,
        method="lm",
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-14,
    )
    values = named(found.x)
    return values, model.slopes(values, effects), model.residual(values)
