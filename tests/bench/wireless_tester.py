"""A tester without wires: the simulated actuator, the rig's own way of reaching an amplitude, and a clock that is set
by hand.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from analysis.direct.dynamic_stiffness import DynamicStiffness, dynamic_stiffness
from analysis.frequency_response import Real
from rig.registers import CYCLES_REPORTED, State
from rig.sequences.sweep_plan import SweepPlan
from rig.sweep.amplitude import AmplitudeControl
from rig.tester.driver import Tester
from simlab.actuator import Actuator
from simlab.bench import SimulatedBench, ordinary_bench
from simlab.clock import Clock
from simlab.ordinary import BenchConditions
from simlab.tester_device import SETTLED_WITHIN
from simlab.tester_frame import BLANK, TesterFrame

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
class Measured:
    """A point, and the stiffness (N/m) that the specimen really had at the mean amplitude of the record."""

    point: DynamicStiffness
    truth: complex
    wanted_pp: float


class WirelessTester:
    """Measures sine points on what is mounted, by the rig's rules."""

    def __init__(self, bench: SimulatedBench, clock: HandClock, seed: int, preset: float) -> None:
        self.limits = SimpleNamespace(largest_amplitude_pp=lambda frequency: 1e-3)
        self._clock, self._bench = clock, bench
        self._actuator = Actuator(bench, clock.now, seed)
        bench.attach_actuator(self._actuator)
        self._actuator.move(preset)
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
            record = self._bench.tester_signals(times)
            self._clock.time = float(times[-1])
            dwell = self._actuator.log[-1]
            point = dynamic_stiffness(record["displacement"], record["force"], RATE, frequency)
            off = np.log(point.amplitude_pp / dwell.amplitude_pp)
            slope = complex(dwell.stiffness_slope, dwell.damping_slope)
            yield Measured(point, complex(dwell.stiffness, dwell.damping) + off * slope, wanted_pp)


def paper_sweep(seed: int, specimen: str, configuration: str, frame: TesterFrame) -> list[Measured]:
    """The paper's 120 points of one mounting, on the bench of `seed`."""
    return list(_tester(seed, specimen, configuration, frame, PRESET).sweep(SweepPlan()))


def calibration_sweep(seed: int, piece: str, amplitude_pp: float, frame: TesterFrame) -> list[DynamicStiffness]:
    """Ten frequencies on a known piece."""
    plan = SweepPlan(frequencies=tuple(float(f) for f in range(20, 201, 20)), amplitudes_pp=(amplitude_pp,))
    return [measured.point for measured in _tester(seed, piece, BLANK, frame, 0.0).sweep(plan)]


def _tester(seed: int, specimen: str, configuration: str, frame: TesterFrame, preset: float) -> WirelessTester:
    clock = HandClock()
    bench = ordinary_bench(seed, clock, BenchConditions(frame=frame))
    bench.mount(specimen, configuration)
    return WirelessTester(bench, clock, seed, preset)
