"""A tester without wires: the simulated actuator, the rig's own way of reaching an amplitude, a clock that is set by
hand, and a chain between specimen and record that adds what a real tester adds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from analysis.direct.dynamic_stiffness import DynamicStiffness, dynamic_stiffness
from analysis.frequency_response import Real
from rig.amplitude import AmplitudeControl
from rig.registers import CYCLES_REPORTED, State
from rig.sweep import SweepPlan
from rig.tester import Tester
from simlab.actuator import Actuator, Specimen
from simlab.bench import Bench, Mounted
from simlab.clock import Clock
from simlab.tester_device import SETTLED_WITHIN

RATE = 5000.0
PRESET = 0.5e-3
POLL = 0.02  # s
LONGEST_WAIT = 30.0  # s


class HandClock(Clock):
    """A clock that stands still until it is set."""

    def __init__(self) -> None:
        super().__init__()
        self.time = 0.0

    def now(self) -> float:
        return self.time


@dataclass(frozen=True)
class Chain:
    """What the tester adds: fixture mass (kg), frame compliance (m/N), and displacement late by so much (s)."""

    mass: float = 0.0
    compliance: float = 0.0
    lag: float = 0.0


@dataclass(frozen=True)
class KnownPiece:
    """What is mounted to calibrate the tester: a blank, a mass, or nothing."""

    stiffness: float = 0.0
    mass: float = 0.0

    @property
    def mounted(self) -> Mounted | None:
        return Mounted("known", "compression")

    def dynamic_stiffness(self, amplitude: float, frequency: float) -> complex:
        return complex(self.stiffness - (2 * math.pi * frequency) ** 2 * self.mass)

    def static_force(self, preset: float) -> float:
        return 0.0

    def third_harmonic(self, amplitude: float) -> float:
        return 0.0


@dataclass(frozen=True)
class WithFixture:
    """A specimen and the mass that moves with it."""

    specimen: Specimen
    mass: float

    @property
    def mounted(self) -> Mounted | None:
        return self.specimen.mounted

    def dynamic_stiffness(self, amplitude: float, frequency: float) -> complex:
        return self.specimen.dynamic_stiffness(amplitude, frequency) - (2 * math.pi * frequency) ** 2 * self.mass

    def static_force(self, preset: float) -> float:
        return self.specimen.static_force(preset)

    def third_harmonic(self, amplitude: float) -> float:
        return self.specimen.third_harmonic(amplitude)


@dataclass(frozen=True)
class Measured:
    """A point, and the stiffness (N/m) that the specimen really had at the amplitude about which the cycles scatter."""

    point: DynamicStiffness
    truth: complex
    wanted_pp: float


class WirelessTester:
    """Measures sine points on what is mounted, by the rig's rules."""

    def __init__(self, specimen: Specimen, clock: HandClock, seed: int, chain: Chain) -> None:
        self.limits = SimpleNamespace(largest_amplitude_pp=lambda frequency: 1e-3)
        self._clock, self._chain = clock, chain
        self._actuator = Actuator(WithFixture(specimen, chain.mass), clock.now, seed)
        self._actuator.move(PRESET)
        clock.time += 1.0

    def cycle(self, amplitude_pp: float, frequency: float) -> None:
        self._actuator.cycle(amplitude_pp, frequency)

    def wait(self, until: Callable[[Any], bool], to: str) -> SimpleNamespace:
        give_up = self._clock.time + LONGEST_WAIT
        while self._clock.time < give_up:
            self._clock.time += POLL
            now, steady = self._clock.time, self._actuator.steady_pp()
            settled = abs(self._actuator.amplitude_pp(now) - steady) <= SETTLED_WITHIN * steady
            status = SimpleNamespace(
                state=State.SETTLED if settled else State.CYCLING,
                displacement_pp=tuple(self._actuator.latest_cycles_pp(now, CYCLES_REPORTED)),
            )
            if until(status):
                return status
        raise TimeoutError(f"the simulated tester did not {to}")

    def sweep(self, plan: SweepPlan) -> Iterator[Measured]:
        """Every amplitude and frequency of a plan."""
        control = AmplitudeControl(cast(Tester, self))
        for wanted_pp, frequency in plan.sines():
            tolerance = plan.tolerance_at(wanted_pp)
            reached = control.approach(wanted_pp, frequency, tolerance)
            duration = plan.record_duration(frequency, reached.scatter, tolerance)
            times: Real = self._clock.time + np.arange(round(duration * RATE)) / RATE
            displacement, force = self._record(times)
            self._clock.time = float(times[-1])
            dwell = self._actuator.log[-1]
            truth = complex(dwell.stiffness, dwell.damping) + (2 * math.pi * frequency) ** 2 * self._chain.mass
            yield Measured(dynamic_stiffness(displacement, force, RATE, frequency), truth, wanted_pp)

    def _record(self, times: Real) -> tuple[Real, Real]:
        _, force = self._actuator.signals(times)
        displacement, force_then = self._actuator.signals(times - self._chain.lag)
        return displacement + self._chain.compliance * force_then, force


def paper_sweep(seed: int, specimen: str, configuration: str, chain: Chain) -> list[Measured]:
    """The paper's 120 points of one mounting, on the bench of `seed`."""
    clock = HandClock()
    bench = Bench(seed, clock)
    bench.mount(specimen, configuration)
    return list(WirelessTester(bench, clock, seed, chain).sweep(SweepPlan()))


def calibration_sweep(seed: int, piece: KnownPiece, amplitude_pp: float, chain: Chain) -> list[DynamicStiffness]:
    """Ten frequencies on something known."""
    plan = SweepPlan(frequencies=tuple(float(f) for f in range(20, 201, 20)), amplitudes_pp=(amplitude_pp,))
    return [measured.point for measured in WirelessTester(piece, HandClock(), seed, chain).sweep(plan)]
