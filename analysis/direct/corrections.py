"""Corrections of a dynamic stiffness for effects of the tester, with their uncertainty.

From the specimen k + i h to what is measured, with w = 2 pi f:

    s = k + i h - w^2 m            fixture_inertia: mass m moves with the specimen, before the force transducer
    s' = 1 / (1 / s + c)           frame_compliance: c deforms in series, within the measured displacement
    measured = s' e^(i w tau)      transducer_lag: displacement is late against force by tau

Correcting inverts them from the last to the first. The errors of the parameters are common to all points: each
corrected point has them in its covariance and, source by source, in `shared_errors` (see `point_covariance`).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from types import MappingProxyType

import numpy as np

from analysis.direct.dynamic_stiffness import AppliedCorrection, DynamicStiffness
from analysis.direct.point_covariance import complex_factor, own_covariance, shared_covariance
from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.interval import Estimate, combined_degrees_of_freedom

LARGEST_SHARE = 0.5  # of the measured motion in the frame; above, the specimen is hardly measured


class TesterEffect(StrEnum):
    """An effect of the tester that can be corrected."""

    TRANSDUCER_LAG = "transducer_lag"
    FRAME_COMPLIANCE = "frame_compliance"
    FIXTURE_INERTIA = "fixture_inertia"


PARAMETERS = MappingProxyType(
    {
        TesterEffect.TRANSDUCER_LAG: ("tau", "s"),
        TesterEffect.FRAME_COMPLIANCE: ("c", "m/N"),
        TesterEffect.FIXTURE_INERTIA: ("m", "kg"),
    }
)
"""Symbol and unit of each effect's parameter."""


@dataclass(frozen=True, eq=False)
class RigCorrections:
    """Effects to correct, with their parameters.

    Attributes:
        values: tau in s, c in m/N, m in kg, by effect; a missing effect is not corrected.
        errors: (effects, sources) change of each parameter, in the order of `values`, by one standard deviation of each
            independent source of error.
        degrees_of_freedom: behind the errors; infinite where they are known in advance.
        source: of the parameters, such as "blank of 3 May"; points corrected by one source share its error.
    """

    values: Mapping[TesterEffect, float]
    errors: Real
    degrees_of_freedom: float = math.inf
    source: str = "rig"

    def __post_init__(self) -> None:
        if self.errors.ndim != 2 or len(self.errors) != len(self.values):
            raise AnalysisError(f"{len(self.values)} corrections have errors of shape {self.errors.shape}")
        if not np.all(np.isfinite([*self.values.values(), *self.errors.ravel()])):
            raise AnalysisError("parameters of corrections and their errors have to be finite numbers")

    @classmethod
    def correlated(
        cls, values: Mapping[TesterEffect, float], covariance: Real, degrees_of_freedom: float, source: str
    ) -> RigCorrections:
        """Parameters that were found together, with their (effects, effects) covariance."""
        deviations = np.sqrt(np.diag(covariance))
        scale = np.where(deviations > 0, deviations, 1.0)  # units differ by powers of ten
        strength, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
        return cls(values, scale[:, None] * axes * np.sqrt(np.maximum(strength, 0.0)), degrees_of_freedom, source)

    def only(self, *effects: TesterEffect) -> RigCorrections:
        """The corrections with `effects` only.

        Raises:
            AnalysisError: one of them has no parameter.
        """
        missing = set(effects) - set(self.values)
        if missing:
            raise AnalysisError(f"no parameter is known for {', '.join(sorted(missing))}")
        order = [index for index, effect in enumerate(self.values) if effect in effects]
        kept = {effect: value for effect, value in self.values.items() if effect in effects}
        return replace(self, values=kept, errors=self.errors[order])

    def estimate(self, effect: TesterEffect) -> Estimate:
        """An effect's parameter with its standard error."""
        index = list(self.values).index(effect)
        return Estimate(self.values[effect], float(np.linalg.norm(self.errors[index])), self.degrees_of_freedom)

    @property
    def records(self) -> tuple[AppliedCorrection, ...]:
        """The record for a corrected point."""
        return tuple(
            AppliedCorrection(effect.value, symbol, estimate.value, estimate.standard_error, unit)
            for effect, (symbol, unit), estimate in (
                (each, PARAMETERS[each], self.estimate(each)) for each in self.values
            )
        )


def correct(points: Sequence[DynamicStiffness], corrections: RigCorrections) -> tuple[DynamicStiffness, ...]:
    """The specimen's own dynamic stiffness at each point, at the amplitude of the specimen itself.

    The difference in energy between a loop and its ellipse stays as measured.

    Raises:
        AnalysisError: the frame takes more than half of the motion at a point.
    """
    return tuple(_corrected(point, corrections) for point in points)


def _corrected(point: DynamicStiffness, corrections: RigCorrections) -> DynamicStiffness:
    values = corrections.values
    omega = 2 * math.pi * point.frequency
    on_time = cmath.exp(-1j * omega * values.get(TesterEffect.TRANSDUCER_LAG, 0.0))
    in_series = point.complex_stiffness * on_time
    share = values.get(TesterEffect.FRAME_COMPLIANCE, 0.0) * in_series  # of the frame in the motion
    if not share.real < LARGEST_SHARE:
        raise AnalysisError(
            f"at {point.frequency:g} Hz the frame's compliance takes {100 * share.real:.0f} % of the motion; "
            "check its value, or use a stiffer frame"
        )
    sprung = in_series / (1 - share)
    slope = {
        TesterEffect.TRANSDUCER_LAG: -1j * omega * in_series / (1 - share) ** 2,
        TesterEffect.FRAME_COMPLIANCE: sprung**2,
        TesterEffect.FIXTURE_INERTIA: complex(omega**2),
    }
    by_measured = on_time / (1 - share) ** 2
    moves = np.array([slope[effect] for effect in values], dtype=complex) @ corrections.errors
    shared = {name: by_measured * error for name, error in point.shared_errors.items()}
    for number, move in enumerate(moves, start=1):
        source = f"{corrections.source} {number}"
        shared[source] = shared.get(source, 0j) + complex(move)
    turn = complex_factor(by_measured)
    own = turn @ own_covariance(point) @ turn.T
    added = shared_covariance(shared)
    return replace(
        point,
        complex_stiffness=sprung + omega**2 * values.get(TesterEffect.FIXTURE_INERTIA, 0.0),
        covariance=own + added,
        degrees_of_freedom=combined_degrees_of_freedom(
            (float(np.trace(own)), float(np.trace(added))), (point.degrees_of_freedom, corrections.degrees_of_freedom)
        ),
        amplitude_pp=point.amplitude_pp * abs(1 - share),
        amplitude_pp_standard_error=(
            None if point.amplitude_pp_standard_error is None else point.amplitude_pp_standard_error * abs(1 - share)
        ),
        corrections=point.corrections + corrections.records,
        shared_errors=shared,
        amplitude_slope=by_measured * point.amplitude_slope,
    ).with_loop_energy()
