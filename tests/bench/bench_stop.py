"""From asking for a stop to the actuator at rest, while a sweep acquires, in real time, instruments in another process.

What is measured is an upper bound: the call returns once the instrument has confirmed rest. The instrument's own ramp
is its exponential stop from the amplitude it cycled with to the amplitude that it calls rest.
"""

import math
import threading
import time
from dataclasses import dataclass, field

import numpy as np

from jointlab.instruments import instruments_of
from jointlab.trials.simulated_laboratory import simulated_settings
from rig.control import RunControl
from rig.errors import RunStoppedError
from rig.operator import Operator
from rig.sweep import SinePoint, run_sweep
from rig.sweep_plan import SweepPlan
from simlab.actuator import Servo
from simlab.laboratory import LaboratoryProcess
from simlab.tester_device import REST_WITHIN

AMPLITUDE_PP = 1e-4  # m
RAMP = Servo().stopping_time * math.log(AMPLITUDE_PP / REST_WITHIN)  # s
STOPS = 100
PLAN = SweepPlan(
    frequencies=tuple(np.arange(20.0, 200.0, 0.25)),
    amplitudes_pp=(AMPLITUDE_PP,),
    configurations=("shear",),
    specimens=("I",),
    shortest_record=1.0,
)


@dataclass
class Hands(Operator):
    """Operator and sink; `mounted` is set when the sweep has begun."""

    laboratory: LaboratoryProcess
    mounted: threading.Event = field(default_factory=threading.Event)

    def mount(self, specimen: str, configuration: str) -> None:
        """Be the operator."""
        self.laboratory.operator.do("mount", specimen=specimen, configuration=configuration)
        self.mounted.set()

    def strike(self, point: object, blow: int) -> None:
        """A sweep has no blows."""
        raise AssertionError("a sweep has no blows")

    def add_sine(self, point: SinePoint) -> None:
        """Be the sink."""


def main() -> None:
    """Pause and resume a sweep at random moments, then stop it; print quantiles in ms."""
    chance, took = np.random.default_rng(4), list[float]()
    control = RunControl()
    with LaboratoryProcess(seed=1, speed=1.0) as laboratory:
        hands = Hands(laboratory)
        run = threading.Thread(target=_sweep, args=(laboratory, hands, control))
        run.start()
        hands.mounted.wait()
        time.sleep(2.0)
        for number in range(STOPS):
            time.sleep(float(chance.uniform(0.8, 2.0)))
            before = time.perf_counter()
            if number < STOPS - 1:
                control.pause()
            else:
                control.stop()
            took.append(1e3 * (time.perf_counter() - before))
            control.resume()
        run.join()
    show("request to confirmed rest", np.array(took))
    show(f"less the instrument's own ramp of {1e3 * RAMP:.0f} ms", np.array(took) - 1e3 * RAMP)


def show(what: str, took: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
    """Print one line."""
    median, most, worst = np.percentile(took, [50, 99, 100])
    print(f"{what:<56} median {median:7.1f} ms   99 % {most:7.1f} ms   worst {worst:7.1f} ms", flush=True)


def _sweep(laboratory: LaboratoryProcess, hands: Hands, control: RunControl) -> None:
    instruments = instruments_of(simulated_settings(laboratory.addresses))
    channels = instruments.channels_named("displacement", "force")
    with (
        instruments.acquisition() as (chassis, thermometer),
        instruments.tester() as tester,
        chassis.record(channels, 5000.0, 12.0) as recorder,
    ):
        try:
            run_sweep(PLAN, tester, recorder, thermometer, hands, hands, control=control)
        except RunStoppedError as stopped:
            print(stopped, flush=True)
