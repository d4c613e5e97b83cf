"""A bench whose signals tell their time, and short words for NI's own client."""

from collections.abc import Callable

import nidaqmx
import numpy as np
import pytest
from nidaqmx.constants import AccelUnits, AcquisitionType
from nidaqmx.errors import DaqError
from numpy.typing import NDArray

from simlab.clock import Clock

Real = NDArray[np.float64]
NewTask = Callable[..., nidaqmx.Task]
SPEED = 20.0
HALF_COUNT = 5 / 2**24  # V, of the NI 9234


class Ramps:
    """A bench whose every signal is linear in time, so that a value tells its time; blows at whole seconds."""

    def __init__(self) -> None:
        self.clock = Clock(SPEED)
        self.starts: list[float] = []
        self.offset = 0.0  # m/s^2

    def hammer_signals(self, start: float, rate: float, samples: int) -> dict[str, Real]:
        self.starts.append(start)
        times = start + np.arange(samples) / rate
        return {"hammer": 100 * (times % 1.0), "accelerometer": 10 * times + self.offset}

    def tester_signals(self, times: Real) -> dict[str, Real]:
        return {"displacement": 1e-5 * times, "force": 100 * times}

    def next_crossing(self, channel: str, level: float, after: float) -> float | None:
        assert channel == "hammer"
        return float(np.ceil(after - level / 100)) + level / 100 if 0 < level < 100 else None


def add(task: nidaqmx.Task, kind: str, **changes: object) -> None:
    inputs = task.ai_channels
    if kind == "hammer":
        inputs.add_ai_force_iepe_chan("cDAQ1Mod1/ai0", "hammer", **{"current_excit_val": 2e-3} | changes)
    elif kind == "accelerometer":
        settings = {
            "sensitivity": 10.2 * 9.80665,
            "current_excit_val": 2e-3,
            "min_val": -490.0,
            "max_val": 490.0,
            "units": AccelUnits.METERS_PER_SECOND_SQUARED,
        }
        inputs.add_ai_accel_chan("cDAQ1Mod1/ai1", "accelerometer", **settings | changes)
    else:
        physical = {"displacement": "cDAQ1Mod2/ai0", "force": "cDAQ1Mod2/ai1"}[kind]
        inputs.add_ai_voltage_chan(physical, kind, **{"min_val": -10.0, "max_val": 10.0} | changes)


def finite(task: nidaqmx.Task, rate: float, samples: int) -> None:
    task.timing.cfg_samp_clk_timing(rate, sample_mode=AcquisitionType.FINITE, samps_per_chan=samples)


def continuous(task: nidaqmx.Task, rate: float, samples: int = 1000) -> None:
    task.timing.cfg_samp_clk_timing(rate, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=samples)


def raised(call: Callable[[], object]) -> int:
    with pytest.raises(DaqError) as error:
        call()
    return int(error.value.error_code)
