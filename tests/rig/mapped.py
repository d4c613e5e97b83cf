"""The second simulated tester, driven by the map in the documentation's example."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from daq import device
from rig.control import RunControl
from rig.sequences.sweep_plan import SweepPlan
from rig.sweep.driven_sweep import SinePoint, run_sweep, uncorrected
from rig.tester import driver as tester
from rig.tester.driver import Tester
from rig.tester.register_map import OURS, TesterMap, Write
from rig.tester.register_map_file import read_tester_map
from rig.thermometer import Thermometer
from simlab.actuator import Dwell
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.daq_server import start_daq_server
from simlab.plc_tester import PlcTesterServer, start_plc_tester
from simlab.tester_device import DeviceLimits
from simlab.tester_server import start_tester_server
from simlab.thermometer_server import start_thermometer_server
from tests.channels import TESTER_CHANNELS
from tests.rig.sweeping import SweepLaboratory

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "tester_map.toml"
PLAN = SweepPlan(
    frequencies=(20.0, 50.0, 150.0), amplitudes_pp=(1e-4, 2e-5), configurations=("shear",), specimens=("I",)
)
WATCHDOG_TIME = 1.0


def example_map(*, watchdog: bool = True) -> TesterMap:
    """The map of the example, with the watchdog time of these tests or without a watchdog."""
    found = read_tester_map(EXAMPLE)
    if watchdog:
        return replace(found, stated={**found.stated, "watchdog_time": WATCHDOG_TIME})
    return replace(found, heartbeat=None)


def bare_map() -> TesterMap:
    """A map of the same controller with as little as the driver needs."""
    found = example_map(watchdog=False)
    left_out = {"force_pp", "amplitude", "frequency"}
    (status,) = found.status
    registers = tuple(
        replace(each, name=f"unused {each.name}") if each.name in left_out else each for each in status.registers
    )
    commands = {
        code: tuple(replace(step, read_back=False) if isinstance(step, Write) else step for step in steps)
        for code, steps in found.commands.items()
    }
    return replace(
        found,
        status=(replace(status, registers=registers),),
        commands=commands,
        emergency_stop=(),
        interlocks=(),
        stated={},
    )


@dataclass
class MappedLaboratory(SweepLaboratory):
    """The simulated instruments with the second tester."""

    tester_map: TesterMap = field(kw_only=True)
    broken: Callable[[], object] = field(kw_only=True, default=int)
    """Called when the first point is stored."""
    dwells: list[Dwell] = field(default_factory=list)

    def add_sine(self, point: SinePoint) -> None:
        super().add_sine(point)
        self.dwells.append(self.tester.actuator.log[-1])
        if len(self.points) == 1:
            self.broken()

    @property
    def plc(self) -> PlcTesterServer:
        assert isinstance(self.tester, PlcTesterServer)
        return self.tester

    @contextmanager
    def driver(self) -> Iterator[Tester]:
        with tester.connect(
            self.tester.url,
            self.limits,
            observer=self.events.append,
            latch=self.latch,
            tester_map=self.tester_map,
            without=self.tester_map.lacks,
        ) as driver:
            yield driver

    def sweep(self, control: RunControl) -> None:
        with (
            device.connect(self.daq.address) as chassis,
            chassis.record(TESTER_CHANNELS, 5120.0, 3.0) as recorder,
            Thermometer(self.thermometer.url, 0.2) as thermometer,
            self.driver() as driver,
        ):
            run_sweep(self.plan, driver, recorder, thermometer, self, self, self.events.append, control)

    def moves(self) -> bool:
        return self.tester.device.is_moving()


@contextmanager
def mapped_laboratory(
    tester_map: TesterMap | None = None,
    plan: SweepPlan = PLAN,
    seed: int = 21,
    speed: float = 200.0,
    *,
    rtu: bool = False,
) -> Iterator[MappedLaboratory]:
    """The simulated instruments with the tester of a map, which has a watchdog where that has a heartbeat."""
    tester_map = tester_map or example_map()
    bench = ordinary_bench(seed, Clock(speed))
    with ExitStack() as stack:
        daq = start_daq_server(bench)
        stack.callback(daq.stop)
        limits = DeviceLimits(watchdog_time=WATCHDOG_TIME)
        server = (
            start_tester_server(bench, rtu=rtu, limits=limits)
            if tester_map is OURS
            else start_plc_tester(bench, rtu=rtu, limits=limits, has_watchdog=tester_map.heartbeat is not None)
        )
        stack.callback(server.stop)
        thermometer = start_thermometer_server(bench, pty=True)
        stack.callback(thermometer.stop)
        yield MappedLaboratory(plan, bench, daq, server, thermometer, tester_map=tester_map)


def wrong_points(laboratory: MappedLaboratory) -> list[str]:
    """What is wrong with the points that were stored, against the truth of the dwells they were recorded in."""
    wrong = list[str]()
    for point, truth in zip(laboratory.points, laboratory.dwells, strict=True):
        block = point.block
        found = uncorrected(block.value("displacement"), block.value("force"), block.sample_rate, point.frequency)
        allowed = 0.02 if point.amplitude_pp > 5e-5 else 0.05
        if (truth.configuration, truth.specimen) != (point.configuration, point.specimen):
            wrong.append(f"{point.order_number}: {truth.specimen} in {truth.configuration} was mounted")
        if abs(truth.frequency / point.frequency - 1) > 1e-4:
            wrong.append(f"{point.order_number}: {truth.frequency} Hz for {point.frequency} Hz")
        if abs(point.reached_pp / truth.amplitude_pp - 1) > allowed:
            wrong.append(f"{point.order_number}: {truth.amplitude_pp:g} m for {point.reached_pp:g} m")
        if found is None or abs(found[0] / truth.stiffness - 1) > allowed:
            wrong.append(f"{point.order_number}: k {found} for {truth.stiffness:g}")
    return wrong
