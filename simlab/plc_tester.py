"""A second simulated tester: the same machine behind a controller with another register map.

It is like many a programmable logic controller: all in holding registers, without checksums; words with flags; the low
word of 32-bit values first; millimetres, and counts of a hundredth of a hertz. A write of the control word carries out
what it says with the set values as they are then. Commands have no numbers, and the heartbeat is not shown.

    16  device type 5012        17  firmware 310        18  serial number, uint32
   256  control word: 0 off, 1 on, 2 hold, 3 go to the position, 5 cycle, 8 reset
   258  set position, int32, 10 nm      260  set amplitude, float32, mm zero to peak      262  set frequency, 0.01 Hz
   270  life counter of the client
   512  status word: bit 0 pressure, 1 in motion to the position, 2 in position, 3 cycling, 4 steady, 7 tripped
   513  alarm word: bit 0 emergency stop, 1 watchdog, 2 upper and 3 lower position, 4 force, 5 overshoot, 6 underpeak
   514  mean position, int32, 10 nm     516  last cycle, float32, mm peak to peak         518  cycles, uint32
   520  mean force, int16, N            521  last cycle's force, uint16, N peak to peak
   524  amplitude in force, float32, mm zero to peak        526  frequency in force, 0.01 Hz
  coil 3  emergency stop
"""

from __future__ import annotations

import asyncio
import logging
import struct
from enum import StrEnum
from typing import cast

from pymodbus.constants import ExcCodes
from pymodbus.simulator import DataType, SimData, SimDevice

from rig.registers import COMMAND, HEARTBEAT, CommandCode, Interlock, Refusal, State, Value
from simlab.actuator import Actuator
from simlab.bench import SimulatedBench
from simlab.tester_device import DeviceLimits, TesterDevice
from simlab.tester_server import DEVICE_ID, TesterFault, TesterServer, Written, exception_of

IDENTITY_AT, CONTROL_AT, SET_AT, LIFE_AT, STATUS_AT, STOP_COIL = 16, 256, 258, 270, 512, 3
REGISTERS, SET_VALUES = 600, 5
LATE = 0.4  # s
DEVICE_TYPE, FIRMWARE, SERIAL = 5012, 310, 70_001
CONTROL = {
    0: CommandCode.HYDRAULICS_OFF,
    1: CommandCode.HYDRAULICS_ON,
    2: CommandCode.HOLD,
    3: CommandCode.PRESET,
    5: CommandCode.CYCLE,
    8: CommandCode.RESET,
}
FLAGS = {
    State.HYDRAULICS_OFF: 0b0_0000,
    State.IDLE: 0b0_0001,
    State.RAMPING: 0b0_0011,
    State.HELD: 0b0_0101,
    State.CYCLING: 0b0_1001,
    State.SETTLED: 0b1_1001,
    State.TRIPPED: 0b1000_0000,
}
ALARMS = (
    Interlock.EMERGENCY_STOP,
    Interlock.WATCHDOG,
    Interlock.UPPER_DISPLACEMENT,
    Interlock.LOWER_DISPLACEMENT,
    Interlock.FORCE,
    Interlock.ERROR,
    Interlock.UNDERPEAK,
)
_READ_HOLDING, _WRITE_COIL, _WRITE_HOLDING = 3, 5, 16


class PlcFault(StrEnum):
    """What can be wrong with this controller besides those of `TesterFault` that it has."""

    IGNORE = "ignore"  # the control word is acknowledged, and nothing is done
    FREEZE = "freeze"  # the status stands still
    LATE = "late"  # the reply comes 0.4 s late
    STALE_ECHO = "stale_echo"  # set values are read back as they were
    STALE_IN_FORCE = "stale_in_force"  # amplitude and frequency in force are shown as they were
    OLD_SET = "old_set"  # set values of the command before arrive once more, ahead of the control word
    FLIPPED_SET = "flipped_set"  # a bit of a set value changes on the way
    NO_STATE = "no_state"  # a status word with flags that contradict each other
    OTHER_TYPE = "other_type"  # another device type


OF_THE_OTHER_MAP = (
    TesterFault.WRONG_MAP_VERSION,
    TesterFault.WRONG_UNITS,
    TesterFault.NO_WATCHDOG,
    TesterFault.NO_LIMITS,
    TesterFault.MILD_DETECTOR,
    TesterFault.FLIPPED_COMMAND,
    TesterFault.FLIPPED_STATUS,
)
"""Faults of registers that this controller does not have: it refuses to play them, as nothing would happen."""


class PlcTesterServer(TesterServer):
    """A running tester of this kind, which counts and stops as `TesterServer` does.

    Attributes:
        has_watchdog: whether it stops where the life counter stands still.
        in_force: peak-to-peak amplitude in m and frequency in Hz that it shows as being in force.
    """

    known_faults = (*(fault for fault in TesterFault if fault not in OF_THE_OTHER_MAP), *PlcFault)

    def __init__(self, device: TesterDevice, actuator: Actuator, rtu: bool, port: int, *, has_watchdog: bool) -> None:
        self.has_watchdog = has_watchdog
        self._number = 0
        self._registers = [0] * REGISTERS
        self._frozen: list[int] | None = None
        self.in_force: tuple[float, float] | None = None
        self._stale: list[int] | None = None
        self._carried_out = [0] * SET_VALUES
        super().__init__(device, actuator, rtu, port)

    def _keep_watch(self) -> None:
        dead = self.faults.take(TesterFault.DEAD_WATCHDOG)
        self.device.watchdog_works = self.has_watchdog and not dead

    def _sim_device(self) -> SimDevice:
        bits = [SimData(0, values=[False] * 16, datatype=DataType.BITS)]
        words = [SimData(0, values=[0] * REGISTERS, datatype=DataType.REGISTERS)]
        unused = [SimData(0, values=[0], datatype=DataType.REGISTERS)]
        return SimDevice(DEVICE_ID, simdata=(bits, list(bits), words, unused), action=self._access)

    async def _access(
        self, function: int, start: int, address: int, count: int, registers: list[int], values: Written
    ) -> ExcCodes | None:
        if self.faults.take(PlcFault.LATE):
            await asyncio.sleep(LATE)
        if function == _READ_HOLDING:
            self._keep_watch()
            self._set_servo()
            shown = self._shown()
            registers[address - start : address - start + count] = shown[address : address + count]
            return None
        if values is None:
            return None
        if function == _WRITE_COIL and address == STOP_COIL:
            if not self.faults.take(TesterFault.DEAD_EMERGENCY_STOP):
                self.device.emergency_stop(latched=False)
            return None
        if function != _WRITE_HOLDING or not (CONTROL_AT <= address <= LIFE_AT):
            return ExcCodes.ILLEGAL_ADDRESS
        return self.take(address, [int(word) for word in values])

    def take(self, address: int, words: list[int]) -> ExcCodes | None:
        """Take what is written to holding registers from `address`; the exception that answers it, if any."""
        if address == CONTROL_AT and self.faults.take(TesterFault.REFUSE):
            return ExcCodes.DEVICE_FAILURE
        if address == CONTROL_AT and self.faults.take(TesterFault.BUSY):
            return ExcCodes.DEVICE_BUSY
        if SET_AT <= address < LIFE_AT:
            stale = self.faults.take(PlcFault.STALE_ECHO)
            self._stale = (self._stale or list(self._registers)) if stale else None
        if SET_AT <= address < LIFE_AT and self.faults.take(PlcFault.FLIPPED_SET):
            words = [words[0] ^ 0x0400, *words[1:]]
        self._registers[address : address + len(words)] = words
        if address == LIFE_AT:
            self.device.write(HEARTBEAT, HEARTBEAT.pack({"heartbeat": words[0]}))
        if address != CONTROL_AT or self.faults.take(PlcFault.IGNORE):
            return None
        if self.faults.take(PlcFault.OLD_SET):
            self._registers[SET_AT : SET_AT + SET_VALUES] = self._carried_out
        self._carried_out = self._registers[SET_AT : SET_AT + SET_VALUES]
        self._lose_reply = self.faults.take(TesterFault.LOST_REPLY)
        self._set_servo()
        if words[0] not in CONTROL:
            return ExcCodes.ILLEGAL_VALUE
        return self._carry_out(CONTROL[words[0]])

    def _carry_out(self, code: CommandCode) -> ExcCodes | None:
        position = 1e-8 * struct.unpack(">i", self._set(0))[0]
        amplitude_pp, frequency = 2e-3 * struct.unpack(">f", self._set(2))[0], 0.01 * self._registers[SET_AT + 4]
        wanted = (amplitude_pp, frequency)
        self._number = self._number % 0xFFFF + 1
        asked: dict[str, Value] = {
            "command": code,
            "sequence": self._number,
            "preset": position,
            "amplitude": amplitude_pp,
            "frequency": frequency,
            "detector": 0,
            "action": 0,
            "limit": 0.0,
        }
        stale = code is CommandCode.CYCLE and self.faults.take(PlcFault.STALE_IN_FORCE)
        refusal = self.device.write(COMMAND, COMMAND.pack(asked))
        if code is CommandCode.CYCLE and refusal is Refusal.NONE and not stale:
            self.in_force = wanted
        return None if refusal is Refusal.NONE else exception_of(refusal)

    def _set(self, offset: int) -> bytes:
        low, high = self._registers[SET_AT + offset : SET_AT + offset + 2]
        return struct.pack(">HH", high, low)

    def _shown(self) -> list[int]:
        """All registers as they are read now."""
        shown = list(self._stale or self._registers)
        kind = DEVICE_TYPE + self.faults.take(PlcFault.OTHER_TYPE)
        shown[IDENTITY_AT : IDENTITY_AT + 4] = [kind, FIRMWARE, *_low_first(">I", SERIAL)]
        now = self._status_words()
        if self.faults.take(PlcFault.FREEZE):
            self._frozen = now = self._frozen or now
        else:
            self._frozen = None
        shown[STATUS_AT : STATUS_AT + len(now)] = now
        return shown

    def _status_words(self) -> list[int]:
        status = self.device.status()
        state, interlocks = State(cast(int, status["state"])), Interlock(cast(int, status["interlocks"]))
        flags = 0b1_1110 if self.faults.take(PlcFault.NO_STATE) else FLAGS[state]
        alarms = sum(1 << bit for bit, interlock in enumerate(ALARMS) if interlock in interlocks)
        amplitude_pp, frequency = self.in_force or (0.0, 0.0)
        latest_pp = cast(tuple[float, ...], status["displacement_pp"])[0]
        return [
            flags,
            alarms,
            *_low_first(">i", round(1e8 * cast(float, status["displacement_mean"]))),
            *_low_first(">f", 1e3 * latest_pp),
            *_low_first(">I", cast(int, status["cycles"])),
            *struct.unpack(">H", struct.pack(">h", round(cast(float, status["force_mean"])))),
            round(cast(float, status["force_pp"])),
            0,
            0,
            *_low_first(">f", 500.0 * amplitude_pp),
            round(100.0 * frequency),
        ]


def _low_first(layout: str, value: float) -> list[int]:
    high, low = struct.unpack(">HH", struct.pack(layout, value))
    return [low, high]


def start_plc_tester(
    bench: SimulatedBench,
    *,
    rtu: bool = False,
    port: int = 0,
    limits: DeviceLimits | None = None,
    has_watchdog: bool = True,
) -> PlcTesterServer:
    """Connect an actuator to the bench and serve this tester, on a loopback port or a pseudo-terminal.

    Args:
        bench: holds the specimen and the clock.
        rtu: Modbus RTU on a pseudo-terminal instead of Modbus TCP.
        port: TCP port; 0 lets the system pick one.
        limits: set at the instrument; None is its ordinary setting.
        has_watchdog: whether it stops where the life counter stands still.

    Raises:
        RuntimeError: the port is taken.
    """
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)  # every failure is answered on the wire
    actuator = Actuator(bench, bench.clock.now, bench.seed)
    bench.attach_actuator(actuator)
    device = TesterDevice(actuator, bench.clock.now, limits)
    return PlcTesterServer(device, actuator, rtu, port, has_watchdog=has_watchdog)
