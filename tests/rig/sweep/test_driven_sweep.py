"""A sweep through all its wires: tester over Modbus, displacement and force over NI-DAQmx, thermometer over serial."""

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.direct.dynamic_stiffness import dynamic_stiffness
from daq import device
from daq.channels import Channel
from daq.errors import DaqError
from rig.errors import RigError
from rig.events import Event, SinePointMeasured, SinePointRefused, SpecimenMounted
from rig.operator import Operator
from rig.registers import CommandCode, Interlock, State
from rig.sequences.sweep_plan import PlanError, SweepPlan
from rig.sweep.driven_sweep import SinePoint, SineSink, run_sweep
from rig.tester import driver as tester
from rig.tester import limits as tester_limits
from rig.tester import status as tester_status
from rig.tester.modbus import ModbusUnreachableError
from rig.thermometer import Thermometer, ThermometerError
from simlab.bench import SimulatedBench, ordinary_bench
from simlab.clock import Clock
from simlab.daq_server import DaqServer, start_daq_server
from simlab.tester_server import TesterServer as Server
from simlab.tester_server import start_tester_server
from simlab.thermometer_server import ThermometerServer, start_thermometer_server
from tests.channels import DISPLACEMENT, LOAD_CELL, TESTER_CHANNELS

SAMPLE_RATE = 5120.0
SMALL = SweepPlan(
    frequencies=(20.0, 25.0, 200.0),
    amplitudes_pp=(1e-4, 1e-5),
    configurations=("compression", "shear"),
    specimens=("I",),
)


@dataclass
class Laboratory(Operator):
    """The simulated instruments, and a hand that looks at the tester before it reaches in."""

    bench: SimulatedBench
    daq: DaqServer
    tester: Server
    thermometer: ThermometerServer
    state_when_mounting: list[State] = field(default_factory=list)

    def mount(self, specimen: str, configuration: str) -> None:
        self.state_when_mounting.append(State(int(str(self.tester.device.status()["state"]))))
        self.bench.mount(specimen, configuration)

    def strike(self, point: object, blow: int) -> None:
        raise AssertionError("a sweep has no blows")

    def is_safe(self) -> bool:
        at_rest = self.tester.actuator.steady_pp() == 0.0
        return at_rest and self.tester.device.status()["state"] in (State.HYDRAULICS_OFF, State.TRIPPED)


class Sink:
    """Keeps points and, for each, the truth of the dwell that it was recorded in."""

    def __init__(self, laboratory: Laboratory) -> None:
        self.points: list[SinePoint] = []
        self.dwells: list[int] = []
        self._laboratory = laboratory

    def add_sine(self, point: SinePoint) -> None:
        self.points.append(point)
        self.dwells.append(len(self._laboratory.tester.actuator.log) - 1)


@pytest.fixture
def laboratory() -> Iterator[Laboratory]:
    bench = ordinary_bench(21, Clock(speed=200.0))
    with ExitStack() as stack:
        daq = start_daq_server(bench)
        stack.callback(daq.stop)
        server = start_tester_server(bench)
        stack.callback(server.stop)
        thermometer = start_thermometer_server(bench, pty=True)
        stack.callback(thermometer.stop)
        yield Laboratory(bench, daq, server, thermometer)


def sweep(
    laboratory: Laboratory,
    sink: SineSink,
    plan: SweepPlan = SMALL,
    events: list[Event] | None = None,
    limits: tester_limits.TesterLimits | None = None,
    channels: tuple[Channel, ...] = TESTER_CHANNELS,
) -> None:
    with (
        device.connect(laboratory.daq.address) as chassis,
        chassis.record(channels, SAMPLE_RATE, 0.5) as recorder,
        Thermometer(laboratory.thermometer.url, 0.2) as thermometer,
        tester.connect(laboratory.tester.url, limits) as driver,
    ):
        observer = (lambda _: None) if events is None else events.append
        run_sweep(plan, driver, recorder, thermometer, laboratory, sink, observer)


@pytest.mark.parametrize("channels", [TESTER_CHANNELS, (DISPLACEMENT, LOAD_CELL)], ids=["conditioner", "bridge"])
def test_a_small_sweep_finds_the_truth_at_the_amplitudes_asked_for(
    laboratory: Laboratory, channels: tuple[Channel, ...]
) -> None:
    sink, events = Sink(laboratory), list[Event]()
    sweep(laboratory, sink, events=events, channels=channels)
    assert [(p.configuration, p.amplitude_pp, p.frequency) for p in sink.points] == [
        (configuration, *sine) for configuration in SMALL.configurations for sine in SMALL.sines()
    ]
    assert [point.order_number for point in sink.points] == list(range(1, SMALL.points + 1))
    for point, number in zip(sink.points, sink.dwells, strict=True):
        tolerance, allowed = (0.02, 0.01) if point.amplitude_pp == 1e-4 else (0.05, 0.03)
        assert point.within_tolerance
        assert point.reached_pp == pytest.approx(point.amplitude_pp, rel=tolerance)
        assert point.block.duration * point.frequency > 9.99
        assert point.block.duration > 0.499
        truth = laboratory.tester.actuator.log[number]
        assert (truth.configuration, truth.frequency) == (point.configuration, point.frequency)
        found = dynamic_stiffness(
            point.block.value("displacement"), point.block.value("force"), point.block.sample_rate, point.frequency
        )
        assert found.stiffness == pytest.approx(truth.stiffness, rel=allowed)
        assert found.loss_factor == pytest.approx(truth.damping / truth.stiffness, rel=allowed)
        assert point.temperature_celsius == pytest.approx(laboratory.bench.temperature(0.0), abs=0.3)
    assert [type(event) for event in events].count(SpecimenMounted) == 2
    assert [type(event) for event in events].count(SinePointMeasured) == SMALL.points
    assert laboratory.is_safe()


def test_a_point_at_the_mains_is_measured_beside_it_under_its_planned_frequency(laboratory: Laboratory) -> None:
    sink = Sink(laboratory)
    plan = replace(SMALL, frequencies=(50.0,), amplitudes_pp=(1e-4,), configurations=("shear",), mains_frequency=50)
    sweep(laboratory, sink, plan)
    ((point, number),) = zip(sink.points, sink.dwells, strict=True)
    assert (point.frequency, point.driven_frequency) == (50.0, 48.0)
    truth = laboratory.tester.actuator.log[number]
    assert truth.frequency == pytest.approx(48.0)
    signals = point.block.value("displacement"), point.block.value("force")
    found = dynamic_stiffness(*signals, point.block.sample_rate, 48.0)
    assert found.stiffness == pytest.approx(truth.stiffness, rel=0.01)


def test_specimens_are_mounted_only_while_hydraulics_are_off(laboratory: Laboratory) -> None:
    sweep(laboratory, Sink(laboratory), replace(SMALL, frequencies=(50.0,), amplitudes_pp=(1e-4,)))
    assert laboratory.state_when_mounting == [State.HYDRAULICS_OFF] * 2


@pytest.mark.parametrize("error", [KeyboardInterrupt, ZeroDivisionError])
def test_an_interruption_leaves_the_actuator_at_rest_and_keeps_what_was_measured(
    laboratory: Laboratory, error: type[BaseException]
) -> None:
    class Interrupted(Sink):
        def add_sine(self, point: SinePoint) -> None:
            super().add_sine(point)
            if len(self.points) == 2:
                raise error

    sink = Interrupted(laboratory)
    with pytest.raises(error):
        sweep(laboratory, sink)
    assert laboratory.is_safe()
    assert len(sink.points) == 2


class Breaking(Sink):
    """Breaks something after the first point."""

    def __init__(self, laboratory: Laboratory, name: str) -> None:
        super().__init__(laboratory)
        self.name = name

    def add_sine(self, point: SinePoint) -> None:
        super().add_sine(point)
        if len(self.points) == 1:
            match self.name:
                case "thermometer":
                    self._laboratory.thermometer.faults.set("silent")
                case "daq":
                    self._laboratory.daq.faults.set("device_gone")
                case "emergency stop":
                    self._laboratory.tester.emergency_stop()
                case fault:
                    self._laboratory.tester.faults.set(fault)


@pytest.mark.parametrize(
    ("broken", "error"),
    [
        ("thermometer", ThermometerError),
        ("daq", DaqError),
        ("emergency stop", tester_status.TesterTrippedError),
        ("refuse", tester_status.TesterRefusedError),
        # or, where the computer is busy as well, the reply to the last of many tries comes too late
        ("busy", (tester_status.TesterRefusedError, ModbusUnreachableError)),
        ("runaway_servo", tester_status.TesterTrippedError),
        ("flipped_status", RigError),
        ("silent", RigError),
    ],
)
def test_whatever_breaks_the_actuator_is_at_rest_and_after_repair_the_next_sweep_succeeds(
    laboratory: Laboratory, broken: str, error: type[Exception] | tuple[type[Exception], ...]
) -> None:
    sink = Breaking(laboratory, broken)
    with pytest.raises(error):
        sweep(laboratory, sink)
    assert laboratory.is_safe()
    assert len(sink.points) == 1

    laboratory.thermometer.faults.clear()
    laboratory.daq.faults.clear()
    laboratory.tester.faults.clear()
    laboratory.tester.release_emergency_stop()
    with tester.connect(laboratory.tester.url) as driver:
        if driver.status().state is State.TRIPPED:
            driver.reset()
    again = Sink(laboratory)
    sweep(laboratory, again, replace(SMALL, configurations=("shear",)))
    assert len(again.points) == 6
    assert all(point.within_tolerance for point in again.points)


def test_a_tripped_tester_is_not_reset_by_starting_a_sweep(laboratory: Laboratory) -> None:
    laboratory.tester.emergency_stop()
    laboratory.tester.release_emergency_stop()
    with pytest.raises(tester_status.TesterTrippedError, match="emergency stop"):
        sweep(laboratory, Sink(laboratory))
    assert laboratory.tester.device.status()["interlocks"] == Interlock.EMERGENCY_STOP


def test_an_amplitude_out_of_reach_is_recorded_as_reached_and_reported(laboratory: Laboratory) -> None:
    laboratory.tester.faults.set("weak_servo")
    sink, events = Sink(laboratory), list[Event]()
    plan = replace(SMALL, frequencies=(50.0,), amplitudes_pp=(1e-4,), configurations=("shear",))
    sweep(laboratory, sink, plan, events, tester_limits.TesterLimits(amplitude_pp=1.2e-4))
    (point,) = sink.points
    assert not point.within_tolerance
    assert point.commanded_pp == 1.2e-4
    assert point.reached_pp == pytest.approx(laboratory.tester.actuator.log[-1].amplitude_pp, rel=0.01)
    (refused,) = [event for event in events if isinstance(event, SinePointRefused)]
    assert refused.reason.endswith("were reached of 0.1 mm; recorded as reached")


@pytest.mark.parametrize("fault", ["dead", "saturated"])
@pytest.mark.parametrize("channel", TESTER_CHANNELS, ids=lambda channel: channel.name)
def test_a_dead_channel_stores_no_point_and_corrects_no_amplitude(
    laboratory: Laboratory, channel: Channel, fault: str
) -> None:
    class Dying(Sink):
        def add_sine(self, point: SinePoint) -> None:
            super().add_sine(point)
            self._laboratory.daq.faults.set(fault, channel.physical)

    sink = Dying(laboratory)
    with pytest.raises(RigError, match=f"{channel.name} .*The point was not stored"):
        sweep(laboratory, sink)
    assert len(sink.points) == 1
    assert laboratory.is_safe()
    assert max(dwell.amplitude_pp for dwell in laboratory.tester.actuator.log) < 1.1e-4


@pytest.mark.parametrize(
    "plan",
    [
        replace(SMALL, amplitudes_pp=(1e-4, 4e-4)),
        replace(SMALL, frequencies=(5.0, 300.0)),
        replace(SMALL, preset=2e-3),
        replace(SMALL, frequencies=(200.0,), amplitudes_pp=(2.5e-4,)),
    ],
)
def test_a_plan_beyond_the_rigs_limits_is_refused_before_anything_moves(
    laboratory: Laboratory, plan: SweepPlan
) -> None:
    with pytest.raises(tester_limits.LimitExceededError):
        sweep(laboratory, Sink(laboratory), plan)
    assert CommandCode.HYDRAULICS_ON not in laboratory.tester.device.applied
    assert laboratory.state_when_mounting == []


def test_the_default_plan_is_the_papers_720_points_and_within_the_rigs_limits() -> None:
    plan = SweepPlan()
    assert plan.points == 720
    assert (plan.frequencies[0], plan.frequencies[-1], len(plan.frequencies)) == (5.0, 200.0, 40)
    plan.check(tester_limits.TesterLimits())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"frequencies": ()}, "frequencies"),
        ({"specimens": ("I", "I")}, "none twice"),
        ({"tolerance": 0.0}, "tolerance"),
        ({"fine_tolerance": 2.0}, "fine_tolerance"),
        ({"fewest_cycles": 100}, "100 to 60 cycles"),
        ({"shortest_record": -1.0}, "shortest record"),
    ],
)
def test_a_plan_that_makes_no_sense_is_refused(change: dict[str, object], words: str) -> None:
    with pytest.raises(PlanError, match=words):
        SweepPlan(**change)  # type: ignore[arg-type]  # wrong on purpose


@given(st.floats(1.0, 250.0), st.floats(0.0, 1.0), st.floats(0.001, 0.2))
def test_a_record_has_whole_cycles_and_more_of_them_where_they_scatter(
    frequency: float, scatter: float, tolerance: float
) -> None:
    plan = SweepPlan()
    duration = plan.record_duration(frequency, scatter, tolerance)
    cycles = duration * frequency
    assert cycles == pytest.approx(round(cycles))
    assert duration > plan.shortest_record * (1 - 1e-9)
    assert plan.fewest_cycles <= round(cycles) <= max(plan.most_cycles, frequency * plan.shortest_record + 1)
    assert duration <= plan.record_duration(frequency, 2 * scatter, tolerance)
