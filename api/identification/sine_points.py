"""Sine points as analysis has them, and as the catalogue keeps them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from analysis.direct.dynamic_stiffness import DynamicStiffness
from store.dynamic_stiffness import DynamicStiffness as StoredPoint


@dataclass(frozen=True)
class SinePoint:
    """One steady sine point of the direct test.

    Attributes:
        specimen: the joint whose cylinders were tested.
        configuration: compression, shear or angled.
        amplitude_pp_mm: what was asked for, which names the series; `result` has what was reached.
        result: k, h and gamma with their uncertainty.
        order_number: the order of measuring, from 1.
        elapsed: s since the start of the run.
        temperature_c: degrees Celsius, or None where it was not recorded.
        sine_record_id: the stored record it comes from, None where it was imported as a number.
    """

    specimen: str
    configuration: str
    amplitude_pp_mm: float
    result: DynamicStiffness
    order_number: int
    elapsed: float
    temperature_c: float | None
    sine_record_id: int | None = None


def sine_point(stored: StoredPoint) -> SinePoint:
    """A stored sine point as analysis has it."""
    errors = (stored.stiffness_se or 0.0, stored.damping_se or 0.0)
    return SinePoint(
        specimen=stored.specimen,
        configuration=stored.configuration,
        amplitude_pp_mm=stored.amplitude_pp_mm,
        result=DynamicStiffness(
            frequency=stored.frequency,
            amplitude_pp=stored.amplitude_pp_mm * 1e-3,
            complex_stiffness=complex(stored.stiffness, stored.damping),
            covariance=np.diag(np.square(errors)),
            thd_force=None if stored.thd_percent is None else stored.thd_percent / 100,
        ),
        order_number=stored.order_number,
        elapsed=stored.elapsed,
        temperature_c=stored.temperature_c,
        sine_record_id=stored.sine_record_id,
    )


def stored_point(point: SinePoint) -> StoredPoint:
    """A sine point as the catalogue keeps it."""
    result = point.result
    return StoredPoint(
        order_number=point.order_number,
        elapsed=point.elapsed,
        specimen=point.specimen,
        configuration=point.configuration,
        amplitude_pp_mm=point.amplitude_pp_mm,
        frequency=result.frequency,
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
        thd_percent=None if result.thd_force is None else 100 * result.thd_force,
        thd_displacement_percent=None if result.thd_displacement is None else 100 * result.thd_displacement,
        temperature_c=point.temperature_c,
        flags=result.shortcomings,
        sine_record_id=point.sine_record_id,
    )
