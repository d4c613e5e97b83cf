"""Dynamic stiffness at a reference temperature, from one measured at a temperature a few kelvin away.

Over a few kelvin both change in proportion, T being the specimen's temperature and T_0 the reference:

    k(T) = k(T_0) (1 + alpha (T - T_0)),      gamma(T) = gamma(T_0) (1 + beta (T - T_0)).

This is the linear part of the shift of M. L. Williams, R. F. Landel and J. D. Ferry (J. Am. Chem. Soc. 77, 1955,
3701-3707) for a rubber far above its glass transition. Coefficients belong to a compound: measure them, or state them
with a suitably large error.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.direct.dynamic_stiffness import AppliedCorrection, DynamicStiffness
from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.interval import Estimate

EFFECT = "temperature_shift"


@dataclass(frozen=True)
class TemperatureCoefficients:
    """How a compound depends on temperature.

    Attributes:
        stiffness: alpha, relative change of k per kelvin, 1/K; negative where it softens.
        loss_factor: beta, relative change of gamma per kelvin, 1/K.
        largest_difference: from the reference temperature, for which the two are valid, K.
        source: of the two; points scaled by one source share its error.
    """

    stiffness: Estimate
    loss_factor: Estimate
    largest_difference: float = 10.0
    source: str = "temperature coefficients"


def at_reference_temperature(
    points: Sequence[DynamicStiffness],
    temperatures: Sequence[float],
    reference: float,
    coefficients: TemperatureCoefficients,
    thermometer_error: float = 0.0,
) -> tuple[DynamicStiffness, ...]:
    """Points scaled to `reference`, with the error of the coefficients in their covariance.

    Args:
        points: as measured.
        temperatures: (points,) of the specimen, degrees Celsius.
        reference: degrees Celsius.
        coefficients: of the compound.
        thermometer_error: standard error of the thermometer, the same at all points, K.

    Raises:
        AnalysisError: the numbers of points and temperatures differ, a temperature is outside the validity of the
            coefficients, these leave no positive stiffness or loss factor there, or a standard error is none.
    """
    if len(points) != len(temperatures):
        raise AnalysisError(f"{len(points)} points and {len(temperatures)} temperatures; give one a point")
    for point, temperature in zip(points, temperatures, strict=True):
        if not abs(temperature - reference) <= coefficients.largest_difference:
            raise AnalysisError(
                f"{point.frequency:g} Hz was measured at {temperature:g} degrees Celsius, further than "
                f"{coefficients.largest_difference:g} K from {reference:g}: the coefficients do not reach so far"
            )
        _check_coefficients(coefficients, temperature, reference)
    errors = {
        "the thermometer": thermometer_error,
        "alpha": coefficients.stiffness.standard_error,
        "beta": coefficients.loss_factor.standard_error,
    }
    for name, error in errors.items():
        if not (math.isfinite(error) and error >= 0):
            raise AnalysisError(f"the standard error of {name} is {error}; it must be zero or a positive number")
    return tuple(
        _scaled(point, temperature - reference, coefficients, thermometer_error)
        for point, temperature in zip(points, temperatures, strict=True)
    )


def _check_coefficients(coefficients: TemperatureCoefficients, temperature: float, reference: float) -> None:
    """Refuse a coefficient by which a stiffness or a loss factor is zero or negative at `temperature`."""
    for name, what, found in (
        ("alpha", "stiffness", coefficients.stiffness),
        ("beta", "loss factor", coefficients.loss_factor),
    ):
        factor = 1 + found.value * (temperature - reference)
        if not (math.isfinite(found.value) and factor > 0):
            raise AnalysisError(
                f"{name} of {found.value:g} 1/K makes the {what} at {temperature:g} degrees Celsius {factor:.3g} times "
                f"that at {reference:g}; no elastomer does that. It is a relative change per kelvin: -0.3 % is -0.003"
            )


def _scaled(
    point: DynamicStiffness, warmer: float, coefficients: TemperatureCoefficients, thermometer_error: float
) -> DynamicStiffness:
    alpha, beta = coefficients.stiffness, coefficients.loss_factor
    of_stiffness, of_loss = 1 / (1 + alpha.value * warmer), 1 / (1 + beta.value * warmer)
    to_reference = np.array([of_stiffness, of_stiffness * of_loss])
    k, h = to_reference * [point.stiffness, point.damping]
    # d of_stiffness / d alpha = -warmer of_stiffness^2
    by_alpha = -warmer * of_stiffness * np.array([k, h])
    by_beta = -warmer * of_loss * np.array([0.0, h])
    by_warmth = -np.array([alpha.value * of_stiffness * k, (alpha.value * of_stiffness + beta.value * of_loss) * h])
    added = {
        f"{coefficients.source} alpha": by_alpha * alpha.standard_error,
        f"{coefficients.source} beta": by_beta * beta.standard_error,
        "thermometer": by_warmth * thermometer_error,
    }
    shared = {
        source: complex(to_reference[0] * error.real, to_reference[1] * error.imag)
        for source, error in point.shared_errors.items()
    }
    covariance: Real = point.covariance * np.outer(to_reference, to_reference)
    for source, move in added.items():
        covariance = covariance + np.outer(move, move)
        shared[source] = shared.get(source, 0j) + complex(*move)
    records = (
        AppliedCorrection(EFFECT, "delta_t", -warmer, thermometer_error, "K"),
        AppliedCorrection(EFFECT, "alpha", alpha.value, alpha.standard_error, "1/K"),
        AppliedCorrection(EFFECT, "beta", beta.value, beta.standard_error, "1/K"),
    )
    slope = point.amplitude_slope
    return replace(
        point,
        complex_stiffness=complex(k, h),
        covariance=covariance,
        amplitude_slope=complex(to_reference[0] * slope.real, to_reference[1] * slope.imag),
        corrections=point.corrections + records,
        shared_errors=shared,
    ).with_loop_energy()
