"""Simulated testers that do wrong: disobey what they acknowledge, freeze, lie within their checksum, or answer badly.

A mutation of the device sits between its wire and its physics, a mutation of the line on the way of each reply. Each
has no effect until it is set, so that a sweep begins on a sound tester. The physics tell when the actuator is at rest.
"""

import random
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from typing import cast

from rig.registers import CYCLES_REPORTED, STATUS, CommandCode, Interlock, State, Value
from simlab.actuator import Actuator
from simlab.bench import SimulatedBench
from simlab.tester_device import REST_WITHIN, DeviceLimits, TesterDevice
from simlab.tester_server import TesterServer

Lie = Callable[[dict[str, Value]], dict[str, Value]]
"""Makes what is reported of the true values of STATUS."""


@dataclass(frozen=True)
class Mutation:
    """What a device does wrong; nothing by default.

    Attributes:
        disobeys: commands that it acknowledges and reports as applied, without doing them.
        pretends: whether it then reports the state and the values in force as if it had done them.
        stopping_time: time constant of its stop under pressure, s; None for the ordinary one.
        runs_away: whether a hold makes it travel to the end of its range.
        coil_is_dead: whether it acknowledges the coil of the emergency stop, and does nothing.
        gain: by which it overshoots or falls short of what is commanded, from the next command on.
        frozen: whether STATUS stays as it was when this mutation was set.
        lie: what is reported in place of the true values.
    """

    disobeys: frozenset[CommandCode] = frozenset()
    pretends: bool = False
    stopping_time: float | None = None
    runs_away: bool = False
    coil_is_dead: bool = False
    gain: float = 1.0
    frozen: bool = False
    lie: Lie = field(default=lambda values: values)


SOUND = Mutation()


class MutatedDevice(TesterDevice):
    """A tester's controller with a mutation, which `mutate` sets."""

    def __init__(self, actuator: Actuator, now: Callable[[], float], limits: DeviceLimits | None) -> None:
        super().__init__(actuator, now, limits)
        self._bench_time = now
        self._mutation = SOUND
        self._at_mutation: dict[str, Value] = {}
        self._disobeyed = False
        self._servo = actuator.servo

    def mutate(self, mutation: Mutation) -> None:
        """Do wrong from now on."""
        with self._lock:
            self._at_mutation = super().status()
            self._mutation = mutation
            self._actuator.servo_gain = mutation.gain
            if mutation.stopping_time is not None:
                self._actuator.servo = replace(self._actuator.servo, stopping_time=mutation.stopping_time)

    def status(self) -> dict[str, Value]:
        """Values of the STATUS block, true or not."""
        with self._lock:
            if self._mutation.frozen:
                return self._at_mutation
            values = super().status()
            if self._disobeyed and self._mutation.pretends:
                values |= {"amplitude": 0.0, "frequency": 0.0}
                values |= {
                    "state": State.HYDRAULICS_OFF if values["command"] == CommandCode.HYDRAULICS_OFF else State.HELD
                }
            return self._mutation.lie(values)

    def emergency_stop(self, *, latched: bool = True) -> None:
        """Stop now, unless the coil is dead; the mushroom button never is."""
        if latched or not self._mutation.coil_is_dead:
            super().emergency_stop(latched=latched)

    def rests(self) -> bool:
        """Whether the actuator is at rest by its physics: it does not cycle, and nothing drives its mean position."""
        with self._lock:
            now = self._bench_time()
            driven = self._hydraulics and self._actuator.is_ramping(now)
            return self._actuator.amplitude_pp(now) <= REST_WITHIN and not driven

    def _switch_off(self) -> None:
        """Without pressure nothing is left of what the controller does wrong."""
        self._actuator.servo = self._servo
        super()._switch_off()

    def _apply(self, command: CommandCode, values: Mapping[str, Value]) -> None:
        if command in self._mutation.disobeys:
            self.applied.append(command)
            self._disobeyed = True
        elif command is CommandCode.HOLD and self._mutation.runs_away:
            self.applied.append(command)
            self._rest()
            self._actuator.move(self._limits.upper_displacement_limit)
        else:
            super()._apply(command, values)


def start_mutated_tester(
    bench: SimulatedBench, limits: DeviceLimits | None = None
) -> tuple[MutatedDevice, TesterServer]:
    """Serve a tester on a loopback port that is sound until it is mutated."""
    actuator = Actuator(bench, bench.clock.now, bench.seed)
    bench.attach_actuator(actuator)
    device = MutatedDevice(actuator, bench.clock.now, limits)
    return device, TesterServer(device, actuator, rtu=False, port=0)


Answer = Callable[[bytes, bytes], Iterator[bytes]]
"""Makes the pieces that a client gets of its request and the tester's reply, both whole Modbus TCP frames."""


def _as_it_is(_request: bytes, reply: bytes) -> Iterator[bytes]:
    yield reply


class AnsweringProxy:
    """A line to `url` that passes requests on and answers them with what `answer` makes of the replies.

    Attributes:
        answer: for every reply from now on.
        url: for clients to connect to instead.
    """

    def __init__(self, url: str) -> None:
        host, _, port = url.removeprefix("tcp://").rpartition(":")
        self.answer: Answer = _as_it_is
        self._target = (host, int(port))
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"tcp://127.0.0.1:{self._listener.getsockname()[1]}"
        threading.Thread(target=self._accept, daemon=True).start()

    def stop(self) -> None:
        """Take no further connection."""
        self._listener.close()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                connection, _ = self._listener.accept()
                threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, near: socket.socket) -> None:
        with suppress(OSError), near, socket.create_connection(self._target) as far:
            near.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            while request := _frame(near):
                far.sendall(request)
                for piece in self.answer(request, _frame(far)):
                    near.sendall(piece)


def _frame(line: socket.socket) -> bytes:
    """The next whole Modbus TCP frame; empty where the line was closed."""
    header = line.recv(6, socket.MSG_WAITALL)
    return header + line.recv(int.from_bytes(header[4:6]), socket.MSG_WAITALL) if len(header) == 6 else b""


def echo(request: bytes, _reply: bytes) -> Iterator[bytes]:
    """The request in place of its reply."""
    yield request


def other(transaction: int = 0, unit: int = 0, function: int = 0) -> Answer:
    """The reply, to another transaction, unit or function: each is off by so much."""

    def answer(_request: bytes, reply: bytes) -> Iterator[bytes]:
        number, rest, there, code = struct.unpack(">HIBB", reply[:8])
        yield (
            struct.pack(
                ">HIBB", (number + transaction) % 0x10000, rest, (there + unit) % 0x100, (code + function) % 0x100
            )
            + reply[8:]
        )

    return answer


def late(seconds: float) -> Answer:
    """The reply, after so long."""

    def answer(_request: bytes, reply: bytes) -> Iterator[bytes]:
        time.sleep(seconds)
        yield reply

    return answer


def trickling(pause: float) -> Answer:
    """The reply, byte by byte, with a pause in s before each."""

    def answer(_request: bytes, reply: bytes) -> Iterator[bytes]:
        for byte in reply:
            time.sleep(pause)
            yield bytes([byte])

    return answer


def never(_request: bytes, _reply: bytes) -> Iterator[bytes]:
    """No reply, on a connection that stays open."""
    yield from ()


def stale() -> Answer:
    """To each kind of request the first reply there was to it, as if it were the one to this request."""
    first: dict[bytes, bytes] = {}

    def answer(request: bytes, reply: bytes) -> Iterator[bytes]:
        yield request[:2] + first.setdefault(request[6:12], reply)[2:]

    return answer


def sometimes(chance: random.Random, share: float, answer: Answer) -> Answer:
    """`answer` to such a share of the requests, and the right reply to the others."""

    def either(request: bytes, reply: bytes) -> Iterator[bytes]:
        yield from (answer if chance.random() < share else _as_it_is)(request, reply)

    return either


def says(**values: Value) -> Lie:
    """Report these values in place of the true ones."""
    return lambda true: true | values


def says_rest(true: dict[str, Value]) -> dict[str, Value]:
    """Report rest at the preset, and what is measured as it is."""
    return true | {"state": State.HELD, "amplitude": 0.0, "frequency": 0.0}


def rests_in_every_value(true: dict[str, Value]) -> dict[str, Value]:
    """From a stop that it pretends to obey on, report neither cycles nor force."""
    if true["amplitude"]:
        return true
    return true | {"cycles": 0, "force_pp": 0.0, "displacement_pp": (0.0,) * CYCLES_REPORTED}


LIAR = Mutation(
    disobeys=frozenset({CommandCode.HOLD, CommandCode.HYDRAULICS_OFF}), pretends=True, lie=rests_in_every_value
)
"""Cycles on at a stop, and lies in everything."""


def frozen_values(*names: str) -> Lie:
    """Report these values as they were first."""
    first: dict[str, Value] = {}

    def lie(true: dict[str, Value]) -> dict[str, Value]:
        for name in names:
            first.setdefault(name, true[name])
        return true | first

    return lie


def scaled(factor: float, *names: str) -> Lie:
    """Report these values times `factor`."""

    def times(value: Value) -> Value:
        if isinstance(value, tuple):
            return tuple(factor * each for each in value)
        return factor * cast(float, value)

    return lambda true: true | {name: times(true[name]) for name in names}


IMPOSSIBLE: Mapping[str, Value] = {
    "state": 9,
    "interlocks": 0xFFFF,
    "stopped_by": 0x0100,
    "refusal": 77,
    "command": 8,
    "preset": 1.0,
    "amplitude": -1e-4,
    "frequency": float("nan"),
    "displacement_mean": 0.3,
    "force_mean": -50e3,
    "force_pp": float("inf"),
    "displacement_pp": (1.0,) * 16,
}
"""A value of each register of STATUS that the map does not allow."""
assert set(IMPOSSIBLE) <= {register.name for register in STATUS.registers}
assert not set(Interlock) & {Interlock(0x0100)}


@contextmanager
def mutated_tester(
    bench: SimulatedBench, limits: DeviceLimits | None = None
) -> Iterator[tuple[MutatedDevice, AnsweringProxy]]:
    """A tester behind an answering line, both sound until they are told otherwise."""
    device, server = start_mutated_tester(bench, limits)
    proxy = AnsweringProxy(server.url)
    try:
        yield device, proxy
    finally:
        proxy.stop()
        server.stop()
