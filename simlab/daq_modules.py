"""The simulated C Series modules, the sensors wired to them, and the way from SI to counts."""

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simlab.daq_errors import OVERLOAD_GAIN, Code, StatusError

Real = NDArray[np.float64]
Counts = NDArray[np.int32]

IDLE_NOISE = 50e-6  # V rms, of an input that no sensor drives
SLOWEST_DIVISOR = 31
CONVERTER_NOISE = 5e-6  # V rms, of a shorted input
HUM, NOISY = 5e-3, 2e-3  # V: amplitude of picked-up mains, rms of a bad contact


@dataclass(frozen=True)
class Module:
    """A delta-sigma input module.

    Attributes:
        name: device name in the chassis ("cDAQ1Mod1").
        product_type: as NI-DAQmx gives it ("NI 9234").
        serial: serial number.
        slot: slot in the chassis, from 1.
        inputs: number of analog inputs.
        volts: range, plus and minus.
        fastest: highest sample rate in Hz; the others are `fastest` / n, n = 1..31.
        excitations: IEPE currents in A that the module can supply, besides none.
    """

    name: str
    product_type: str
    serial: int
    slot: int
    inputs: int
    volts: float
    fastest: float
    excitations: tuple[float, ...] = ()

    @property
    def physical_channels(self) -> tuple[str, ...]:
        """``cDAQ1Mod1/ai0`` and so on."""
        return tuple(f"{self.name}/ai{i}" for i in range(self.inputs))

    @property
    def volts_per_count(self) -> float:
        """Least significant bit of the 24-bit converter, in V."""
        return self.volts / 2**23

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

    def counts(self, volts: Real) -> Counts:
        """What the converter makes of `volts` (samples,): quantised, and clipped at 24 bit."""
        return np.clip(np.rint(volts / self.volts_per_count), -(2**23), 2**23 - 1).astype(np.int32)


@dataclass(frozen=True)
class Sensor:
    """A simulated sensor.

    Attributes:
        rig: which rig it sits on, "hammer" or "tester".
        signal: the bench's name of what it follows.
        sensitivity: V per SI unit.
        iepe: whether it works only when fed an IEPE current.
    """

    rig: str
    signal: str
    sensitivity: float
    iepe: bool = False


@dataclass(frozen=True)
class SimulatedChassis:
    """A CompactDAQ chassis, its modules, and the sensor on each physical channel that has one."""

    name: str
    product_type: str
    serial: int
    modules: tuple[Module, ...]
    wiring: Mapping[str, Sensor] = field(default_factory=dict)

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


HAMMER = Sensor("hammer", "hammer", 2.25e-3, iepe=True)  # V/N
ACCELEROMETER = Sensor("hammer", "accelerometer", 10.2e-3, iepe=True)  # V/(m/s^2), 100 mV/g
DISPLACEMENT = Sensor("tester", "displacement", 2e3)  # V/m, 2 V/mm
FORCE = Sensor("tester", "force", 2e-3)  # V/N


def laboratory_chassis() -> SimulatedChassis:
    """The chassis of the laboratory: hammer and accelerometer on an NI 9234, the tester's outputs on an NI 9239.

    Two inputs of each module have no sensor.
    """
    return SimulatedChassis(
        name="cDAQ1",
        product_type="cDAQ-9174",
        serial=0x01C0FFEE,
        modules=(
            Module("cDAQ1Mod1", "NI 9234", 0x01A2B3C4, 1, 4, volts=5.0, fastest=51200.0, excitations=(2e-3,)),
            Module("cDAQ1Mod2", "NI 9239", 0x01D4E5F6, 2, 4, volts=10.0, fastest=50000.0),
        ),
        wiring={
            "cDAQ1Mod1/ai0": HAMMER,
            "cDAQ1Mod1/ai1": ACCELEROMETER,
            "cDAQ1Mod2/ai0": DISPLACEMENT,
            "cDAQ1Mod2/ai1": FORCE,
        },
    )


def idle_volts(physical: str, first: int, samples: int) -> Real:
    """Noise (samples,) in V of an input that nothing drives, the same again for the same samples."""
    random = np.random.default_rng([zlib.crc32(physical.encode()), first])
    return IDLE_NOISE * random.standard_normal(samples)


def input_volts(
    physical: str, sensor: Sensor | None, signal: Real | None, excited: bool, first: int, samples: int
) -> Real:
    """Volts (samples,) at an input, before the converter.

    Args:
        physical: the channel.
        sensor: what is wired to it; None where nothing is, or where the cable is open.
        signal: what the bench puts on the sensor, SI (samples,); None where the bench has no such signal.
        excited: whether the input supplies IEPE current.
        first: index of the first sample.
        samples: how many.

    The current of an open IEPE input drives it to the rail; an IEPE sensor without current gives nothing.
    """
    if sensor is None and excited:
        return np.full(samples, 24.0)  # compliance voltage of the current source, far beyond the range
    if sensor is None or signal is None or (sensor.iepe and not excited):
        return idle_volts(physical, first, samples)
    return signal * sensor.sensitivity


def faulty_volts(volts: Real, present: Callable[[str], bool], module: Module, start: float, rate: float) -> Real:
    """What `volts` (samples,) become by the faults of a channel that are `present`, from bench time `start` on."""
    times = start + np.arange(volts.size) / rate
    noise = np.random.default_rng(round(start * rate)).standard_normal(volts.size)
    if present("overload"):
        volts = volts * OVERLOAD_GAIN
    if present("inverted"):
        volts = -volts
    if present("weak"):
        volts = volts / 10
    if present("dead"):
        volts = CONVERTER_NOISE * noise
    if present("hum"):
        volts = volts + HUM * np.sin(2 * np.pi * 50 * times)
    if present("noisy"):
        volts = volts + NOISY * noise
    if present("offset"):
        volts = volts + 0.1 * module.volts
    return np.full(volts.size, 1.05 * module.volts) if present("saturated") else volts
