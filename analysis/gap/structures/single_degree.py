"""A single degree of freedom: its response to sines or to a record of force, dynamic stiffness, or free decay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.gap.parameter import Parameter
from analysis.gap.structures.chain_effects import chain_effects
from analysis.gap.structures.curve import Conditions, Curve
from analysis.gap.structures.effect import Acting, Properties, StructureEffect, properties_under, read_by
from analysis.gap.structures.material_effects import material_effects
from analysis.gap.structures.measured_amplitude import Amplitudes, amplitude_range, displacements
from analysis.gap.structures.record_response import record_response
from analysis.gap.structures.simulator import Values
from analysis.gap.structures.steady_response import steady_response

DERIVATIVES = {"displacement": 0, "velocity": 1, "acceleration": 2}
"""Observables, with the order of the time derivative of displacement."""
STIFFNESS = "stiffness"
"""Observable: force over displacement, N/m, complex."""
POLE = "pole"
"""Observable: i times the angular frequency less the decay rate of free vibration, rad/s, complex."""
UNEQUAL = 1e-3
"""Largest difference of a time of a record from equal steps, over a step."""


@dataclass(frozen=True)
class SingleDegree:
    """Mass, spring and damper under a force, in m, kg, N and s, or in other consistent units of force and response.

    Properties that effects may change: `stiffness`, `mass`, `loss_factor` (structural), `damping` (viscous), `cubic`
    (of the force `cubic` x^3).

    Observables: `displacement`, `velocity` and `acceleration` under the condition `force`, either sines with a
    `frequency` (complex readings) or a record with a `time` (real readings); `stiffness` at a `frequency`; `pole`, of a
    decay at an `amplitude`, which local parameters do not change.

    Attributes:
        parameters: `stiffness` at least; those of the above that are missing are zero.
        local: `gain` (relative to one), `phase` (rad) and `detuning` (of the natural frequency, relative) of each part.
    """

    parameters: tuple[Parameter, ...]
    local: tuple[Parameter, ...] = ()
    name: str = field(default="single degree of freedom")

    def effects(self, curves: Sequence[Curve]) -> tuple[StructureEffect, ...]:
        """Laws of the spring and of the damper, and effects of the measuring chain."""
        return (*material_effects(_amplitudes(curves)), *chain_effects(curves))

    def predict(self, values: Values, acting: Sequence[Acting], curve: Curve) -> Complex:
        """(n,) readings of a curve.

        Raises:
            AnalysisError: the observable is unknown, the response has no steady state, or the time of a record does not
                rise by equal steps.
        """
        known = {"stiffness": 0.0, "mass": 0.0, "loss_factor": 0.0, "damping": 0.0, "cubic": 0.0, **values}
        known["mass"] /= (1 + known.get("detuning", 0.0)) ** 2
        if curve.observable == STIFFNESS:
            found = _dynamic_stiffness(properties_under(acting, known, curve.conditions), curve.conditions["frequency"])
        elif curve.observable == POLE:
            return read_by(acting, _pole({**known, "mass": values["mass"]}, acting, curve.conditions), curve)
        elif curve.observable not in DERIVATIVES:
            names = ", ".join((*DERIVATIVES, STIFFNESS, POLE))
            raise AnalysisError(f"{self.name} has no observable {curve.observable!r}; it has {names}")
        elif "time" in curve.conditions:
            found = _of_record(known, acting, curve)
        else:
            found = _of_sines(known, acting, curve)
        gain = (1 + values.get("gain", 0.0)) * np.exp(1j * values.get("phase", 0.0))
        return read_by(acting, gain * found if curve.is_complex else (1 + values.get("gain", 0.0)) * found, curve)


def _dynamic_stiffness(properties: Properties, frequency: Real) -> Complex:
    pole = 2j * np.pi * frequency
    spring = properties["stiffness"] * (1 + 1j * properties["loss_factor"] * np.sign(frequency))
    return np.asarray(spring + pole * properties["damping"] + pole**2 * properties["mass"])


def _pole(known: Properties, acting: Sequence[Acting], conditions: Conditions) -> Complex:
    """Root of m s^2 + c s + k (1 + i loss), with the mean stiffness of the cubic spring."""
    properties = properties_under(acting, known, conditions)
    stiffness = properties["stiffness"] + 0.75 * properties["cubic"] * conditions["amplitude"] ** 2
    decay = properties["damping"] / properties["mass"] / 2
    square = stiffness * (1 + 1j * properties["loss_factor"]) / properties["mass"]
    return np.asarray(1j * np.sqrt(square - decay**2) - decay)


def _of_sines(known: Properties, acting: Sequence[Acting], curve: Curve) -> Complex:
    conditions, frequency = curve.conditions, curve.conditions["frequency"]
    force = conditions["force"]

    def response(amplitude: Real) -> Complex:
        there: Conditions = {**conditions, "amplitude": amplitude}
        properties = properties_under(acting, known, there)
        mean = {**properties, "stiffness": properties["stiffness"] + 0.75 * properties["cubic"] * amplitude**2}
        return np.asarray(force / _dynamic_stiffness(mean, frequency))

    linear = np.abs(force / _dynamic_stiffness(known, frequency))
    follows = any("amplitude" in each.effect.needs for each in acting) or known["cubic"] != 0.0
    displacement = steady_response(response, linear) if follows else response(linear)
    return np.asarray(displacement * (2j * np.pi * frequency) ** DERIVATIVES[curve.observable])


def _of_record(known: Properties, acting: Sequence[Acting], curve: Curve) -> Complex:
    """Laws see one value of each condition: its mean; for amplitude and force, those of a sine as large as the record.

    The amplitude is that of the linear response.
    """
    if curve.observable != "displacement":
        raise AnalysisError(f"records of {curve.observable} are not simulated; give displacement")
    force, rate = curve.conditions["force"], _sample_rate(curve)
    linear = record_response(lambda frequency: _dynamic_stiffness(known, frequency), 0.0, force, rate)
    means = {name: np.mean(own) for name, own in curve.conditions.items() if name != "time"}
    means |= {"amplitude": np.sqrt(2) * np.std(linear), "force": np.sqrt(2) * np.std(force)}

    def under(frequency: Real) -> Properties:
        own = {name: np.full(frequency.size, mean) for name, mean in means.items()}
        return properties_under(acting, known, {**own, "frequency": frequency})

    cubic = float(np.max(under(np.zeros(1))["cubic"]))
    found = record_response(lambda frequency: _dynamic_stiffness(under(frequency), frequency), cubic, force, rate)
    return np.asarray(found, dtype=complex)


def _sample_rate(curve: Curve) -> float:
    """Hz, of the condition `time`.

    Raises:
        AnalysisError: its steps are not equal, or not above zero.
    """
    time = curve.conditions["time"]
    step = float(time[-1] - time[0]) / max(1, time.size - 1)
    if not step > 0 or np.max(np.abs(time - time[0] - step * np.arange(time.size))) > UNEQUAL * step:
        raise AnalysisError(f"{curve.name}: time does not rise by equal steps; resample to equal steps")
    return 1 / step


def _amplitudes(curves: Sequence[Curve]) -> tuple[float, float] | None:
    """Least and largest amplitude that was measured, zeros if none is other than zero; None where none is known."""
    found = list[Amplitudes]()
    for each in curves:
        if "amplitude" in each.conditions:
            found.append(Amplitudes(each.conditions["amplitude"], np.zeros(each.values.size)))
        elif each.observable in DERIVATIVES and "frequency" in each.conditions:
            found.append(displacements(each, DERIVATIVES[each.observable]))
        elif each.observable in DERIVATIVES and np.any(each.counted):
            found.append(Amplitudes(np.sqrt(2) * np.std(each.values[each.counted], keepdims=True), np.zeros(1)))
    if not found:
        return None
    return amplitude_range(found) or (0.0, 0.0)
