"""The displacement channel as a witness at a stop: motion is seen whatever the tester says, and noise is none."""

import re
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from daq import device
from daq.errors import AcquisitionCancelledError
from rig.control import RunControl
from rig.errors import RunStoppedError
from rig.registers import Interlock, State, Value
from rig.sequences.sweep_plan import SweepPlan
from rig.tester.displacement_witness import BEYOND_NOISE, LOOK, PATIENCE, DisplacementWitness, oscillation_pp
from rig.tester.rest_judge import REST_PP
from rig.tester.status import ActuatorNotAtRestError, StopDisobeyedError
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.daq_server import start_daq_server
from simlab.thermometer_server import start_thermometer_server
from tests.channels import TESTER_CHANNELS
from tests.fault_proxy import FaultProxy, Impairment, Way
from tests.mutated_tester import LIAR, MutatedDevice, start_mutated_tester
from tests.rig.sweeping import Run, SweepLaboratory, recording
from tests.waiting import until

RATE = 5000.0
PLAN = SweepPlan((50.0,), (1e-4,), 1.5e-4, ("shear",), ("I",), shortest_record=8.0)
Real = NDArray[np.float64]


# -- judging a record, without a wire


@given(
    seed=st.integers(0, 2**32 - 1),
    rms=st.floats(0.0, 2e-5),
    hum_pp=st.floats(0.0, 2e-5),
    drift=st.floats(-1e-3, 1e-3),
    spike=st.floats(-1e-3, 1e-3),
)
def test_noise_hum_drift_and_a_spike_at_rest_are_never_judged_as_motion(
    seed: int, rms: float, hum_pp: float, drift: float, spike: float
) -> None:
    chance, time_ = np.random.default_rng(seed), np.arange(round(LOOK * RATE)) / RATE

    def at_rest() -> Real:
        hum = hum_pp / 2 * np.sin(2 * np.pi * 50 * time_ + chance.uniform(0, 7))
        return rms * chance.standard_normal(time_.size) + hum

    limit = max(REST_PP, BEYOND_NOISE * oscillation_pp(at_rest()))
    disturbed = at_rest() + drift * time_
    disturbed[chance.integers(time_.size)] += spike
    assert oscillation_pp(disturbed) < limit


@given(frequency=st.floats(10.0, 1000.0), phase=st.floats(0.0, 7.0))
def test_the_smallest_test_amplitude_is_seen_from_ten_hertz_on(frequency: float, phase: float) -> None:
    time_ = np.arange(round(LOOK * RATE)) / RATE
    assert oscillation_pp(0.5e-5 * np.sin(2 * np.pi * frequency * time_ + phase)) > REST_PP


@given(frequency=st.floats(4.0, 10.0), phase=st.floats(0.0, 7.0))
def test_an_ordinary_amplitude_is_seen_from_four_hertz_on(frequency: float, phase: float) -> None:
    time_ = np.arange(round(LOOK * RATE)) / RATE
    assert oscillation_pp(0.5e-4 * np.sin(2 * np.pi * frequency * time_ + phase)) > REST_PP


# -- on the wires of a sweep


@pytest.fixture
def laboratory() -> Iterator[SweepLaboratory]:
    """A sweep whose tester can be mutated, sound as yet."""
    bench = ordinary_bench(21, Clock(1.0))
    with ExitStack() as stack:
        daq, thermometer = start_daq_server(bench), start_thermometer_server(bench)
        stack.callback(daq.stop)
        stack.callback(thermometer.stop)
        _, server = start_mutated_tester(bench)
        stack.callback(server.stop)
        yield SweepLaboratory(PLAN, bench, daq, server, thermometer)


def machine(laboratory: SweepLaboratory) -> MutatedDevice:
    assert isinstance(laboratory.tester.device, MutatedDevice)
    return laboratory.tester.device


def time_to_rest(laboratory: SweepLaboratory, request: Callable[[], None]) -> float:
    """Time in s from a request to rest by the physics; `request` has returned then."""
    began = time.monotonic()
    asking = threading.Thread(target=request)
    asking.start()
    until(machine(laboratory).rests)
    took = time.monotonic() - began
    asking.join()
    return took


@pytest.mark.parametrize("how", ["stop", "pause"])
def test_a_tester_that_lies_in_everything_is_stopped_by_the_coil_and_the_end_of_the_run_says_so(
    laboratory: SweepLaboratory, how: str
) -> None:
    control = RunControl()
    run = Run(laboratory.sweep, control)
    until(lambda: recording(laboratory))
    machine(laboratory).mutate(LIAR)
    getattr(control, how)()
    until(machine(laboratory).rests)
    assert machine(laboratory).status()["interlocks"] == Interlock.EMERGENCY_STOP  # not the watchdog
    control.resume()
    error = run.ended()
    assert isinstance(error, StopDisobeyedError)
    seen = r"the acquisition device sees it move by 0\.(1|099)\d* mm peak to peak"
    late = "other requests still wait for their replies"  # a slow line trips the coil before anything is seen
    assert re.search(f"{seen}|{late}", str(error))


def test_rest_is_not_said_where_a_liar_ignores_the_coil_too(laboratory: SweepLaboratory) -> None:
    control = RunControl()
    run = Run(laboratory.sweep, control)
    until(lambda: recording(laboratory))
    tripped: dict[str, Value] = {
        "state": State.TRIPPED,
        "interlocks": Interlock.EMERGENCY_STOP,
        "stopped_by": Interlock.EMERGENCY_STOP,
    }

    def lie(true: dict[str, Value]) -> dict[str, Value]:
        return LIAR.lie(true) | ({} if true["amplitude"] else tripped)

    machine(laboratory).mutate(replace(LIAR, coil_is_dead=True, lie=lie))
    words = r"sees it move by 0\.\d+ mm.*watchdog of the tester should stop it within"
    with pytest.raises(ActuatorNotAtRestError, match=words):
        control.stop()
    until(machine(laboratory).rests)
    assert isinstance(run.ended(), ActuatorNotAtRestError)


@pytest.mark.parametrize("how", ["stop", "pause"])
def test_a_sound_tester_gets_no_coil_where_its_channel_hums_from_before_the_stop(
    laboratory: SweepLaboratory, how: str
) -> None:
    laboratory.daq.faults.set("hum", TESTER_CHANNELS[0].physical)
    control = RunControl()
    run = Run(laboratory.sweep, control)
    until(lambda: recording(laboratory))
    getattr(control, how)()
    assert laboratory.at_rest()
    assert machine(laboratory).status()["interlocks"] == 0
    control.stop()
    assert isinstance(run.ended(), RunStoppedError)
    assert machine(laboratory).status()["interlocks"] == 0


def test_an_acquisition_device_that_is_silent_holds_up_no_stop_for_long(laboratory: SweepLaboratory) -> None:
    proxy = FaultProxy(laboratory.daq.address.removeprefix("grpc://"), seed=3)
    laboratory.daq.address = f"grpc://{proxy.address}"
    control = RunControl()
    try:
        run = Run(laboratory.sweep, control)
        until(lambda: recording(laboratory))
        proxy.impair(Impairment(lost=Way.BOTH))
        began = time.monotonic()
        assert time_to_rest(laboratory, control.stop) < 0.5
        assert time.monotonic() - began < LOOK + 3 * PATIENCE
        assert machine(laboratory).status()["interlocks"] == 0
    finally:
        proxy.stop()
    run.ended()


def test_a_look_waits_for_the_end_of_a_record_that_another_thread_takes(laboratory: SweepLaboratory) -> None:
    over = threading.Event()
    with device.connect(laboratory.daq.address) as chassis, chassis.record(TESTER_CHANNELS, RATE, 9.0) as recorder:
        witness = DisplacementWitness(recorder)
        assert witness.motion_pp() is None  # its noise is not known
        witness.learn(lambda: False)
        measuring = threading.Thread(target=lambda: cancelled(witness, over))
        measuring.start()
        until(lambda: laboratory.daq.faults.calls["WaitUntilTaskDone"] > 0)
        over.set()
        assert witness.motion_pp() is None  # at rest
        measuring.join()
        assert witness.record(0.1, lambda: False).duration == pytest.approx(0.1)


def cancelled(witness: DisplacementWitness, over: threading.Event) -> None:
    with pytest.raises(AcquisitionCancelledError):
        witness.record(9.0, over.is_set)
