"""Every error that an instrument can answer with, at every step of a sweep and of a hammer session.

After each: the error is in words, the actuator is at rest, no task holds the instrument, and the next run succeeds.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial

from pymodbus.constants import ExcCodes

from analysis.dof import Dof
from daq.device import connect as connect_daq
from daq.errors import DaqError
from rig.errors import RigError
from rig.hammer.session import BlowSink, run_hammer_session
from rig.operator import Operator
from rig.registers import Refusal, State
from rig.sequences.sequence import HammerStep
from rig.sequences.sweep_plan import SweepPlan
from rig.sweep.driven_sweep import run_sweep
from rig.tester.driver import connect as connect_tester
from rig.thermometer import Thermometer
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.daq_errors import Code
from simlab.daq_server import start_daq_server
from simlab.ordinary import BenchConditions
from simlab.tester_device import DeviceLimits
from simlab.tester_server import start_tester_server
from simlab.thermometer_server import start_thermometer_server
from tests.channels import HAMMER_CHANNELS, TESTER_CHANNELS

SPEED = 1000.0
WATCHDOG_TIME = 1.0  # s
REST_WITHIN = 5.0  # s, for the watchdog of a busy computer
PLAN = SweepPlan(
    frequencies=(200.0,), amplitudes_pp=(1e-4,), configurations=("shear",), specimens=("I",), shortest_record=0.05
)
STEP = HammerStep(step="hammer", points=("5y",), block_seconds=0.3, trigger_level=5.0).model_copy(update={"blows": 1})

COMMANDS = ("HYDRAULICS_ON", "PRESET", "CYCLE", "HOLD", "HYDRAULICS_OFF")
TESTER_STEPS = (
    *((command, 0) for command in COMMANDS),
    ("IDENTITY", 0),
    ("DETECTORS", 0),
    *(("STATUS", after) for after in (0, 1, 2, 4, 7)),
    ("HEARTBEAT", 0),
)
REFUSALS = tuple(refusal for refusal in Refusal if refusal is not Refusal.NONE)
EXCEPTIONS = tuple(ExcCodes)
DAQ_CODES = tuple(Code)

Step = tuple[str, int]


class Rig(Operator, BlowSink):
    """The simulated instruments, and one small run of each kind on them."""

    def __init__(self) -> None:
        self._stack = ExitStack()
        self.bench = ordinary_bench(5, Clock(SPEED), BenchConditions(double_hits=0.0))
        self.daq = start_daq_server(self.bench)
        self._stack.callback(self.daq.stop)
        self.tester = start_tester_server(self.bench, limits=DeviceLimits(watchdog_time=WATCHDOG_TIME))
        self._stack.callback(self.tester.stop)
        self._thermometer = start_thermometer_server(self.bench, pty=True)
        self._stack.callback(self._thermometer.stop)

    def close(self) -> None:
        """Stop the instruments."""
        self._stack.close()

    def mount(self, specimen: str, configuration: str) -> None:
        """Be the operator."""
        self.bench.mount(specimen, configuration)

    def strike(self, point: Dof, blow: int) -> None:
        """Be the operator."""
        self.bench.strike(point.node, str(point.direction))

    def add_sine(self, point: object) -> None:
        """Be the sink."""

    def add_blow(self, point: object, number: int, block: object, verdict: object) -> None:
        """Be the sink."""

    def sweep(self) -> None:
        """One sine point, from connecting to leaving."""
        with (
            connect_daq(self.daq.address) as chassis,
            chassis.record(TESTER_CHANNELS, 5120.0, 0.5) as recorder,
            Thermometer(self._thermometer.url, 0.2) as thermometer,
            connect_tester(self.tester.url) as driver,
        ):
            run_sweep(PLAN, driver, recorder, thermometer, self, self)

    def hammer(self) -> None:
        """One blow, from connecting to leaving."""
        with connect_daq(self.daq.address) as chassis:
            run_hammer_session(chassis, HAMMER_CHANNELS, STEP, self, self, blow_timeout=0.3)

    def daq_steps(self, run: Callable[[], None]) -> tuple[Step, ...]:
        """Each method that `run` calls on the DAQ wire: its first call, and its last where there are several."""
        self.daq.faults.calls.clear()
        run()
        calls = self.daq.faults.calls.copy()
        first = tuple((method, 0) for method in calls)
        return first + tuple((method, count - 1) for method, count in calls.items() if count > 1)

    def trial(self, run: Callable[[], None], *, then: bool = True) -> str:
        """Do `run`, which has been prepared to fail, and look at what it leaves; `then` do it again, repaired.

        Returns:
            How it ended: "error in words" or "went on".

        Raises:
            AssertionError: something is not as it has to be afterwards.
        """
        raised: Exception | None = None
        try:
            run()
        except (RigError, DaqError) as error:
            raised = error
        assert raised is None or " " in str(raised), f"{raised!r} is not in words"
        self.tester.script.clear()
        self.daq.faults.clear()
        self._check_at_rest()
        if then:
            self._reset()
            run()
            assert self.daq.tasks == (), f"{self.daq.tasks} were not cleared"
        return "went on" if raised is None else "error in words"

    def _check_at_rest(self) -> None:
        end = time.monotonic() + REST_WITHIN
        while self.tester.device.status()["state"] not in (State.HYDRAULICS_OFF, State.TRIPPED):
            assert time.monotonic() < end, f"not safe: {self.tester.device.status()}"
            time.sleep(0.01)
        assert self.tester.actuator.steady_pp() == 0.0

    def _reset(self) -> None:
        if self.tester.device.status()["interlocks"]:
            with connect_tester(self.tester.url) as driver:
                driver.reset()


@contextmanager
def rig_running() -> Iterator[Rig]:
    """The instruments, until the context is left."""
    rig = Rig()
    try:
        yield rig
    finally:
        rig.close()


def trial_of_tester(rig: Rig, step: Step, answer: Refusal | ExcCodes, *, then: bool = True) -> str:
    """A sweep in which the tester answers `step` with `answer` from then on."""
    name, after = step
    rig.tester.script.set(name, answer, after=after)
    return rig.trial(rig.sweep, then=then)


def trial_of_daq(rig: Rig, run: Callable[[], None], step: Step, code: int, *, then: bool = True) -> str:
    """A run whose `step` is answered with `code` once."""
    method, after = step
    rig.daq.faults.script(method, code, after)
    return rig.trial(run, then=then)


def main() -> None:
    """All errors at all steps; a line for each kind, and every one that left something behind."""
    with rig_running() as rig:
        kinds: dict[str, Iterator[Callable[[], str]]] = {
            "refusals of the tester": (
                partial(trial_of_tester, rig, step, answer)
                for answer in REFUSALS
                for step in TESTER_STEPS
                if step[0] in COMMANDS
            ),
            "Modbus exceptions": (
                partial(trial_of_tester, rig, step, answer) for answer in EXCEPTIONS for step in TESTER_STEPS
            ),
            "DAQ errors in a sweep": (
                partial(trial_of_daq, rig, rig.sweep, step, code)
                for step in rig.daq_steps(rig.sweep)
                for code in DAQ_CODES
            ),
            "DAQ errors in a hammer session": (
                partial(trial_of_daq, rig, rig.hammer, step, code)
                for step in rig.daq_steps(rig.hammer)
                for code in DAQ_CODES
            ),
        }
        for kind, trials in kinds.items():
            outcomes, wrong = Counter[str](), list[str]()
            for trial in trials:
                try:
                    outcomes[trial()] += 1
                except Exception as error:  # noqa: BLE001 - whatever it is, the table says so
                    wrong.append(f"{type(error).__name__}: {error}"[:160])
                    rig.tester.script.clear()
                    rig.daq.faults.clear()
            print(
                f"{kind}: {outcomes.total()} as they should be ({dict(outcomes)}), {len(wrong)} not",
                *wrong[:5],
                sep="\n  ",
            )
