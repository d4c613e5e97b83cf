"""The bench: everything physical that the simulated instruments are wired to, on one clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from simlab.clock import Clock

Real = NDArray[np.float64]


class Actuator(Protocol):
    """What moves the specimen in the tester."""

    def signals(self, times: Real) -> tuple[Real, Real]:
        """Displacement in m and force in N at bench `times` (samples,) in s, as the sensors put them out."""


@dataclass(frozen=True)
class Conditions:
    """How the bench behaves, apart from its seed.

    Attributes:
        peak_force: mean peak force of a blow, N; a harder hammer level softens the joints.
        double_hits: probability that an ordinary blow bounces.
        tolerances: scale of what is drawn off its nominal value (beam, positions, cylinders); 0 is the drawing itself.
        scatter: scale of the hand's scatter in place, angle, force and width; 0 is a hammer in a guide.
        gain_error: largest relative error of a sensor's gain; 0 is exact.
        force_noise, acceleration_noise: white noise of the two sensors, N and m/s^2 rms a sample.
        cross_axis: cross-axis sensitivity of the accelerometer, through which it sees the beam bend out of plane.
    """

    peak_force: float = 100.0
    double_hits: float = 0.03
    tolerances: float = 1.0
    scatter: float = 1.0
    gain_error: float = 0.005
    force_noise: float = 0.02
    acceleration_noise: float = 0.008
    cross_axis: float = 0.01


@dataclass(frozen=True)
class Mounted:
    """What is in the tester: the cylinders of joint `specimen` (I or II) in compression, shear or angled."""

    specimen: str
    configuration: str


class Bench:
    """Beam on two joints, hammer and accelerometer, and the cylinders in the tester; safe to share between threads."""

    def __init__(self, seed: int, clock: Clock, conditions: Conditions | None = None) -> None:
        self.seed = seed
        self.clock = clock
        self.conditions = conditions or Conditions()

    def strike(
        self,
        node: int,
        direction: str,
        at: float | None = None,
        what: str | None = None,
        peak_force: float | None = None,
    ) -> None:
        """Let the hand strike `node` (1, 3 to 9, 11 in y; 1, 11 in x), with its peak at bench time `at` or soon.

        `what` is clean, double, weak, overload, soft or late; None is an ordinary blow, now and then a double hit.

        Raises:
            ValueError: no hammer reaches that point, or there is no such blow.
        """
        raise NotImplementedError

    def hammer_signals(self, start: float, rate: float, samples: int) -> dict[str, Real]:
        """``hammer`` in N and ``accelerometer`` in m/s^2, each (samples,), at bench times start + i / rate."""
        raise NotImplementedError

    def next_crossing(self, channel: str, level: float, after: float) -> float | None:
        """Bench time later than `after` when ``hammer`` first rises through `level` N; None if no known blow does."""
        raise NotImplementedError

    def mount(self, specimen: str, configuration: str) -> None:
        """Put the cylinders of joint `specimen` (I or II) into the tester in compression, shear or angled.

        Raises:
            ValueError: no such specimen or configuration.
        """
        raise NotImplementedError

    @property
    def mounted(self) -> Mounted | None:
        """What is in the tester; None while it is empty."""
        raise NotImplementedError

    def dynamic_stiffness(self, amplitude: float, frequency: float) -> complex:
        """k + ih in N/m of what is mounted, at zero-to-peak `amplitude` m and `frequency` Hz, at today's temperature.

        Raises:
            ValueError: the tester is empty.
        """
        raise NotImplementedError

    def static_force(self, preset: float) -> float:
        """Force in N that holds what is mounted at `preset` m."""
        raise NotImplementedError

    def third_harmonic(self, amplitude: float) -> float:
        """Third harmonic of the force over its first, in phase with it, at zero-to-peak `amplitude` m."""
        raise NotImplementedError

    def attach_actuator(self, actuator: Actuator) -> None:
        """Connect the tester's actuator, whose signals `tester_signals` passes on."""
        raise NotImplementedError

    def tester_signals(self, times: Real) -> dict[str, Real]:
        """``displacement`` in m and ``force`` in N at bench `times` (samples,) in s; zero without an actuator."""
        raise NotImplementedError

    def temperature(self, time: float) -> float:
        """Temperature in degrees Celsius at bench `time`."""
        raise NotImplementedError

    def truth(self) -> dict[str, Any]:
        """What the bench really is, ready for JSON."""
        raise NotImplementedError
