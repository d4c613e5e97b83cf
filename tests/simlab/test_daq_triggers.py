"""Triggers of the simulated NI-DAQmx server: where a record lies around an edge, and what no bench can trigger on."""

import numpy as np
import pytest
from nidaqmx.constants import Slope, TaskMode
from nidaqmx.error_codes import DAQmxErrors

from simlab.daq_server import DaqServer
from tests.simlab.daq_client import HALF_COUNT, NewTask, Ramps, finite, raised


def test_a_reference_trigger_keeps_the_samples_before_it(new_task: NewTask, bench: Ramps) -> None:
    task = new_task("hammer", "accelerometer")
    finite(task, 5120, 1000)
    task.triggers.reference_trigger.cfg_anlg_edge_ref_trig("hammer", pretrigger_samples=256, trigger_level=50.0)
    hammer, _ = np.array(task.read(1000))
    rounding = HALF_COUNT / 2.25e-3  # N: a sample at the edge itself may be rounded to either side of it
    assert hammer[255] - rounding < 50 <= hammer[256] + rounding
    assert np.all(np.diff(hammer[:1000]) > 0)


def test_a_trigger_counts_only_when_the_pre_trigger_samples_are_there(new_task: NewTask, bench: Ramps) -> None:
    task = new_task("hammer")
    finite(task, 5120, 20_000)
    task.triggers.reference_trigger.cfg_anlg_edge_ref_trig("hammer", pretrigger_samples=10_000, trigger_level=50.0)
    started = bench.clock.now()
    task.start()
    task.wait_until_done(5)
    task.read(20_000)
    assert bench.starts[-1] >= started  # nothing from before the start


def test_a_trigger_that_does_not_come_is_a_timeout(new_task: NewTask) -> None:
    task = new_task("hammer")
    finite(task, 5120, 100)
    task.triggers.reference_trigger.cfg_anlg_edge_ref_trig("hammer", pretrigger_samples=10, trigger_level=150.0)
    assert raised(lambda: task.read(100, timeout=0.05)) == DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE


@pytest.mark.parametrize("fault", ["dead", "weak", "inverted", "saturated", "offset"])
def test_a_hammer_that_does_not_reach_the_level_triggers_nothing(
    new_task: NewTask, server: DaqServer, fault: str
) -> None:
    """The trigger looks at the input, not at the blow: its ramps of 100 N are 10 N of a weak hammer."""
    server.faults.set(fault, "cDAQ1Mod1/ai0")
    task = new_task("hammer")
    finite(task, 5120, 100)
    task.triggers.reference_trigger.cfg_anlg_edge_ref_trig("hammer", pretrigger_samples=10, trigger_level=50.0)
    assert raised(lambda: task.read(100, timeout=0.2)) == DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE


def test_a_weak_hammer_triggers_where_what_is_left_reaches_the_level(new_task: NewTask, server: DaqServer) -> None:
    server.faults.set("weak", "cDAQ1Mod1/ai0")
    task = new_task("hammer")
    finite(task, 5120, 100)
    task.triggers.reference_trigger.cfg_anlg_edge_ref_trig("hammer", pretrigger_samples=10, trigger_level=5.0)
    hammer = np.array(task.read(100, timeout=5.0))
    rounding = HALF_COUNT / 2.25e-3
    assert hammer[9] - rounding < 5.0 <= hammer[10] + rounding


def test_triggers_that_the_bench_cannot_make_are_refused(new_task: NewTask) -> None:
    task = new_task("hammer", "accelerometer")
    trigger = task.triggers.reference_trigger.cfg_anlg_edge_ref_trig
    assert raised(lambda: trigger("accelerometer", 10)) == DAQmxErrors.INVALID_ANALOG_TRIG_SRC
    assert raised(lambda: trigger("hammer", 10, Slope.FALLING)) == DAQmxErrors.INVALID_ATTRIBUTE_VALUE
    assert raised(lambda: trigger("nothing", 10)) == -200428
    finite(task, 5120, 100)
    trigger("hammer", pretrigger_samples=100)
    assert raised(lambda: task.control(TaskMode.TASK_VERIFY)) == DAQmxErrors.INVALID_ATTRIBUTE_VALUE
