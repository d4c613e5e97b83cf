"""What can be wrong with the simulated NI-DAQmx server: overloads, open cables, overruns, lost devices."""

import threading

import numpy as np
import pytest
from nidaqmx.error_codes import DAQmxErrors

from simlab.daq_server import DaqServer
from tests.simlab.daq_client import NewTask, Ramps, continuous, finite, raised
from tests.waiting import LONG


def test_a_channel_beyond_its_range_is_clipped_and_flagged_until_asked(new_task: NewTask, bench: Ramps) -> None:
    bench.offset = 500.0  # 5.1 V
    task = new_task("hammer", "accelerometer")
    finite(task, 5120, 100)
    _, accelerometer = np.array(task.read(100))
    assert np.all(accelerometer == accelerometer[0])
    assert accelerometer[0] == pytest.approx(5 / 10.2e-3, rel=1e-6)
    assert task.in_stream.overloaded_chans_exist
    assert task.in_stream.overloaded_chans == ["accelerometer"]
    assert not task.in_stream.overloaded_chans_exist


def test_an_overload_fault_overloads_its_channel_only(new_task: NewTask, server: DaqServer, bench: Ramps) -> None:
    bench.clock.sleep_until(1.0)
    server.faults.set("overload", "cDAQ1Mod2/ai1")
    task = new_task("displacement", "force")
    finite(task, 5000, 5000)
    task.read(5000)
    assert task.in_stream.overloaded_chans_exist
    assert task.in_stream.overloaded_chans == ["force"]


def test_an_open_cable_rails_an_iepe_channel_and_silences_another(new_task: NewTask, server: DaqServer) -> None:
    server.faults.set("cable_open", "cDAQ1Mod1/ai1")
    server.faults.set("cable_open", "cDAQ1Mod2/ai1")
    task = new_task("accelerometer", "force")
    finite(task, 5120, 100)
    accelerometer, force = np.array(task.read(100))
    np.testing.assert_allclose(accelerometer, 5 / 10.2e-3, rtol=1e-6)
    assert np.max(np.abs(force)) < 1e-3


def test_an_overrun_happens_once(new_task: NewTask, server: DaqServer) -> None:
    server.faults.set("overrun")
    task = new_task("force")
    finite(task, 5000, 100)
    assert raised(lambda: task.read(100)) == DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE
    task.stop()
    assert len(task.read(100)) == 100


def test_a_device_that_goes_ends_a_read_that_waits(new_task: NewTask, server: DaqServer) -> None:
    task = new_task("force")
    continuous(task, 5000, 10_000_000)
    task.start()
    goes = threading.Timer(0.05, server.faults.set, ("device_gone",))
    goes.start()
    assert raised(lambda: task.read(5_000_000, timeout=LONG)) == DAQmxErrors.DEV_CANNOT_BE_ACCESSED
    goes.join()
    server.faults.clear()
    assert len(task.read(100)) == 100


@pytest.mark.parametrize("code", [-201003, -200279, -50103, -200010])
def test_a_scripted_status_comes_once_from_its_method(new_task: NewTask, server: DaqServer, code: int) -> None:
    task = new_task("force")
    server.faults.script("StartTask", code)
    assert raised(task.start) == code
    task.start()


@pytest.mark.parametrize(("name", "channel"), [("overload", ""), ("overrun", "cDAQ1Mod1/ai0"), ("fire", "")])
def test_a_fault_that_does_not_exist_is_refused(server: DaqServer, name: str, channel: str) -> None:
    with pytest.raises(ValueError, match="choose one of"):
        server.faults.set(name, channel)
