"""A master curve: complex stiffness of an elastomer at any frequency and temperature, with intervals.

    ln k_d(f, T) = ln K + ln z(x) + sum_j c_j i x t_j / (1 + i x t_j) + ln(T / T_ref) + l(T)
                     + e(T) ln(i f / f_m),
    ln x = ln(2 pi f a_T) + s(T).

z is the fractional Zener law (`constitutive`), a_T the shift (`time_temperature`), and T / T_ref in kelvin the vertical
shift of rubber elasticity, which can be left out. The rest is the discrepancy, Gaussian about zero:

- c_j, of relaxations at times t_j evenly spaced in their logarithm, smooth over it. Each is analytic in i x and real
  for real i x, so stiffness and loss stay tied by causality (Kramers and Kronig) whatever the c_j are. Outside of the
  reduced frequencies that were measured they are unknown, so that the interval of ln |k_d| grows with every decade.
- l, s and e, smooth over temperature: what the vertical and horizontal shifts miss, errors of the thermometer included,
  and a power of frequency about the middle f_m of the measured ones: the form of the curve is not quite the same at all
  temperatures. A power is causal, too.
- a lag of the displacement that the corrections have left: a phase in proportion to the measured frequency, at all
  temperatures, where the elastomer's follows the reduced one. It is in the points, and not in what the curve predicts.
- a deviation of each point for itself, as no elastomer is thermorheologically simple to the error of its points.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import expit

from analysis.direct.constitutive import fractional_zener
from analysis.direct.discrepancy import interleaved
from analysis.direct.time_temperature import KELVIN, Shift
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.interval import Z95

ZENER = 4
"""Parameters ln K, ln r, ln t and the logit of the order of z = 1 + r (i x t)^a / (1 + (i x t)^a)."""
TEMPERATURE_REACH = 20.0  # K, length of correlation of l, s and e
TIME_REACH = 1.5  # decades, length of correlation of c_j
LARGEST = 200.0  # logarithm of a reduced frequency, so that no step of a search overflows
FARTHEST = 3.0  # decades outside of the measured reduced frequencies
LARGEST_LOGARITHM = 700.0  # of a number of a computer


class Range(NamedTuple):
    """A value with the ends of its 95 % interval."""

    value: float
    low: float
    high: float


class Sizes(NamedTuple):
    """Standard deviations of the discrepancy: of c_j, l, s, e, and of each point's ln |k_d| and loss angle."""

    relaxation: float
    level: float
    shift: float
    exponent: float
    point: float


@dataclass(frozen=True, eq=False)
class MasterModel:
    """The form of a master curve, without its parameters.

    The (parameters,) are those of the Zener law, of the shift, c_j, l, s and e at `temperatures`, and the lag in s,
    in this order.

    Attributes:
        shift: law of the horizontal shift.
        vertical: whether stiffness is in proportion to T in kelvin.
        times: (relaxations,) t_j, s.
        temperatures: (groups,) degrees Celsius, of the measured sweeps.
        middle: f_m, Hz.
    """

    shift: Shift
    vertical: bool
    times: Real
    temperatures: Real
    middle: float

    def parts(self, parameters: Real) -> list[Real]:
        """Parameters of Zener, shift, relaxations, l, s, e, and the lag."""
        groups = len(self.temperatures)
        counts = [ZENER, len(self.shift.priors), len(self.times), groups, groups, groups]
        return np.split(parameters, np.cumsum(counts))

    def relaxation_correlation(self) -> Real:
        """(relaxations, relaxations) correlation of c_j."""
        decades = np.log10(self.times)
        return np.asarray(np.exp(-np.abs(decades[:, None] - decades) / TIME_REACH))

    def temperature_correlation(self, other: Real) -> Real:
        """(groups, others) correlation of l, s or e between the sweeps and other temperatures."""
        return np.asarray(np.exp(-np.abs(self.temperatures[:, None] - other) / TEMPERATURE_REACH))

    def at(
        self, parameters: Real, frequency: Real, temperature: Real, *, measured: bool = False
    ) -> tuple[Complex, Complex, Complex]:
        """The curve and its derivatives.

        Args:
            parameters: (parameters,).
            frequency: (points,) Hz.
            temperature: (points,) degrees Celsius.
            measured: as the tester measures it, with its lag.

        Returns:
            (points,) ln k_d with k_d in N/m, (points, parameters) its derivatives, and (points,) that by ln x.
        """
        zener, of_shift, amounts, level, further, exponent, lag = self.parts(parameters)
        among = self.temperature_correlation(self.temperatures)
        weights = np.linalg.solve(among, self.temperature_correlation(temperature)).T
        shift, by_shift = self.shift.at(of_shift, temperature)
        reduced = np.log(frequency) + shift + weights @ further
        rise, order = np.exp(min(zener[1], LARGEST)), expit(zener[3])
        # the time within the frequency: their product alone counts
        z, by_values = fractional_zener(np.array([rise, 1.0, 1.0, order]), _bounded(reduced + zener[2]))
        relative = by_values[:, [0, 2, 3]] / z[:, None] * [rise, 1.0, order * (1 - order)]
        x = 2j * np.pi * _bounded(reduced)[:, None] * self.times
        relaxations = x / (1 + x)
        by_frequency = relative[:, 1] + (x / (1 + x) ** 2) @ amounts
        found = zener[0] + np.log(z) + relaxations @ amounts + weights @ level
        power = (np.log(frequency / self.middle) + 0.5j * np.pi)[:, None] * weights
        late = 2j * np.pi * frequency[:, None] * measured
        found = found + power @ exponent + late @ lag
        if self.vertical:
            found = found + np.log((temperature + KELVIN) / (self.shift.reference + KELVIN))
        one = np.ones((len(frequency), 1))
        along = by_frequency[:, None]
        slopes = np.concatenate(
            [one, relative, along * by_shift, relaxations, weights, along * weights, power, late], axis=1
        )
        return found, slopes, by_frequency


def _bounded(logarithms: Real) -> Real:
    """Frequencies of these (points,) logarithms."""
    return np.asarray(np.exp(np.clip(logarithms, -LARGEST, LARGEST)))


@dataclass(frozen=True)
class MasterPoint:
    """What a master curve says at one frequency and temperature.

    Attributes:
        frequency: Hz.
        temperature: degrees Celsius.
        reduced_frequency: f a_T, Hz, at the reference temperature.
        logarithm: ln k_d, k_d in N/m: ln |k_d| and the loss angle in rad.
        covariance: (2, 2) of these two.
        beyond: how the question is outside of what was measured, one phrase each; empty inside.
    """

    frequency: float
    temperature: float
    reduced_frequency: float
    logarithm: complex
    covariance: Real
    beyond: tuple[str, ...]

    @property
    def complex_stiffness(self) -> complex:
        """k + i h, N/m."""
        return complex(np.exp(self.logarithm))

    @property
    def stiffness(self) -> Range:
        """k, N/m; its logarithm is taken to be normal."""
        tangent = math.tan(self.logarithm.imag)
        return self._of_logarithm(self.complex_stiffness.real, np.array([1.0, -tangent]))

    @property
    def magnitude(self) -> Range:
        """|k_d|, N/m."""
        return self._of_logarithm(abs(self.complex_stiffness), np.array([1.0, 0.0]))

    @property
    def loss_factor(self) -> Range:
        """Gamma; the loss angle is taken to be normal, within a quarter turn."""
        angle, half = self.logarithm.imag, Z95 * math.sqrt(self.covariance[1, 1])
        quarter = 0.49 * math.pi
        return Range(math.tan(angle), math.tan(max(angle - half, -quarter)), math.tan(min(angle + half, quarter)))

    def _of_logarithm(self, value: float, gradient: Real) -> Range:
        factor = math.exp(Z95 * math.sqrt(float(gradient @ self.covariance @ gradient)))
        return Range(value, value / factor, value * factor)


@dataclass(frozen=True, eq=False)
class MasterCurve:
    """A fitted master curve.

    Attributes:
        model: its form.
        parameters: (parameters,).
        covariance: (parameters, parameters), without errors that the points share.
        shared: (parameters,) change by one standard deviation of each source of errors that the points share.
        sizes: of the discrepancy.
        frequencies: lowest and highest measured one, Hz.
        chi_square: weighted sum of squares of the points about the curve, their own deviation included, per number.
        reduced: (points,) f a_T of the measured points, Hz.
    """

    model: MasterModel
    parameters: Real
    covariance: Real
    shared: Mapping[str, Real]
    sizes: Sizes
    frequencies: tuple[float, float]
    chi_square: float
    reduced: Real

    @property
    def covered(self) -> tuple[float, float]:
        """Lowest and highest reduced frequency that was measured, Hz."""
        return float(np.min(self.reduced)), float(np.max(self.reduced))

    @property
    def shift_values(self) -> dict[str, Range]:
        """C1 and C2 in K, or E in kJ/mol; empty where they were given."""
        shift, at = self.model.shift, slice(ZENER, ZENER + len(self.model.shift.priors))
        logarithms, errors = self.parameters[at], np.sqrt(np.diag(self.covariance)[at])
        ends = [shift.values(logarithms + Z95 * sign * errors) for sign in (0, -1, 1)]
        return {name: Range(*map(float, each)) for name, *each in zip(shift.names, *ends, strict=False)}

    @property
    def shift_errors(self) -> dict[str, float]:
        """Standard error of each of `shift_values`, in its unit."""
        shift, at = self.model.shift, slice(ZENER, ZENER + len(self.model.shift.priors))
        # a value is the exponential of its parameter and a constant, so that its slope is the exponential
        errors = np.exp(self.parameters[at]) * np.sqrt(np.diag(self.covariance)[at])
        return {name: float(error) for name, error in zip(shift.names, errors, strict=True)}

    @property
    def lag(self) -> Range:
        """Of the displacement against the force in the points, s; it is not in what the curve predicts."""
        value, half = float(self.parameters[-1]), Z95 * float(np.sqrt(self.covariance[-1, -1]))
        return Range(value, value - half, value + half)

    @property
    def lag_error(self) -> float:
        """Standard error of `lag`, s."""
        return float(np.sqrt(self.covariance[-1, -1]))

    def shift_factor(self, temperature: float) -> float:
        """a_T at `temperature` degrees Celsius, by the law of the shift."""
        return self.shift_by_law(temperature).value

    def shift_by_law(self, temperature: float) -> Range:
        """a_T at `temperature` degrees Celsius, by the law of the shift; without an error where that is given.

        Raises:
            AnalysisError: WLF does not reach as low.
        """
        shift, slopes = self.model.shift.at(self.model.parts(self.parameters)[1], np.array([temperature]))
        gradient = np.zeros(len(self.parameters))
        gradient[ZENER : ZENER + len(self.model.shift.priors)] = slopes[0]
        return self._factor(float(shift[0]), gradient)

    @property
    def sweep_shifts(self) -> list[Range]:
        """a_T e^s of each of the model's temperatures: by the law, and what the sweep there has beyond it."""
        _, of_shift, amounts, level, further, _, _ = self.model.parts(self.parameters)
        shift, slopes = self.model.shift.at(of_shift, self.model.temperatures)
        first = ZENER + len(of_shift) + len(amounts) + len(level)
        found = []
        for place, beyond in enumerate(further):
            gradient = np.zeros(len(self.parameters))
            gradient[ZENER : ZENER + len(of_shift)] = slopes[place]
            gradient[first + place] = 1.0
            found.append(self._factor(float(shift[place] + beyond), gradient))
        return found

    def _factor(self, logarithm: float, gradient: Real) -> Range:
        """The exponential of a logarithm with this (parameters,) gradient.

        Raises:
            AnalysisError: it, or a limit of its interval, is no number of a computer.
        """
        half = Z95 * math.sqrt(max(float(gradient @ self.covariance @ gradient), 0.0))
        if abs(logarithm) + half > LARGEST_LOGARITHM:
            raise AnalysisError(
                f"the shift of a temperature is e^{logarithm:.3g} within e^+-{half:.3g}, which says nothing; check the "
                "constants, or ask for a temperature nearer to the measured ones"
            )
        return Range(*(math.exp(logarithm + each) for each in (0.0, -half, half)))

    def at(self, frequency: float, temperature: float) -> MasterPoint:
        """Complex stiffness at `frequency` Hz and `temperature` degrees Celsius.

        Raises:
            AnalysisError: frequency or temperature cannot be, or the reduced frequency is too far from the measured.
        """
        if not (math.isfinite(frequency) and frequency > 0 and math.isfinite(temperature) and temperature > -KELVIN):
            raise AnalysisError(f"a master curve is asked at {frequency} Hz and {temperature} degrees Celsius")
        reduced = frequency * self.shift_factor(temperature)
        low, high = self.covered
        if not low / 10**FARTHEST <= reduced <= high * 10**FARTHEST:
            raise AnalysisError(
                f"{frequency:g} Hz at {temperature:g} degrees Celsius is the reduced frequency {reduced:.3g} Hz, more "
                f"than {FARTHEST:g} decades outside of the measured {low:.3g} to {high:.3g} Hz"
            )
        asked = np.array([temperature])
        found, slopes, by_frequency = self.model.at(self.parameters, np.array([frequency]), asked)
        gradient, along = interleaved(slopes), interleaved(by_frequency)
        near = self.model.temperature_correlation(asked)[:, 0]
        known = near @ np.linalg.solve(self.model.temperature_correlation(self.model.temperatures), near)
        apart = max(1 - float(known), 0.0)
        covariance = gradient @ self.covariance @ gradient.T + self.sizes.point**2 * np.eye(2)
        # what a temperature apart from the measured ones has for itself: l, s and e
        power = np.array([math.log(frequency / self.model.middle), math.pi / 2])
        own = (np.array([1.0, 0.0]), self.sizes.level), (along, self.sizes.shift), (power, self.sizes.exponent)
        covariance += apart * sum(size**2 * np.outer(move, move) for move, size in own)
        for move in self.shared.values():
            covariance += np.outer(gradient @ move, gradient @ move)
        return MasterPoint(
            frequency, temperature, reduced, complex(found[0]), covariance, self._beyond(reduced, temperature)
        )

    def _beyond(self, reduced: float, temperature: float) -> tuple[str, ...]:
        found = []
        for value, (low, high), unit, room in (
            (reduced, self.covered, "Hz of reduced frequency", 0.01 * reduced),
            (temperature, (min(self.model.temperatures), max(self.model.temperatures)), "degrees Celsius", 1.0),
        ):
            if value < low - room:
                found.append(f"{value:.3g} {unit} is below the measured {low:.3g}")
            if value > high + room:
                found.append(f"{value:.3g} {unit} is above the measured {high:.3g}")
        return tuple(found)
