"""Points of the tester for tests, from magnitude and loss angle, and what a tester with faults makes of them."""

import cmath
import math
from collections.abc import Mapping

import numpy as np

from analysis.direct.corrections import RigCorrections, TesterEffect
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.interval import Estimate


def from_polar(
    frequency: float,
    amplitude_pp: float,
    magnitude: float,
    loss_angle: float,
    relative_standard_deviation: float,
    thd_force: float | None = None,
) -> DynamicStiffness:
    return DynamicStiffness(
        frequency=frequency,
        amplitude_pp=amplitude_pp,
        complex_stiffness=cmath.rect(magnitude, loss_angle),
        covariance=np.eye(2) * (relative_standard_deviation * magnitude) ** 2,
        thd_force=thd_force,
    )


def point(value: complex, error: float = 0.01, frequency: float = 50.0, amplitude_pp: float = 1e-5) -> DynamicStiffness:
    """A point of dynamic stiffness `value`, N/m, with this relative standard deviation."""
    return from_polar(frequency, amplitude_pp, abs(value), math.atan2(value.imag, value.real), error)


def independent_corrections(estimates: Mapping[TesterEffect, Estimate], source: str = "rig") -> RigCorrections:
    """Corrections whose parameters were found independently."""
    deviations = np.diag([each.standard_error for each in estimates.values()])
    return RigCorrections({effect: each.value for effect, each in estimates.items()}, deviations, source=source)


def measured_stiffness(specimen: complex, frequency: float, values: Mapping[TesterEffect, float]) -> complex:
    """What the tester shows, N/m, of a specimen of `specimen` N/m; the inverse of correcting."""
    omega = 2 * math.pi * frequency
    sprung = specimen - omega**2 * values.get(TesterEffect.FIXTURE_INERTIA, 0.0)
    in_series = sprung / (1 + values.get(TesterEffect.FRAME_COMPLIANCE, 0.0) * sprung)
    return in_series * cmath.exp(1j * omega * values.get(TesterEffect.TRANSDUCER_LAG, 0.0))
