"""The simulated C Series modules, the sensors wired to them, and the way from SI to counts."""

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from simlab.daq_errors import OVERLOAD_GAIN, Code, StatusError
from simlab.sampling import white_noise

Real = NDArray[np.float64]
Counts = NDArray[np.int32]

IDLE_NOISE = 50e-6  # V rms, of an input that no sensor drives
SLOWEST_DIVISOR = 31
ORDINARY = 5.0  # V, range of the inputs that noise and faults are stated for
CONVERTER_NOISE = 5e-6  # V rms, of a shorted input
HUM, NOISY = 5e-3, 2e-3  # V: amplitude of picked-up mains, rms of a bad contact
WEAK, OFFSET = 10.0, 0.1  # divisor of a weak signal; added offset, as a share of the range
OF_MODULES = 8  # the stream of their noise, beside those of the bench's sensors


class Input(StrEnum):
    """What an input can be asked to measure."""

    VOLTAGE = "voltage"
    IEPE = "IEPE"
    BRIDGE = "bridge"
    CHARGE = "charge"


@dataclass(frozen=True)
class Module:
    """A delta-sigma input module.

    Attributes:
        name: device name in the chassis ("cDAQ1Mod1").
        product_type: as NI-DAQmx gives it ("NI 9234").
        serial: serial number.
        slot: slot in the chassis, from 1; 0 of a device of its own.
        inputs: number of analog inputs.
        largest: range, plus and minus, in V; of bridges in V/V, of charges in C.
        fastest: highest sample rate in Hz; the others are `fastest` / n, n = 1..31.
        measures: what inputs can be asked for.
        excitations: IEPE currents in A, besides none, or voltages of bridges in V that the module can supply.
        reads_teds: whether it reads the data sheet of a sensor.
    """

    name: str
    product_type: str
    serial: int
    slot: int
    inputs: int
    largest: float
    fastest: float
    measures: tuple[Input, ...] = (Input.VOLTAGE,)
    excitations: tuple[float, ...] = ()
    reads_teds: bool = False

    @property
    def physical_channels(self) -> tuple[str, ...]:
        """``cDAQ1Mod1/ai0`` and so on."""
        return tuple(f"{self.name}/ai{i}" for i in range(self.inputs))

    @property
    def per_count(self) -> float:
        """Least significant bit of the 24-bit converter, in the unit of `largest`."""
        return self.largest / 2**23

    @property
    def volt(self) -> float:
        """What disturbs this input as 1 V disturbs one that measures voltages, in the unit of `largest`."""
        return 1.0 if Input.VOLTAGE in self.measures else self.largest / ORDINARY

    def coerced_rate(self, rate: float) -> float:
        """The slowest rate of the module that is not below `rate`, in Hz.

        Raises:
            StatusError: -200077, the module is not that fast.
        """
        if not 0 < rate <= self.fastest * (1 + 1e-9):
            raise StatusError(
                Code.INVALID_ATTRIBUTE_VALUE,
                f"Property: SampClk.Rate. Requested value: {rate:g}. Maximum value: {self.fastest:g}.",
            )
        divisor = int(self.fastest / rate * (1 + 1e-9))
        return self.fastest / min(divisor, SLOWEST_DIVISOR)

    def counts(self, values: Real) -> Counts:
        """What the converter makes of `values` (samples,) at the input: quantised, and clipped at 24 bit."""
        return np.clip(np.rint(values / self.per_count), -(2**23), 2**23 - 1).astype(np.int32)


@dataclass(frozen=True)
class DataSheet:
    """What a sensor with TEDS says of itself: numbers of maker, model and serial."""

    manufacturer: int
    model: int
    serial: int


@dataclass(frozen=True)
class Sensor:
    """A simulated sensor.

    Attributes:
        rig: which rig it sits on, "hammer" or "tester".
        signal: the bench's name of what it follows.
        sensitivity: V per SI unit; V/V of a bridge, C of a charge.
        fed: whether it works only with an IEPE current or the supply of a bridge.
        teds: its data sheet; None where it has none.
    """

    rig: str
    signal: str
    sensitivity: float
    fed: bool = False
    teds: DataSheet | None = None


@dataclass(frozen=True)
class SimulatedChassis:
    """A CompactDAQ chassis, its modules, and the sensor on each physical channel that has one."""

    name: str
    product_type: str
    serial: int
    modules: tuple[Module, ...]
    wiring: Mapping[str, Sensor] = field(default_factory=dict)

    def data_sheet(self, physical: str) -> DataSheet:
        """What the sensor at `physical` says of itself.

        Raises:
            StatusError: -200741, the module reads none; -200709, there is no sensor that has one; and as `module_of`.
        """
        if not self.module_of(physical).reads_teds:
            raise StatusError(Code.TEDS_NOT_SUPPORTED, f"Physical channel name: {physical}.")
        sensor = self.wiring.get(physical)
        if sensor is None or sensor.teds is None:
            raise StatusError(Code.TEDS_SENSOR_NOT_DETECTED, f"Physical channel name: {physical}.")
        return sensor.teds

    def module_of(self, physical: str) -> Module:
        """The module that `physical` belongs to.

        Raises:
            StatusError: -200220 for an unknown device, -200170 for an unknown channel of a known one.
        """
        device = physical.split("/")[0]
        for module in self.modules:
            if module.name == device:
                if physical not in module.physical_channels:
                    raise StatusError(Code.PHYSICAL_CHAN_DOES_NOT_EXIST, f"Physical channel name: {physical}.")
                return module
        if device == self.name:
            raise StatusError(Code.PHYSICAL_CHAN_DOES_NOT_EXIST, f"Physical channel name: {physical}.")
        raise StatusError(Code.INVALID_DEVICE_ID, f"Device specified: {device}.")


HAMMER = Sensor("hammer", "hammer", 2.25e-3, fed=True)  # V/N
ACCELEROMETER = Sensor("hammer", "accelerometer", 10.2e-3, fed=True, teds=DataSheet(61, 352, 1))  # V/(m/s^2), 100 mV/g
DISPLACEMENT = Sensor("tester", "displacement", 2e3)  # V/m, 2 V/mm
FORCE = Sensor("tester", "force", 2e-3)  # V/N
LOAD_CELL = Sensor("tester", "force", 0.4e-6, fed=True, teds=DataSheet(76, 10, 4711))  # V/V/N, 2 mV/V at 5 kN
CHARGE_HAMMER = Sensor("hammer", "hammer", 4e-12)  # C/N
CHARGE_ACCELEROMETER = Sensor("hammer", "accelerometer", 10e-12)  # C/(m/s^2)


def laboratory_chassis() -> SimulatedChassis:
    """The chassis of the laboratory: hammer and accelerometer on an NI 9234, the tester's outputs on an NI 9239.

    Two inputs of each of these have no sensor. The tester's force is also on a load cell at an NI 9237 for bridges, and
    hammer and accelerometer have charge outputs, too, at a PXIe-4480, of which only this is simulated.
    """
    return SimulatedChassis(
        name="cDAQ1",
        product_type="cDAQ-9174",
        serial=0x01C0FFEE,
        modules=(
            Module(
                "cDAQ1Mod1", "NI 9234", 0x01A2B3C4, 1, 4, largest=5.0, fastest=51200.0,
                measures=(Input.VOLTAGE, Input.IEPE), excitations=(2e-3,), reads_teds=True,
            ),
            Module("cDAQ1Mod2", "NI 9239", 0x01D4E5F6, 2, 4, largest=10.0, fastest=50000.0),
            Module(
                "cDAQ1Mod3", "NI 9237", 0x01B7C8D9, 3, 4, largest=25e-3, fastest=50000.0,
                measures=(Input.BRIDGE,), excitations=(2.5, 3.3, 5.0, 10.0), reads_teds=True,
            ),
            Module("PXI1Slot2", "PXIe-4480", 0x01E1F2A3, 0, 6, 20e-9, 51200.0, (Input.CHARGE,)),
        ),
        wiring={
            "cDAQ1Mod1/ai0": HAMMER,
            "cDAQ1Mod1/ai1": ACCELEROMETER,
            "cDAQ1Mod2/ai0": DISPLACEMENT,
            "cDAQ1Mod2/ai1": FORCE,
            "cDAQ1Mod3/ai0": LOAD_CELL,
            "PXI1Slot2/ai0": CHARGE_HAMMER,
            "PXI1Slot2/ai1": CHARGE_ACCELEROMETER,
        },
    )  # fmt: skip


def module_noise(physical: str, first: int, samples: int) -> Real:
    """Unit noise (samples,) of a channel of its own, from its sample `first` on since bench time 0."""
    return white_noise(zlib.crc32(physical.encode()), OF_MODULES, first, samples)


def input_values(
    physical: str, module: Module, sensor: Sensor | None, signal: Real | None, excited: bool, first: int, samples: int
) -> Real:
    """V, V/V or C (samples,) at an input, before the converter.

    Args:
        physical: the channel.
        module: that it is on.
        sensor: what is wired to it; None where nothing is, or where the cable is open.
        signal: what the bench puts on the sensor, SI (samples,); None where the bench has no such signal.
        excited: whether the input supplies IEPE current, or its bridge.
        first: number of the first sample since bench time 0.
        samples: how many.

    Without a sensor, an input with a supply is at 24 V. A sensor that needs a supply gives only noise without one.
    """
    if sensor is None and excited:
        return np.full(samples, 24.0)  # V, compliance voltage of the current source: far beyond any range
    if sensor is None or signal is None or (sensor.fed and not excited):
        return module.volt * IDLE_NOISE * module_noise(physical, first, samples)
    return signal * sensor.sensitivity


def faulty_values(
    values: Real, present: Callable[[str], bool], physical: str, module: Module, start: float, rate: float
) -> Real:
    """`values` (samples,) of a `physical` channel, from bench time `start` on, with the faults that are `present`."""
    times = start + np.arange(values.size) / rate
    noise = module.volt * module_noise(physical, round(start * rate), values.size)
    if present("overload"):
        values = values * OVERLOAD_GAIN
    if present("inverted"):
        values = -values
    if present("weak"):
        values = values / WEAK
    if present("dead"):
        values = CONVERTER_NOISE * noise
    if present("hum"):
        values = values + HUM * module.volt * np.sin(2 * np.pi * 50 * times)
    if present("noisy"):
        values = values + NOISY * noise
    if present("offset"):
        values = values + OFFSET * module.largest
    return np.full(values.size, 1.05 * module.largest) if present("saturated") else values


def level_of_force(level: float, present: Callable[[str], bool], module: Module) -> float | None:
    """Where a signal that rises from zero carries its input through a trigger `level`, with its faults `present`.

    Both are in the unit of the input, the one returned of the signal without faults. None where faults let no such
    signal do that; a level that makes no sense without faults is returned as it is.
    """
    if present("dead") or present("saturated"):
        return None
    if present("offset") and level <= OFFSET * module.largest:
        return None
    level -= OFFSET * module.largest * present("offset")
    if present("weak"):
        level *= WEAK
    if not present("inverted"):
        return level
    return -level if level < 0.0 else None
