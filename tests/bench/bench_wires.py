"""What one transaction on each wire costs, real packages on both ends, the simulated laboratory in its own process."""

import time
from collections.abc import Callable

import numpy as np

from jointlab.instruments import instruments_of
from jointlab.trials.simulated_laboratory import simulated_settings
from rig.thermometer import Thermometer
from simlab.laboratory import LaboratoryProcess


def main() -> None:
    """Print median and 99th percentile in ms."""
    with LaboratoryProcess(seed=1, speed=1000.0) as laboratory:
        instruments = instruments_of(simulated_settings(laboratory.addresses))
        with instruments.acquisition() as (chassis, thermometer), instruments.tester() as tester:
            laboratory.operator.do("mount", specimen="I", configuration="shear")
            channels = instruments.channels_named("displacement", "force")
            with chassis.record(channels, 5000.0, 1.0) as recorder:
                show("record of 2 x 5000 samples (1 ms of it is the bench's)", lambda: recorder.record(1.0), 200)
            show("tester status (Modbus TCP)", tester.status, 500)
            show("temperature (serial over TCP)", lambda: celsius(thermometer), 500)
            tester.start()
            tester.preset(5e-4)
            amplitudes = iter(np.tile([1e-5, 2e-5], 100))
            show("command with read-back", lambda: tester.cycle(float(next(amplitudes)), 20.0), 200)


def celsius(thermometer: Thermometer) -> float:
    """One reading."""
    return thermometer.celsius()


def show(what: str, work: Callable[[], object], repeats: int) -> None:
    """Time `work`."""
    took = []
    for _ in range(repeats):
        before = time.perf_counter()
        work()
        took.append(1e3 * (time.perf_counter() - before))
    print(f"{what:<56} median {np.median(took):7.2f} ms   99 % {np.percentile(took, 99):7.2f} ms", flush=True)
