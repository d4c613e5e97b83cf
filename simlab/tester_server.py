"""The simulated tester on its wire: Modbus TCP, or Modbus RTU on a pseudo-terminal, served by pymodbus.

What the instrument does is in `simlab.tester_device`; here its blocks are put on the wire, its refusals are made Modbus
exceptions, and faults of the wire are played.
"""

from __future__ import annotations

import asyncio
import logging
import os
import struct
import sys
import threading
import tty
from collections.abc import Coroutine, Sequence
from contextlib import suppress
from enum import StrEnum
from typing import cast

from pymodbus.constants import ExcCodes
from pymodbus.framer import FramerType
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from rig.registers import (
    BLOCKS,
    COMMAND,
    DETECTORS,
    EMERGENCY_STOP_COIL,
    IDENTITY,
    MAP_VERSION,
    STATUS,
    Action,
    CommandCode,
    Kind,
    Refusal,
    RegisterBlock,
    Units,
    Value,
)
from simlab.actuator import Actuator
from simlab.bench import SimulatedBench
from simlab.faults import Faults, Script
from simlab.tester_device import DeviceLimits, TesterDevice

DEVICE_ID = 1
BAUD_RATE = 115_200
TICK = 0.01  # s on the wall, between two looks at detectors and watchdog
FIRST = 2  # real-time priority of the simulated tester, above that of the program that drives it

_EXCEPTIONS = {
    Refusal.BUSY: ExcCodes.DEVICE_BUSY,
    Refusal.FAULT: ExcCodes.DEVICE_FAILURE,
    Refusal.TRIPPED: ExcCodes.DEVICE_FAILURE,
    Refusal.HYDRAULICS_ARE_OFF: ExcCodes.DEVICE_FAILURE,
    Refusal.NOT_AT_PRESET: ExcCodes.DEVICE_FAILURE,
    Refusal.CAUSE_STILL_PRESENT: ExcCodes.DEVICE_FAILURE,
}  # every other refusal is an illegal value
_COMMAND_HEADER = struct.pack(">BH", 16, COMMAND.address)
_READ_INPUT, _WRITE_COIL, _WRITE_HOLDING = 4, 5, 16


Written = list[int] | list[bool] | None


class TesterFault(StrEnum):
    """What can be wrong with the tester or its wire."""

    REFUSE = "refuse"  # every command is answered with a device failure
    BUSY = "busy"  # every command is answered with device busy
    WRONG_MAP_VERSION = "wrong_map_version"
    WRONG_UNITS = "wrong_units"
    NO_WATCHDOG = "no_watchdog"
    NO_LIMITS = "no_limits"
    DEAD_WATCHDOG = "dead_watchdog"  # it has a time, and never trips
    DEAD_EMERGENCY_STOP = "dead_emergency_stop"  # its coil is written, and nothing happens
    MILD_DETECTOR = "mild_detector"  # the force detector only indicates
    LOST_REPLY = "lost_reply"  # a command is applied and its reply does not arrive
    FLIPPED_COMMAND = "flipped_command"  # one bit of a command changes on the way
    FLIPPED_STATUS = "flipped_status"  # one bit of a status reply changes on the way
    SILENT = "silent"  # nothing is answered any more
    CUT = "cut"  # nothing arrives any more either
    DROP = "drop"  # the connection is closed on a request
    WEAK_SERVO = "weak_servo"  # the actuator reaches a third of what is commanded
    RUNAWAY_SERVO = "runaway_servo"  # the actuator reaches three times what is commanded


class TesterServer:
    """A running tester. `url` is what a driver connects to, ``tcp://host:port`` or ``rtu:///dev/pts/N?baudrate=N``.

    Attributes:
        faults: set by tests.
        script: refusals and Modbus exceptions in place of its own answers, by step: the name of a block that is read
            or written, of a command, or EMERGENCY_STOP.
    """

    known_faults: Sequence[StrEnum] = tuple(TesterFault)

    def __init__(self, device: TesterDevice, actuator: Actuator, rtu: bool, port: int) -> None:
        self.device = device
        self.actuator = actuator
        self.faults = Faults(self.known_faults)
        self.script = Script[Refusal | ExcCodes]()
        self.url = ""
        self._server: ModbusTcpServer | ModbusSerialServer | None = None
        self._lose_reply = False
        self._started = threading.Event()
        self._stopping = threading.Event()
        self._failure: BaseException | None = None
        serve = self._serve_rtu() if rtu else self._serve_tcp(port)
        self._thread = threading.Thread(target=self._run, args=(serve,), name="tester", daemon=True)
        self._thread.start()
        self._started.wait()
        if self._failure is not None:
            raise RuntimeError(f"the simulated tester did not start: {self._failure}") from self._failure

    def emergency_stop(self) -> None:
        """Press the mushroom button."""
        self.device.emergency_stop()

    def release_emergency_stop(self) -> None:
        """Release the mushroom button."""
        self.device.release_emergency_stop()

    def stop(self) -> None:
        """Close the wire and end the thread."""
        self._stopping.set()
        self._thread.join()

    def _run(self, serve: Coroutine[None, None, None]) -> None:
        _come_first()
        try:
            asyncio.run(serve)
        except Exception as error:
            if self._started.is_set():
                raise
            self._failure = error
        finally:
            self._started.set()

    async def _serve_tcp(self, port: int) -> None:
        server = ModbusTcpServer(
            self._sim_device(), address=("127.0.0.1", port), trace_packet=self._trace, ignore_missing_devices=True
        )
        await server.serve_forever(background=True)
        listener = cast(asyncio.Server, server.transport)
        self.url = f"tcp://127.0.0.1:{listener.sockets[0].getsockname()[1]}"
        await self._serve(server)

    async def _serve_rtu(self) -> None:
        with PtyLine(asyncio.get_running_loop()) as line:
            server = ModbusSerialServer(
                self._sim_device(),
                framer=FramerType.RTU,
                port=line.instrument,
                baudrate=BAUD_RATE,
                trace_packet=self._trace,
                ignore_missing_devices=True,
            )
            await server.serve_forever(background=True)
            self.url = f"rtu://{line.client}?baudrate={BAUD_RATE}"
            await self._serve(server)

    async def _serve(self, server: ModbusTcpServer | ModbusSerialServer) -> None:
        self._server = server
        self._started.set()
        while not self._stopping.is_set():
            self._keep_watch()
            self.device.tick()
            await asyncio.sleep(TICK)
        await server.shutdown()  # type: ignore[no-untyped-call]  # pymodbus leaves it without types
        await asyncio.sleep(0)  # let the closed transports say so

    def _keep_watch(self) -> None:
        """Let the watchdog work, or not."""
        self.device.watchdog_works = not self.faults.take(TesterFault.DEAD_WATCHDOG)

    def _sim_device(self) -> SimDevice:
        def registers(kind: Kind) -> list[SimData]:
            return [
                SimData(block.address, values=[0] * block.count, datatype=DataType.REGISTERS)
                for block in BLOCKS
                if block.kind is kind
            ]

        bits = [SimData(EMERGENCY_STOP_COIL, values=[False] * 16, datatype=DataType.BITS)]
        tables = (bits, list(bits), registers(Kind.HOLDING), registers(Kind.INPUT))
        return SimDevice(DEVICE_ID, simdata=tables, action=self._access)

    async def _access(
        self, function: int, start: int, address: int, count: int, registers: list[int], values: Written
    ) -> ExcCodes | None:
        """Answer one request: pymodbus calls this before it reads or writes its own copy of the registers."""
        if function == _READ_INPUT:
            block = next(block for block in (STATUS, DETECTORS, IDENTITY) if address >= block.address)
            answer = self.script.take(block.name)
            if isinstance(answer, ExcCodes):
                return answer
            offset = block.address - start
            registers[offset : offset + block.count] = self._read(block)
            return None
        if values is None:
            return None
        if function == _WRITE_COIL:
            answer = self.script.take("EMERGENCY_STOP")
            if isinstance(answer, ExcCodes):
                return answer
            if address != EMERGENCY_STOP_COIL or not values[0]:
                return ExcCodes.ILLEGAL_VALUE
            if not self.faults.take(TesterFault.DEAD_EMERGENCY_STOP):
                self.device.emergency_stop(latched=False)
            return None
        for block in BLOCKS:
            if function == _WRITE_HOLDING and block.writable and (address, count) == (block.address, block.count):
                return self._write(block, [int(word) for word in values])
        return ExcCodes.ILLEGAL_ADDRESS

    def _read(self, block: RegisterBlock) -> list[int]:
        self._keep_watch()
        self._set_servo()
        if block is STATUS:
            return self.device.read(block)
        values = self.device.identity() if block is IDENTITY else self.device.detectors()
        wrong: dict[str, Value] = {}
        if self.faults.take(TesterFault.WRONG_MAP_VERSION):
            wrong["map_version"] = MAP_VERSION + 1
        if self.faults.take(TesterFault.WRONG_UNITS):
            wrong["units"] = Units.MILLIMETRE_NEWTON
        if self.faults.take(TesterFault.NO_WATCHDOG):
            wrong["watchdog_time"] = 0.0
        if self.faults.take(TesterFault.NO_LIMITS):
            wrong["force_limit"] = wrong["velocity_limit"] = 0.0
        if self.faults.take(TesterFault.MILD_DETECTOR):
            wrong["force_action"] = Action.INDICATE
        return block.pack({name: wrong.get(name, value) for name, value in values.items()})

    def _write(self, block: RegisterBlock, words: list[int]) -> ExcCodes | None:
        answer = self.script.take(_command_name(words) if block is COMMAND else block.name)
        if isinstance(answer, ExcCodes):
            return answer
        if isinstance(answer, Refusal):
            self.device.refuse(answer)
            return exception_of(answer)
        if block is COMMAND:
            self._set_servo()
            if self.faults.take(TesterFault.REFUSE):
                return exception_of(Refusal.FAULT)
            if self.faults.take(TesterFault.BUSY):
                return exception_of(Refusal.BUSY)
            self._lose_reply = self.faults.take(TesterFault.LOST_REPLY)
        refusal = self.device.write(block, words)
        return None if refusal is Refusal.NONE else exception_of(refusal)

    def _set_servo(self) -> None:
        weak, strong = self.faults.take(TesterFault.WEAK_SERVO), self.faults.take(TesterFault.RUNAWAY_SERVO)
        self.actuator.servo_gain = 1 / 3 if weak else 3.0 if strong else 1.0

    def _trace(self, sending: bool, data: bytes) -> bytes:
        """Play the faults of the wire on the bytes that come in or go out."""
        if sending:
            if self._lose_reply:
                self._lose_reply = False
                return b""
            if self.faults.take(TesterFault.SILENT) or self.faults.take(TesterFault.CUT):
                return b""
            if len(data) > 2 * STATUS.count and self.faults.take(TesterFault.FLIPPED_STATUS):
                return _flipped(data, len(data) // 2)
            return data
        if data and self.faults.take(TesterFault.CUT):
            return b""
        if data and self.faults.take(TesterFault.DROP):
            self._disconnect()
            return b""
        if _COMMAND_HEADER in data and self.faults.take(TesterFault.FLIPPED_COMMAND):
            return _flipped(data, len(data) - 6)
        return data

    def _disconnect(self) -> None:
        if isinstance(self._server, ModbusTcpServer):  # a serial line has no connection; the request is lost
            for connection in list(self._server.active_connections.values()):
                cast(asyncio.Transport, connection.transport).abort()


class PtyLine:
    """A serial line between two pseudo-terminals, which an event loop connects while the context lasts.

    Attributes:
        client: path that a client opens, such as /dev/pts/3.
        instrument: path that the simulated instrument opens.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._near, self._near_end = os.openpty()
        self._far, self._far_end = os.openpty()
        self.client = os.ttyname(self._near_end)
        self.instrument = os.ttyname(self._far_end)

    def __enter__(self) -> PtyLine:
        for descriptor in (self._near, self._near_end, self._far, self._far_end):
            tty.setraw(descriptor)
        for descriptor in (self._near, self._far):
            os.set_blocking(descriptor, False)
        self._loop.add_reader(self._near, self._pass, self._near, self._far)
        self._loop.add_reader(self._far, self._pass, self._far, self._near)
        return self

    def __exit__(self, *_error: object) -> None:
        for descriptor in (self._near, self._far):
            self._loop.remove_reader(descriptor)
        # the near ends of both are kept open here too, so that a client may close and open again
        for descriptor in (self._near, self._near_end, self._far, self._far_end):
            os.close(descriptor)

    @staticmethod
    def _pass(source: int, sink: int) -> None:
        os.write(sink, os.read(source, 4096))


def exception_of(refusal: Refusal) -> ExcCodes:
    """The Modbus exception that tells a refusal."""
    return _EXCEPTIONS.get(refusal, ExcCodes.ILLEGAL_VALUE)


def _command_name(words: list[int]) -> str:
    """Name of the command that `words` ask for; empty where they ask for none that exists."""
    code = words[COMMAND.address_of("command") - COMMAND.address]
    return CommandCode(code).name if code in set(CommandCode) else ""


def _flipped(data: bytes, at: int) -> bytes:
    return data[:at] + bytes([data[at] ^ 0x10]) + data[at + 1 :]


def start_tester_server(
    bench: SimulatedBench, *, rtu: bool = False, port: int = 0, limits: DeviceLimits | None = None
) -> TesterServer:
    """Connect an actuator to the bench and serve the tester, on a loopback port or a pseudo-terminal.

    Args:
        bench: holds the specimen and the clock.
        rtu: Modbus RTU on a pseudo-terminal instead of Modbus TCP.
        port: TCP port; 0 lets the system pick one.
        limits: set at the instrument; None is its ordinary setting.

    Raises:
        RuntimeError: the port is taken.
    """
    # every failure is answered on the wire; pymodbus would log it a second time
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    actuator = Actuator(bench, bench.clock.now, bench.seed)
    bench.attach_actuator(actuator)
    return TesterServer(TesterDevice(actuator, bench.clock.now, limits), actuator, rtu, port)


def _come_first() -> None:
    """Let this thread come first where that is allowed: a real instrument has a processor of its own."""
    if sys.platform == "linux":
        with suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(FIRST))
