"""Sine points as analysis has them, and as the catalogue keeps them."""

import math
from dataclasses import dataclass

import numpy as np

from analysis.direct.dynamic_stiffness import HUM, SATURATED, DynamicStiffness
from analysis.interval import Estimate
from store.results.dynamic_stiffness import StoredStiffness


@dataclass(frozen=True)
class IdentifiedSinePoint:
    """One steady sine point of the direct test.

    Attributes:
        specimen: the joint whose cylinders were tested.
        configuration: compression, shear or angled.
        amplitude_pp_mm: the amplitude asked for, which names the series; `result` has the one that was reached.
        frequency: Hz, the one asked for; `result` has that of the record.
        result: k, h and gamma with their uncertainty.
        order_number: the order of measuring, from 1.
        elapsed: s since the start of the run.
        temperature_c: degrees Celsius, or None where it was not recorded.
        sine_record_id: the stored record it comes from, None where it was imported as a number.
    """

    specimen: str
    configuration: str
    amplitude_pp_mm: float
    frequency: float
    result: DynamicStiffness
    order_number: int
    elapsed: float
    temperature_c: float | None
    sine_record_id: int | None = None


def sine_point(stored: StoredStiffness) -> IdentifiedSinePoint:
    """A stored sine point as analysis has it; its corrections are in the settings of its analysis."""
    errors = (stored.stiffness_se or 0.0, stored.damping_se or 0.0)
    covariance = np.diag(np.square(errors))
    covariance[0, 1] = covariance[1, 0] = stored.stiffness_damping_covariance or 0.0
    freedom = math.inf if stored.degrees_of_freedom is None else stored.degrees_of_freedom
    excess = None
    if stored.loop_energy_excess is not None and stored.loop_energy_excess_se is not None:
        excess = Estimate(stored.loop_energy_excess, stored.loop_energy_excess_se, freedom)
    reached_pp_mm = stored.amplitude_pp_mm if stored.reached_pp_mm is None else stored.reached_pp_mm
    return IdentifiedSinePoint(
        specimen=stored.specimen,
        configuration=stored.configuration,
        amplitude_pp_mm=stored.amplitude_pp_mm,
        frequency=stored.frequency,
        result=DynamicStiffness(
            frequency=stored.frequency if stored.reached_frequency is None else stored.reached_frequency,
            amplitude_pp=1e-3 * reached_pp_mm,
            complex_stiffness=complex(stored.stiffness, stored.damping),
            covariance=covariance,
            degrees_of_freedom=freedom,
            amplitude_pp_standard_error=_times(1e-3, stored.reached_pp_se_mm),
            thd_displacement=_times(1e-2, stored.thd_displacement_percent),
            thd_displacement_standard_error=_times(1e-2, stored.thd_displacement_se_percent),
            thd_force=_times(1e-2, stored.thd_percent),
            thd_force_standard_error=_times(1e-2, stored.thd_se_percent),
            loop_energy=stored.loop_energy,
            loop_energy_excess=excess,
            shared_errors={source: complex(*move) for source, move in stored.shared_errors.items()},
            remarks=tuple(flag for flag in stored.flags if flag.startswith((HUM, SATURATED))),
        ),
        order_number=stored.order_number,
        elapsed=stored.elapsed,
        temperature_c=stored.temperature_c,
        sine_record_id=stored.sine_record_id,
    )


def stored_point(point: IdentifiedSinePoint) -> StoredStiffness:
    """A sine point as the catalogue keeps it."""
    result = point.result
    energy, excess = result.loop_energy_estimate, result.loop_energy_excess
    return StoredStiffness(
        order_number=point.order_number,
        elapsed=point.elapsed,
        specimen=point.specimen,
        configuration=point.configuration,
        amplitude_pp_mm=point.amplitude_pp_mm,
        frequency=point.frequency,
        reached_frequency=result.frequency,
        stiffness=result.stiffness,
        damping=result.damping,
        loss_factor=result.loss_factor,
        magnitude=result.magnitude,
        loss_angle_deg=math.degrees(result.loss_angle),
        stiffness_se=result.stiffness_estimate.standard_error,
        damping_se=result.damping_estimate.standard_error,
        loss_factor_se=result.loss_factor_estimate.standard_error,
        magnitude_se=result.magnitude_estimate.standard_error,
        loss_angle_se_deg=math.degrees(result.loss_angle_estimate.standard_error),
        degrees_of_freedom=None if math.isinf(result.degrees_of_freedom) else result.degrees_of_freedom,
        stiffness_damping_covariance=float(result.covariance[0, 1]),
        sd_rel=math.sqrt(np.trace(result.covariance_about_amplitude) / 2) / result.magnitude,
        reached_pp_mm=1e3 * result.amplitude_pp,
        reached_pp_se_mm=_times(1e3, result.amplitude_pp_standard_error),
        thd_percent=_times(100, result.thd_force),
        thd_se_percent=_times(100, result.thd_force_standard_error),
        thd_displacement_percent=_times(100, result.thd_displacement),
        thd_displacement_se_percent=_times(100, result.thd_displacement_standard_error),
        loop_energy=result.loop_energy,
        loop_energy_se=None if energy is None else energy.standard_error,
        loop_energy_excess=None if excess is None else excess.value,
        loop_energy_excess_se=None if excess is None else excess.standard_error,
        temperature_c=point.temperature_c,
        flags=result.shortcomings,
        shared_errors={source: (move.real, move.imag) for source, move in result.shared_errors.items()},
        sine_record_id=point.sine_record_id,
    )


def _times(factor: float, value: float | None) -> float | None:
    return None if value is None else factor * value
