"""A sweep on simulated instruments in a thread of its own, for tests that interfere while it is on."""

import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field

from daq import device
from rig.control import RunControl
from rig.events import Event
from rig.operator import Operator
from rig.registers import CommandCode, State
from rig.sequences.sweep_plan import SweepPlan
from rig.sweep.driven_sweep import SinePoint, run_sweep
from rig.tester import driver as tester
from rig.tester.limits import TesterLimits
from rig.tester.stop_latch import StopLatch
from rig.thermometer import Thermometer
from simlab.bench import SimulatedBench, ordinary_bench
from simlab.clock import Clock
from simlab.daq_server import DaqServer, start_daq_server
from simlab.tester_device import DeviceLimits
from simlab.tester_server import TesterServer, start_tester_server
from simlab.thermometer_server import ThermometerServer, start_thermometer_server
from tests.channels import TESTER_CHANNELS
from tests.waiting import LONG


@dataclass
class SweepLaboratory(Operator):
    """The simulated instruments, the plan of a sweep, and what came of it."""

    plan: SweepPlan
    bench: SimulatedBench
    daq: DaqServer
    tester: TesterServer
    thermometer: ThermometerServer
    limits: TesterLimits = field(default_factory=TesterLimits)
    latch: StopLatch = field(default_factory=StopLatch)
    points: list[SinePoint] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)

    def sweep(self, control: RunControl) -> None:
        with (
            device.connect(self.daq.address) as chassis,
            chassis.record(TESTER_CHANNELS, 5120.0, 3.0) as recorder,
            Thermometer(self.thermometer.url, 0.2) as thermometer,
            tester.connect(
                self.tester.url, self.limits, timeout=1.0, observer=self.events.append, latch=self.latch
            ) as driver,
        ):
            run_sweep(self.plan, driver, recorder, thermometer, self, self, self.events.append, control)

    def mount(self, specimen: str, configuration: str) -> None:
        self.bench.mount(specimen, configuration)

    def strike(self, point: object, blow: int) -> None:
        raise AssertionError("a sweep has no blows")

    def add_sine(self, point: SinePoint) -> None:
        self.points.append(point)

    def at_rest(self) -> bool:
        status = self.tester.device.status()
        return status["amplitude"] == 0.0 and status["state"] in (State.HELD, State.IDLE, State.HYDRAULICS_OFF)

    def seen(self, kind: type[Event]) -> int:
        return sum(isinstance(event, kind) for event in self.events)


class Run(threading.Thread):
    """A run in a thread; `error` is how it ended."""

    def __init__(self, run: Callable[[RunControl], None], control: RunControl) -> None:
        super().__init__(daemon=True)
        self.error: Exception | None = None
        self._target_run = run
        self._control = control
        self.start()

    def run(self) -> None:
        try:
            self._target_run(self._control)
        except Exception as error:  # noqa: BLE001 - whatever it is, the test looks at it
            self.error = error

    def ended(self) -> Exception | None:
        self.join(LONG)
        assert not self.is_alive()
        return self.error


@contextmanager
def sweeping(plan: SweepPlan, speed: float, limits: DeviceLimits | None = None) -> Iterator[SweepLaboratory]:
    """The laboratory for `plan`; `limits` are set at its tester."""
    bench = ordinary_bench(21, Clock(speed))
    with ExitStack() as stack:
        daq = start_daq_server(bench)
        stack.callback(daq.stop)
        server = start_tester_server(bench, limits=limits)
        stack.callback(server.stop)
        thermometer = start_thermometer_server(bench, pty=True)
        stack.callback(thermometer.stop)
        yield SweepLaboratory(plan, bench, daq, server, thermometer)


def recording(laboratory: SweepLaboratory) -> bool:
    """Settled, and a while ago: the record is being taken."""
    status = laboratory.tester.device.status()
    return status["state"] == State.SETTLED and int(str(status["cycles"])) > 30


def ramping(laboratory: SweepLaboratory) -> bool:
    """On the way to the preset."""
    status = laboratory.tester.device.status()
    return status["state"] == State.RAMPING and status["command"] == CommandCode.PRESET
