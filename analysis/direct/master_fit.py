"""Fit of a master curve to sweeps at several temperatures.

Weighted least squares in [ln |k_d|, loss angle], with the priors of the parameters. The sizes of the discrepancy
maximise the evidence of the points, with all parameters integrated out about the fit (D. J. C. MacKay, Neural
Computation 4, 1992, 415-447). Fit and sizes are found in turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve
from scipy.optimize import least_squares, minimize

from analysis.direct.discrepancy import interleaved
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.master_curve import FARTHEST, ZENER, MasterCurve, MasterModel, Sizes
from analysis.direct.point_covariance import complex_factor, error_covariance
from analysis.direct.shift_law import ShiftLaw
from analysis.direct.time_temperature import KELVIN, Shift
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real

APART = 2.0  # K, between neighbouring points of two sweeps; less is one temperature that wanders
SPACING = 1 / 3  # decades, between relaxations
MOST_DECADES = 60.0  # of reduced frequency; glass and rubber are less than 30 apart
PRIOR_SIZES = Sizes(relaxation=0.03, level=0.01, shift=0.1, exponent=0.002, point=0.002)
"""Medians of the discrepancy's sizes."""
SIZE_FACTORS = np.array([3.0, 2.0, 2.0, 2.0, 2.0])  # one standard deviation of their logarithms
ZENER_PRIORS = np.array([[0.0, 1e3], [np.log(3.0), np.log(5.0)], [0.0, np.log(1e3)], [-0.4, 0.8]])
"""Mean and standard deviation of ln K, ln r, ln t and the logit of the order; t is about the middle frequency."""
STARTS = ((-1.0, -3.0), (0.0, 0.0), (1.0, 3.0), (1.5, -7.0), (1.5, 7.0))
"""ln r and ln t from which the first fit starts, from the priors' means."""
LAG = 50e-6  # s, one standard deviation of the lag of the displacement
FIRST_MISFIT = 0.03  # of each point in the first fit
MOST_ROUNDS = 8
MOST_STEPS, STILL = 600, 1e-6  # of a search, and the relative change of cost or parameters at which it ends
SETTLED = 0.1


def temperature_groups(temperatures: Real) -> Real:
    """(groups,) mean temperature of each sweep, degrees Celsius; sweeps are `APART` from each other."""
    ordered = np.sort(temperatures)
    parts = np.split(ordered, np.flatnonzero(np.diff(ordered) > APART) + 1)
    return np.array([np.mean(part) for part in parts])


def fit_master_curve(
    points: Sequence[DynamicStiffness],
    temperatures: Sequence[float],
    shift: ShiftLaw = ShiftLaw.WLF,
    reference: float = 23.0,
    constants: tuple[float, float] | None = None,
    vertical: bool = True,
) -> MasterCurve:
    """The master curve of one specimen in one configuration, at one amplitude.

    Args:
        points: of all sweeps.
        temperatures: (points,) of the specimen, degrees Celsius.
        shift: law of the shift.
        reference: T_ref, degrees Celsius.
        constants: C1 and C2 in K of WLF at `reference` where they are known and not to be fitted.
        vertical: whether stiffness is in proportion to the temperature in kelvin, as that of rubber is.

    Raises:
        AnalysisError: too few temperatures for the law, numbers that do not belong together, a stiffness that is not
            positive, or a search without end.
    """
    law = checked_shift(points, temperatures, shift, reference, constants)
    measured = np.asarray(temperatures, dtype=np.float64)
    groups = temperature_groups(measured)
    middle = float(np.exp(np.mean(np.log([point.frequency for point in points]))))
    bare = _Fit.of(points, measured, MasterModel(law, vertical, np.empty(0), groups, middle))
    first = bare.first_fit()
    decades = np.log10(bare.frequency) + law.at(bare.model.parts(first)[1], measured)[0] / np.log(10.0)
    model = replace(bare.model, times=_times(decades))
    fit = replace(bare, model=model)
    start = np.insert(first, [bare.relaxations_at] * len(model.times), 0.0)
    return fit.curve(*fit.most_probable(start), points)


def checked_shift(
    points: Sequence[DynamicStiffness],
    temperatures: Sequence[float],
    shift: ShiftLaw,
    reference: float,
    constants: tuple[float, float] | None,
) -> Shift:
    """The law of the shift for these points, which takes no time: what can be known before a fit is checked.

    Arguments are those of `fit_master_curve`.

    Raises:
        AnalysisError: as `fit_master_curve`, but for the search.
    """
    measured = np.asarray(temperatures, dtype=np.float64)
    if measured.shape != (len(points),) or not np.all((measured > -KELVIN) & (measured < np.inf)):
        raise AnalysisError(f"{len(points)} points and {measured.size} temperatures; give one above -273.15 a point")
    _check_temperatures(temperature_groups(measured), shift, constants)
    if worst := [point for point in points if not point.stiffness > 0]:
        raise AnalysisError(f"k at {worst[0].frequency:g} Hz is {worst[0].stiffness:g} N/m; it has to be positive")
    return Shift(shift, reference, float(min(np.min(measured), reference)), constants)


def _check_temperatures(groups: Real, shift: ShiftLaw, constants: tuple[float, float] | None) -> None:
    known = ", ".join(f"{each:.1f}" for each in groups) or "none"
    if len(groups) < 2:
        raise AnalysisError(
            f"time-temperature superposition needs sweeps at two temperatures at least, more than {APART:g} K apart; "
            f"there are: {known} degrees Celsius. Measure the same specimen again 10 to 20 K colder, which brings high "
            "frequencies into the range of the tester"
        )
    if len(groups) == 2 and shift is ShiftLaw.WLF and constants is None:
        raise AnalysisError(
            f"two temperatures ({known} degrees Celsius) do not determine C1 and C2 of WLF. Take Arrhenius, give C1 "
            "and C2, or measure at a third temperature"
        )


def _times(decades: Real) -> Real:
    """Relaxation times evenly over the measured reduced frequencies, by their log10, and as far as predictions go."""
    low, high = float(np.min(decades)) - FARTHEST - 1, float(np.max(decades)) + FARTHEST + 1
    if not high - low < MOST_DECADES:
        raise AnalysisError(
            f"reduced frequencies go over {high - low:.3g} decades; check the constants of the shift, which are to "
            f"leave fewer than {MOST_DECADES:g}"
        )
    return np.asarray(10 ** -np.arange(low, high, SPACING) / (2 * np.pi))


@dataclass(frozen=True, eq=False)
class _Fit:
    """Points as arrays, and their least squares problem."""

    model: MasterModel
    frequency: Real  # (points,)
    temperature: Real  # (points,)
    measured: Real  # (2 points,) ln |k_d| and loss angle in turn
    errors: Real  # (points, 2, 2) covariance of each point's

    @classmethod
    def of(cls, points: Sequence[DynamicStiffness], temperature: Real, model: MasterModel) -> _Fit:
        frequency = np.array([point.frequency for point in points])
        turns = [complex_factor(1 / point.complex_stiffness) for point in points]
        return cls(
            model=model,
            frequency=frequency,
            temperature=temperature,
            measured=interleaved(np.log([point.complex_stiffness for point in points])),
            errors=np.array(
                [turn @ error_covariance(point) @ turn.T for turn, point in zip(turns, points, strict=True)]
            ),
        )

    @property
    def relaxations_at(self) -> int:
        """Place of the first c_j."""
        return ZENER + len(self.model.shift.priors)

    @cached_property
    def roots(self) -> tuple[Real, Real]:
        """Cholesky factors of the inverse correlations of relaxations and over temperature."""
        among = self.model.relaxation_correlation(), self.model.temperature_correlation(self.model.temperatures)
        first, second = (np.asarray(np.linalg.inv(np.linalg.cholesky(each))) for each in among)
        return first, second

    def prior(self, sizes: Sizes) -> tuple[Real, Real]:
        """(parameters,) means, and the (parameters, parameters) Cholesky factor W of their precision, W' W."""
        of_shift = np.log(np.array(self.model.shift.priors).reshape(-1, 2))
        mean = np.concatenate([ZENER_PRIORS[:, 0], of_shift[:, 0], np.zeros(self._others)])
        mean[2] -= np.log(2 * np.pi * self.model.middle)
        relaxations, over_temperature = self.roots
        alone = np.diag(1 / np.concatenate([ZENER_PRIORS[:, 1], of_shift[:, 1]]))
        parts = [over_temperature / size for size in (sizes.level, sizes.shift, sizes.exponent)]
        return mean, np.asarray(block_diag(alone, relaxations / sizes.relaxation, *parts, 1 / LAG))

    @property
    def _others(self) -> int:
        return len(self.model.times) + 3 * len(self.model.temperatures) + 1

    def _at(self, parameters: Real) -> tuple[Complex, Complex, Complex]:
        return self.model.at(parameters, self.frequency, self.temperature, measured=True)

    def whitened(self, columns: Real, deviation: float) -> Real:
        """(2 points, columns) in standard errors of the points with a `deviation` of their own."""
        factor = np.linalg.inv(np.linalg.cholesky(self.errors + deviation**2 * np.eye(2)))
        return np.asarray((factor @ columns.reshape(len(self.errors), 2, -1)).reshape(columns.shape[0], -1))

    def search(self, start: Real, sizes: Sizes) -> tuple[Real, float]:
        """The most probable parameters near `start`, and their cost."""
        mean, root = self.prior(sizes)
        back = np.asarray(np.linalg.inv(root))  # the search is over parameters in standard deviations of their priors

        def residual(away: Real) -> Real:
            found, _, _ = self._at(mean + back @ away)
            misfit = self.whitened((interleaved(found) - self.measured)[:, None], sizes.point)[:, 0]
            return np.concatenate([misfit, away])

        def slopes(away: Real) -> Real:
            _, by_parameter, _ = self._at(mean + back @ away)
            white = self.whitened(interleaved(by_parameter) @ back, sizes.point)
            return np.concatenate([white, np.eye(len(away))])

        found = least_squares(
            residual,
            root @ (start - mean),
            jac=slopes,
            method="lm",
            x_scale="jac",
            ftol=STILL,
            xtol=STILL,
            max_nfev=MOST_STEPS,
        )
        if not found.success:
            raise AnalysisError(
                f"the master curve did not come to rest in {MOST_STEPS} steps. Where a sweep was below the glass "
                "transition, WLF does not hold: take Arrhenius, or name the runs of the other sweeps alone. Where the "
                "reference temperature is far from the measured ones, take one among them"
            )
        return mean + back @ found.x, float(found.cost)

    def first_fit(self) -> Real:
        """Parameters of the law alone, from several starts."""
        sizes = PRIOR_SIZES._replace(point=FIRST_MISFIT)
        mean, _ = self.prior(sizes)
        starts = []
        for rise, time in STARTS:
            start = mean.copy()
            start[1:3] += rise, time
            found, _, _ = self._at(start)
            start[0] = float(np.mean(self.measured[::2] - found.real))
            starts.append(start)
        return min((self.search(start, sizes) for start in starts), key=lambda each: each[1])[0]

    def most_probable(self, start: Real) -> tuple[Real, Sizes]:
        """Parameters and sizes of the discrepancy, each found for the other in turn."""
        parameters, size = start, np.log(PRIOR_SIZES)
        for _ in range(MOST_ROUNDS):
            parameters, _ = self.search(parameters, Sizes(*np.exp(size)))
            before, size = size, self._sizes(parameters, size)
            if np.max(np.abs(size - before)) < SETTLED:
                break
        sizes = Sizes(*map(float, np.exp(size)))
        return self.search(parameters, sizes)[0], sizes

    def _sizes(self, parameters: Real, start: Real) -> Real:
        """(5,) logarithms of the sizes of most evidence, the curve taken to be linear about `parameters`."""
        found, slopes, _ = self._at(parameters)
        columns = np.column_stack([interleaved(slopes), self.measured - interleaved(found)])

        def improbability(size: Real) -> float:
            sizes = Sizes(*np.exp(size))
            mean, root = self.prior(sizes)
            white = self.whitened(columns, sizes.point)
            by_parameter, residual = white[:, :-1], white[:, -1]
            away = root @ (mean - parameters)
            factor = cho_factor(by_parameter.T @ by_parameter + root.T @ root, lower=True)
            descent = by_parameter.T @ residual + root.T @ away
            cost = residual @ residual + away @ away - descent @ cho_solve(factor, descent)
            spread = 2 * np.sum(np.log(np.diag(factor[0]))) - 2 * np.linalg.slogdet(root)[1]
            spread += np.linalg.slogdet(self.errors + sizes.point**2 * np.eye(2))[1].sum()
            of_sizes = np.sum(((size - np.log(PRIOR_SIZES)) / np.log(SIZE_FACTORS)) ** 2)
            return float(0.5 * (cost + spread + of_sizes))

        options = {"xatol": SETTLED / 2, "fatol": 0.05}
        return np.asarray(minimize(improbability, start, method="Nelder-Mead", options=options).x)

    def curve(self, parameters: Real, sizes: Sizes, points: Sequence[DynamicStiffness]) -> MasterCurve:
        """The fitted curve, with its covariance and the effect of errors that the points share."""
        found, slopes, _ = self._at(parameters)
        white = self.whitened(interleaved(slopes), sizes.point)
        _, root = self.prior(sizes)
        covariance = np.asarray(np.linalg.inv(white.T @ white + root.T @ root))
        stiffness = np.array([point.complex_stiffness for point in points])
        shared = {}
        for source in sorted({source for point in points for source in point.shared_errors}):
            moved = np.array([point.shared_errors.get(source, 0j) for point in points]) / stiffness
            shared[source] = covariance @ white.T @ self.whitened(interleaved(moved)[:, None], sizes.point)[:, 0]
        misfit = self.whitened((self.measured - interleaved(found))[:, None], sizes.point)
        of_shift = self.model.parts(parameters)[1]
        return MasterCurve(
            model=self.model,
            parameters=parameters,
            covariance=covariance,
            shared=shared,
            sizes=sizes,
            frequencies=(float(np.min(self.frequency)), float(np.max(self.frequency))),
            chi_square=float(np.mean(misfit**2)),
            reduced=self.frequency * np.exp(self.model.shift.at(of_shift, self.temperature)[0]),
        )
