"""The whole simulated laboratory: one bench, three instruments in front of it, and an operator who works it.

It runs in this process (`Laboratory`) or, as a real laboratory would, outside it (`LaboratoryProcess`); then nothing
but wires connects it to the program that measures.
"""

import json
import subprocess
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from typing import Any, Self

from simlab.bench import case_bench, ordinary_bench
from simlab.case.draw import Case
from simlab.clock import Clock
from simlab.daq_server import start_daq_server
from simlab.external_program import ExternalProgram
from simlab.operator_server import OperatorClient, OperatorServer
from simlab.ordinary import BenchConditions
from simlab.plc_tester import start_plc_tester
from simlab.tester_device import REST_WITHIN
from simlab.tester_server import start_tester_server
from simlab.thermometer_server import start_thermometer_server

STOP_TIMEOUT = 10.0  # s


@dataclass(frozen=True)
class Addresses:
    """Where each instrument answers, in the words that drivers are configured with.

    Attributes:
        daq: ``grpc://host:port``.
        tester: ``tcp://host:port``.
        thermometer: pyserial URL.
        operator: ``host:port`` of the line to the operator.
    """

    daq: str
    tester: str
    thermometer: str
    operator: str


class Laboratory:
    """Bench, instruments and operator, running until the context is left.

    Args:
        seed, conditions: of the bench; a case brings its own.
        speed: bench time over wall time.
        ports: of instruments by name, in place of what the operating system picks.
        case: a drawn case in place of the ordinary bench.
        other_tester: whether the tester is that of `simlab/plc_tester.py`, with other registers.

    Attributes:
        addresses: where to connect.
        daq, tester, thermometer: the instruments; their `.faults` make them fail.
        program: drives the tester's actuator by itself, where nothing else does; it has faults, too.
    """

    def __init__(
        self,
        seed: int = 1,
        speed: float = 1.0,
        conditions: BenchConditions | None = None,
        *,
        ports: dict[str, int] | None = None,
        case: Case | None = None,
        other_tester: bool = False,
    ) -> None:
        ports = ports or {}
        self._stack = ExitStack()
        clock = Clock(speed)
        self.bench = ordinary_bench(seed, clock, conditions) if case is None else case_bench(case, clock)
        try:
            self.daq = start_daq_server(self.bench, f"127.0.0.1:{ports.get('daq', 0)}")
            self._stack.callback(self.daq.stop)
            start_tester = start_plc_tester if other_tester else start_tester_server
            self.tester = start_tester(self.bench, port=ports.get("tester", 0))
            self._stack.callback(self.tester.stop)
            self.program = ExternalProgram(self.tester.actuator, clock, seed)
            self._stack.callback(self.program.rest)
            self.thermometer = start_thermometer_server(self.bench, port=ports.get("thermometer", 0))
            self._stack.callback(self.thermometer.stop)
            self.operator = OperatorServer(self._actions(), port=ports.get("operator", 0))
            self._stack.callback(self.operator.stop)
        except BaseException:
            self._stack.close()
            raise
        self.addresses = Addresses(self.daq.address, self.tester.url, self.thermometer.url, self.operator.address)

    def _actions(self) -> dict[str, Any]:
        bench = self.bench
        offered = (
            bench.strike,
            bench.mount,
            bench.truth,
            bench.set_up,
            bench.drawing,
            bench.commitment,
            bench.open_seal,
        )
        return {method.__name__: method for method in offered} | {
            "dwells": lambda: [asdict(dwell) for dwell in self.tester.actuator.log],
            "motion": self._motion,
            "run_points": self.program.run,
            "rest": self.program.rest,
        }

    def _motion(self) -> dict[str, float | None]:
        """When the actuator comes to rest by its physics (`time.monotonic`; None: it cycles), and `longest_unheard`."""
        rest = self.tester.actuator.rests_since(REST_WITHIN)
        since = None if rest is None else self.bench.clock.monotonic(rest)
        return {"rests_since": since, "longest_unheard": self.tester.device.longest_unheard}

    def stop(self) -> None:
        """Stop every instrument."""
        self._stack.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.stop()


class LaboratoryProcess:
    """The laboratory in a process of its own, which ends with the context or with this process.

    Args:
        seed: of the bench, or of the case.
        speed: bench time over wall time.
        kind: of a drawn case, one of `CaseKind`; None is the ordinary bench.
        effects: of the case by name, in place of drawn ones.

    Attributes:
        addresses, operator: where to connect, and the line to who works the bench.
        process: its number.

    Raises:
        RuntimeError: it did not start; what it said is in the message.
    """

    def __init__(
        self, seed: int = 1, speed: float = 1.0, *, kind: str | None = None, effects: Sequence[str] = ()
    ) -> None:
        command = [sys.executable, "-m", "simlab", "--seed", str(seed), "--speed", str(speed)]
        if kind is not None:
            command += ["--case", kind, *(f"--effect={name}" for name in effects)]
        # a session of its own: Ctrl-C is for the program that measures, and instruments outlast it to be left at rest
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
        )
        self.process = self._process.pid
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            with self._process:
                raise RuntimeError(f"the simulated laboratory ended with exit code {self._process.wait()}")
        self.addresses = Addresses(**json.loads(line))
        self.operator = OperatorClient(self.addresses.operator)

    def stop(self) -> None:
        """Hang up and wait until the process has ended."""
        self.operator.close()
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        try:
            self._process.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.stop()
