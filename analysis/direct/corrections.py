"""Corrections of a dynamic stiffness for what the tester adds to the specimen, with their uncertainty.

From the specimen k + i h to what is measured, with w = 2 pi f:

    s = k + i h - w^2 m            fixture_inertia: mass m moves with the specimen, before the force transducer
    s' = 1 / (1 / s + c)           frame_compliance: c deforms in series, within what the displacement is measured over
    measured = s' e^(i w tau)      transducer_lag: displacement is late against force by tau

Correcting undoes them from the last to the first. What the parameters are not known to is common to all points: each
corrected point has it in its covariance and, source by source, in `shared_errors`; `joint_covariance` has both.
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
from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.interval import Estimate, combined_degrees_of_freedom

LARGEST_SHARE = 0.5  # of the measured motion that the frame may take; beyond, the specimen is hardly measured


class TesterEffect(StrEnum):
    """What is corrected for."""

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
    """Which effects to correct for, and their parameters.

    Attributes:
        values: tau in s, c in m/N, m in kg, by effect; an effect that is not there is not corrected for.
        errors: (effects, sources) by how much one standard deviation of each independent source of error moves each
            parameter, in the order of `values`.
        degrees_of_freedom: behind the errors; infinite where they are known beforehand.
        source: of the parameters, such as "blank of 3 May"; points corrected from one source share its error.
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
    def independent(cls, estimates: Mapping[TesterEffect, Estimate], source: str = "rig") -> RigCorrections:
        """Parameters that were found apart from each other."""
        deviations = [estimate.standard_error for estimate in estimates.values()]
        fewest = min((estimate.degrees_of_freedom for estimate in estimates.values()), default=math.inf)
        return cls({effect: each.value for effect, each in estimates.items()}, np.diag(deviations), fewest, source)

    @classmethod
    def correlated(
        cls, values: Mapping[TesterEffect, float], covariance: Real, degrees_of_freedom: float, source: str
    ) -> RigCorrections:
        """Parameters that were found together, with their (effects, effects) covariance."""
        deviations = np.sqrt(np.diag(covariance))
        scale = np.where(deviations > 0, deviations, 1.0)  # units differ by powers of ten
        strength, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
        return cls(values, scale[:, None] * axes * np.sqrt(np.maximum(strength, 0.0)), degrees_of_freedom, source)

    @property
    def covariance(self) -> Real:
        """(effects, effects) of the parameters."""
        return np.asarray(self.errors @ self.errors.T)

    def only(self, *effects: TesterEffect) -> RigCorrections:
        """The same with all but `effects` switched off.

        Raises:
            AnalysisError: one of them is not there.
        """
        missing = set(effects) - set(self.values)
        if missing:
            raise AnalysisError(f"no parameter is known for {', '.join(sorted(missing))}")
        order = [index for index, effect in enumerate(self.values) if effect in effects]
        kept = {effect: value for effect, value in self.values.items() if effect in effects}
        return replace(self, values=kept, errors=self.errors[order])

    def without(self, *effects: TesterEffect) -> RigCorrections:
        """The same with `effects` switched off."""
        return self.only(*(effect for effect in self.values if effect not in effects))

    def estimate(self, effect: TesterEffect) -> Estimate:
        """An effect's parameter with its standard error."""
        index = list(self.values).index(effect)
        return Estimate(self.values[effect], float(np.linalg.norm(self.errors[index])), self.degrees_of_freedom)

    @property
    def records(self) -> tuple[AppliedCorrection, ...]:
        """What a corrected point carries."""
        return tuple(
            AppliedCorrection(effect.value, *_symbol_first(effect, self.estimate(effect))) for effect in self.values
        )


def correct(points: Sequence[DynamicStiffness], corrections: RigCorrections) -> tuple[DynamicStiffness, ...]:
    """The specimen's own dynamic stiffness at each point, and the amplitude that the specimen itself saw.

    The energy by which a loop differs from its ellipse is kept as it was measured.

    Raises:
        AnalysisError: the frame takes more than half of the motion at a point.
    """
    return tuple(_corrected(point, corrections) for point in points)


def joint_covariance(points: Sequence[DynamicStiffness]) -> Real:
    """(2 points, 2 points) covariance of [k_1, h_1, k_2, h_2, ...], (N/m)^2, with what the points share."""
    sources = sorted({source for point in points for source in point.shared_errors})
    shared = np.array([[point.shared_errors.get(source, 0.0) for source in sources] for point in points], dtype=complex)
    columns = np.stack([shared.real, shared.imag], axis=1).reshape(2 * len(points), len(sources))
    covariance: Real = columns @ columns.T
    for index, point in enumerate(points):
        block = slice(2 * index, 2 * index + 2)
        covariance[block, block] = point.covariance
    return covariance


def complex_factor(factor: complex) -> Real:
    """(2, 2) what multiplication by `factor` does to [real, imaginary]."""
    return np.array([[factor.real, -factor.imag], [factor.imag, factor.real]])


def _corrected(point: DynamicStiffness, corrections: RigCorrections) -> DynamicStiffness:
    values = corrections.values
    omega = 2 * math.pi * point.frequency
    on_time = cmath.exp(-1j * omega * values.get(TesterEffect.TRANSDUCER_LAG, 0.0))
    in_series = point.complex_stiffness * on_time
    share = values.get(TesterEffect.FRAME_COMPLIANCE, 0.0) * in_series  # of the motion, that the frame takes
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
    own = turn @ (point.covariance - _outer_sum(point.shared_errors)) @ turn.T
    added = _outer_sum(shared)
    corrected = replace(
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
    )
    if point.loop_energy is None or point.loop_energy_excess is None:
        return corrected
    return replace(corrected, loop_energy=corrected.first_harmonic_energy + point.loop_energy_excess.value)


def _outer_sum(errors: Mapping[str, complex]) -> Real:
    """(2, 2) covariance of [k, h] that these sources make."""
    parts = np.array([[error.real, error.imag] for error in errors.values()]).reshape(-1, 2)
    return np.asarray(parts.T @ parts)


def _symbol_first(effect: TesterEffect, estimate: Estimate) -> tuple[str, float, float, str]:
    symbol, unit = PARAMETERS[effect]
    return symbol, estimate.value, estimate.standard_error, unit
