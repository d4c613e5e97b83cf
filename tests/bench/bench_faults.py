"""Seeded faults of the network on the Modbus and the DAQ wire: what became of every call, and the worst of them.

After each fault: no call took longer than its timeouts allow, nothing wrong was taken for a value, no command was
applied twice, the actuator was at rest once the watchdog time had passed, and the repaired line worked again.
"""

import random
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any
from unittest.mock import patch

import numpy as np

from daq.block import Block
from daq.device import Chassis
from daq.device import connect as connect_daq
from daq.errors import DaqError
from daq.grpc_link import _Deadline
from daq.instrument import EdgeTrigger
from rig.errors import RigError
from rig.registers import Action, CommandCode, Interlock, State, float32
from rig.tester.driver import Tester
from rig.tester.driver import connect as connect_tester
from rig.tester.wire import ATTEMPTS
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.daq_server import start_daq_server
from simlab.tester_device import DeviceLimits
from simlab.tester_server import TICK, start_tester_server
from tests.channels import HAMMER_CHANNELS, TESTER_CHANNELS
from tests.fault_proxy import FaultProxy, Impairment, Way

WATCHDOG_TIME = 0.5  # s
RECORD = 0.1  # s of bench time
SAMPLE_RATE = 5120.0  # Hz
SPEED = 100.0
PATIENCE = 5.0  # s, with what is done on a sound line
SCHEDULING = 0.25  # s that a busy computer may take to look at what the watchdog did


def impairments(timeout: float, chance: random.Random) -> dict[str, Impairment]:
    """One of each kind of fault, for a wire with that timeout; some last, some affect a few pieces only."""
    pieces = chance.choice((0, 1, 2, 3))
    faults = {
        "latency": Impairment(latency=chance.uniform(0.05, 0.4) * timeout),
        "jitter": Impairment(latency=0.1 * timeout, jitter=0.5 * timeout),
        "too late": Impairment(latency=chance.uniform(0.6, 2.0) * timeout),
        "black hole": Impairment(lost=Way.BOTH),
        "lost replies": Impairment(lost=Way.REPLIES),
        "reset on request": Impairment(reset=Way.REQUESTS),
        "reset on reply": Impairment(reset=Way.REPLIES),
        "slices": Impairment(slices=chance.randint(1, 7)),
        "slices, late": Impairment(slices=1, latency=chance.uniform(0.1, 0.6) * timeout),
        "bit flip in request": Impairment(flipped=Way.REQUESTS),
        "bit flip in reply": Impairment(flipped=Way.REPLIES),
    }
    return {kind: replace(fault, pieces=pieces) for kind, fault in faults.items()}


@dataclass
class Findings:
    """What became of the calls, by kind of fault; and whatever must not be."""

    bound: float  # s, for a call
    outcomes: Counter[tuple[str, str]] = field(default_factory=Counter)
    worst: dict[str, float] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)

    def note(self, kind: str, call: str, outcome: str, took: float) -> None:
        """One call that came to an end."""
        self.outcomes[kind, outcome] += 1
        self.worst[kind] = max(took, self.worst.get(kind, 0.0))
        if took > self.bound:
            self.wrong.append(f"{kind}: {call} took {took:.2f} s, more than {self.bound:.2f} s")

    def show(self, title: str) -> None:
        """Print the table."""
        columns = sorted({outcome for _, outcome in self.outcomes})
        print(f"{title}: {sum(self.outcomes.values())} faults, a call is bound to {self.bound:.2f} s")
        print(f"  {'fault':<22}" + "".join(f"{column:>18}" for column in columns) + f"{'worst call, s':>16}")
        for kind in sorted({kind for kind, _ in self.outcomes}):
            counts = "".join(f"{self.outcomes[kind, column]:>18}" for column in columns)
            print(f"  {kind:<22}{counts}{self.worst[kind]:>16.3f}")
        print(f"  what must not be: {len(self.wrong)}", *self.wrong, sep="\n    ", flush=True)


def insist(work: Callable[[], None]) -> None:
    """Do what is done on a sound line, again where the computer was too busy to answer within a short timeout.

    Raises:
        RigError, DaqError: it does not succeed for `PATIENCE` s, so the line is not sound.
    """
    end = time.monotonic() + PATIENCE
    while True:
        try:
            work()
            return
        except (RigError, DaqError):
            if time.monotonic() > end:
                raise


class ModbusFaults:
    """Faults on the wire of a tester that cycles."""

    def __init__(self, seed: int, timeout: float = 0.1) -> None:
        self.findings = Findings(bound=timeout * ATTEMPTS + 0.5)
        self._timeout = timeout
        self._chance = random.Random(seed)
        bench = ordinary_bench(seed, Clock(SPEED))
        bench.mount("I", "shear")
        self._server = start_tester_server(bench, limits=DeviceLimits(watchdog_time=WATCHDOG_TIME))
        self._proxy = FaultProxy(self._server.url.removeprefix("tcp://"), seed)

    def run(self, faults: int) -> Findings:
        """Play `faults` faults, each kind as often as the others."""
        device = self._server.device
        kinds = list(impairments(self._timeout, self._chance))
        try:
            with connect_tester(f"tcp://{self._proxy.address}", timeout=self._timeout) as driver:
                for number in range(faults):
                    insist(lambda: _set_cycling(driver))
                    before = len(device.applied)
                    kind = kinds[number % len(kinds)]
                    self._fault(driver, kind, lasting=number % (2 * len(kinds)) < len(kinds))
                    self._proxy.repair()
                    self._recover(driver, kind)
                    applied = Counter(device.applied[before:])
                    twice = [code.name for code in (CommandCode.CYCLE, CommandCode.DETECTOR) if applied[code] > 1]
                    if twice:
                        self.findings.wrong.append(f"{kind}: {', '.join(twice)} applied twice")
        finally:
            self._proxy.stop()
            self._server.stop()
        return self.findings

    def _fault(self, driver: Tester, kind: str, *, lasting: bool) -> None:
        amplitude_pp, frequency = self._chance.uniform(1e-5, 1e-4), self._chance.uniform(10.0, 100.0)
        limit = self._chance.uniform(3e3, 5e3)
        calls: dict[str, Callable[[], object]] = {
            "status": driver.status,
            "cycle": lambda: driver.cycle(amplitude_pp, frequency),
            "detector": lambda: driver.set_detector(Interlock.FORCE, limit, Action.HYDRAULIC_INTERLOCK),
            "stop": driver.stop,
        }
        name = self._chance.choice(list(calls))
        self._proxy.impair(impairments(self._timeout, self._chance)[kind])
        began = time.monotonic()
        try:
            answer = calls[name]()
        except RigError:
            outcome = "error in words"
        else:
            outcome = "done"
        self.findings.note(kind, name, outcome, time.monotonic() - began)
        if outcome == "done":
            self._check(kind, name, answer, amplitude_pp, frequency, limit)
        if kind == "black hole" and lasting:
            self._check_that_the_watchdog_acts()

    def _check(self, kind: str, name: str, answer: object, amplitude_pp: float, frequency: float, limit: float) -> None:
        device = self._server.device
        status, detectors = device.status(), device.detectors()
        right = {
            "status": lambda: all(
                getattr(answer, ours) == _as_sent(status[theirs])
                for ours, theirs in (("sequence", "sequence"), ("preset", "preset"), ("amplitude_pp", "amplitude"))
            ),
            "cycle": lambda: (status["amplitude"], status["frequency"]) == (float32(amplitude_pp), float32(frequency)),
            "detector": lambda: detectors["force_limit"] == float32(limit),
            "stop": lambda: status["amplitude"] == 0.0,
        }[name]()
        if not right and status["state"] != State.TRIPPED:
            self.findings.wrong.append(f"{kind}: {name} was done, but {answer} against {status}")

    def _check_that_the_watchdog_acts(self) -> None:
        self._proxy.impair(Impairment(lost=Way.BOTH))
        time.sleep(WATCHDOG_TIME + TICK + SCHEDULING)
        if self._server.actuator.steady_pp() > 0.0:
            self.findings.wrong.append("black hole: still cycling after the watchdog time")

    def _recover(self, driver: Tester, kind: str) -> None:
        """The line is repaired: what was on its way arrives, and the next run begins."""
        time.sleep(2 * self._timeout if kind == "too late" else 0.0)
        try:
            insist(lambda: _reset(driver))
        except RigError as error:
            self.findings.wrong.append(f"{kind}: not usable after mending: {error}")


def _set_cycling(driver: Tester) -> None:
    driver.start()
    driver.preset(5e-4)
    driver.cycle(5e-5, 50.0)


def _reset(driver: Tester) -> None:
    if driver.status().interlocks:
        driver.reset()


def _as_sent(value: object) -> object:
    return float32(value) if isinstance(value, float) else value


class DaqFaults:
    """Faults on the wire of a chassis."""

    def __init__(self, seed: int, timeout: float = 0.3) -> None:
        self.findings = Findings(bound=2 * timeout + RECORD + 0.5)  # a reading waits for its record, then answers
        self._timeout = timeout
        self._chance = random.Random(seed)
        self._bench = ordinary_bench(seed, Clock(SPEED))
        self._tester = start_tester_server(self._bench)  # so that there is an actuator to measure
        self._server = start_daq_server(self._bench)
        self._proxy = FaultProxy(self._server.address.removeprefix("grpc://"), seed)
        with connect_daq(self._server.address) as chassis:
            self._devices = chassis.devices
            self._sound = {call: self._block(chassis, call) for call in ("record", "blow")}

    def run(self, faults: int) -> Findings:
        """Play `faults` faults, each kind and each call as often as the others."""
        kinds = list(impairments(self._timeout, self._chance))
        try:
            for number in range(faults):
                self._fault(kinds[number % len(kinds)], ("connect", "open", "record", "blow")[number % 4])
        finally:
            self._proxy.stop()
            self._server.stop()
            self._tester.stop()
        return self.findings

    def _next(self, kind: str) -> None:
        with self._connect() as chassis:
            self._check(kind, "next record", self._block(chassis, "record"))

    def _connect(self) -> Chassis:
        return connect_daq(f"grpc://{self._proxy.address}", self._timeout)

    def _fault(self, kind: str, call: str) -> None:
        """Let `call` go wrong, with everything before it on a sound line."""
        impairment = impairments(self._timeout, self._chance)[kind]
        outcome = "done"
        with timed_calls() as times:
            try:
                if call == "connect":
                    self._proxy.impair(impairment)
                with self._connect() as chassis:
                    if call == "connect" and chassis.devices != self._devices:
                        self.findings.wrong.append(f"{kind}: {chassis.devices} for {self._devices}")
                    if call == "open":
                        self._proxy.impair(impairment)
                    block = self._block(chassis, "blow" if call == "blow" else "record", impairment, call)
                    self._check(kind, call, block)
            except DaqError:
                outcome = "error in words"
        self.findings.note(kind, call, outcome, max(times, default=0.0))
        self._proxy.repair()
        try:
            insist(lambda: self._next(kind))
        except DaqError as error:
            self.findings.wrong.append(f"{kind}: not usable after mending: {error}")

    def _block(self, chassis: Chassis, what: str, impairment: Impairment | None = None, call: str = "") -> Block:
        """A record or a blow; from here on with `impairment`, where that is the `call` meant."""
        if what == "record":
            with chassis.record(TESTER_CHANNELS, SAMPLE_RATE, RECORD) as recorder:
                if impairment is not None and call == "record":
                    self._proxy.impair(impairment)
                return recorder.record(timeout=self._timeout)
        trigger = EdgeTrigger("hammer", 5.0, 0.01)
        with chassis.triggered(HAMMER_CHANNELS, SAMPLE_RATE, RECORD, trigger) as task:
            if impairment is not None and call == "blow":
                self._proxy.impair(impairment)
            task.arm()
            self._bench.strike(5, "y")
            return task.wait(self._timeout)

    def _check(self, kind: str, call: str, block: Block) -> None:
        """What was accepted has to be what the converters gave, and what it is scaled by the truth."""
        sound = self._sound["blow" if call == "blow" else "record"]
        for name in ("scaling", "sample_rate", "trigger_index", "channels"):
            if getattr(block, name) != getattr(sound, name):
                self.findings.wrong.append(f"{kind}: {call}: {name} {getattr(block, name)}")
        if not any(np.array_equal(block.counts, given) for given in tuple(self._server.given)):
            self.findings.wrong.append(f"{kind}: {call}: counts that the converters did not give")


@contextmanager
def timed_calls() -> Iterator[list[float]]:
    """How long each call on the DAQ wire took, s, while the context lasts."""
    times: list[float] = []
    original = _Deadline.intercept_unary_unary

    def timed(self: _Deadline, continuation: Callable[[Any, Any], Any], details: Any, request: Any) -> Any:
        began = time.monotonic()
        try:
            return original(self, continuation, details, request)
        finally:
            times.append(time.monotonic() - began)

    with patch.object(_Deadline, "intercept_unary_unary", timed):
        yield times


def main() -> None:
    """500 faults on each wire."""
    ModbusFaults(seed=1).run(500).show("Modbus")
    DaqFaults(seed=2).run(500).show("DAQ")
