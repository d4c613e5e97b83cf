"""Faults planted in a simulated laboratory, and the check that has to find each."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from daq.channels import Channel
from rig.checks.check import Check, CheckState, Place
from rig.checks.examination import Examination, examine
from rig.instruments import Instruments
from simlab.bench import BEAM, CALIBRATOR, MASS, SENSOR
from simlab.beside_the_beam import SUSPENDED_MASS
from simlab.laboratory import Laboratory

Table = tuple[Channel, ...]
NOISE = {"hammer": 0.02, "accelerometer": 0.008, "displacement": 3e-8, "force": 0.05}
HAMMER, ACCELEROMETER, DISPLACEMENT, FORCE = "cDAQ1Mod1/ai0", "cDAQ1Mod1/ai1", "cDAQ1Mod2/ai0", "cDAQ1Mod2/ai1"


@dataclass(frozen=True)
class Planted:
    """A fault.

    Attributes:
        name: for people.
        shows: id and subject of a check that has to fail.
        plant: makes it in the laboratory.
        change: makes it in the channel table.
        places: of the examination that finds it.
    """

    name: str
    shows: tuple[str, str]
    plant: Callable[[Laboratory], None] = lambda laboratory: None
    change: Callable[[Table], Table] = lambda table: table
    place: Place = Place.BENCH


def daq(fault: str, physical: str = "") -> Callable[[Laboratory], None]:
    return lambda laboratory: laboratory.daq.faults.set(fault, physical)


def tester(fault: str) -> Callable[[Laboratory], None]:
    return lambda laboratory: laboratory.tester.faults.set(fault)


def thermometer(fault: str) -> Callable[[Laboratory], None]:
    return lambda laboratory: laboratory.thermometer.faults.set(fault)


def scaled(name: str, by: float) -> Callable[[Table], Table]:
    """The table with a sensitivity that is wrong; the range of the input stays."""
    return lambda table: tuple(
        replace(row, sensitivity=by * row.sensitivity, minimum=row.minimum / by, maximum=row.maximum / by)
        if row.name == name
        else row
        for row in table
    )


def swapped(one: str, other: str) -> Callable[[Table], Table]:
    """The table with the inputs of two channels exchanged, as swapped cables are."""

    def change(table: Table) -> Table:
        inputs = {row.name: row.physical for row in table}
        inputs[one], inputs[other] = inputs[other], inputs[one]
        return tuple(replace(row, physical=inputs[row.name]) for row in table)

    return change


PLANTED = (
    Planted("swapped cables", ("cables", "hammer, accelerometer"), change=swapped("hammer", "accelerometer"),
            place=Place.MASS),
    Planted("swapped rows", ("tone", "accelerometer"), change=swapped("hammer", "accelerometer"),
            place=Place.CALIBRATOR),
    Planted("accelerometer ten times", ("sensitivity", "accelerometer"), change=scaled("accelerometer", 10.0),
            place=Place.CALIBRATOR),
    Planted("mV/g taken for mV/(m/s^2)", ("sensitivity", "accelerometer"), change=scaled("accelerometer", 9.80665),
            place=Place.CALIBRATOR),
    Planted("hammer a tenth", ("ratio", "hammer, accelerometer"), change=scaled("hammer", 0.1), place=Place.MASS),
    Planted("damaged accelerometer", ("sensitivity", "accelerometer"), daq("weak", ACCELEROMETER),
            place=Place.CALIBRATOR),
    Planted("inverted accelerometer", ("polarity", "hammer, accelerometer"), daq("inverted", ACCELEROMETER),
            place=Place.MASS),
    Planted("inverted hammer", ("polarity", "hammer, accelerometer"), daq("inverted", HAMMER), place=Place.MASS),
    Planted("open cable of the accelerometer", ("overload", "accelerometer"), daq("cable_open", ACCELEROMETER)),
    Planted("open cable of the hammer", ("overload", "hammer"), daq("cable_open", HAMMER)),
    Planted("dead accelerometer", ("noise", "accelerometer"), daq("dead", ACCELEROMETER)),
    Planted("noisy hammer", ("noise", "hammer"), daq("noisy", HAMMER)),
    Planted("hum on the accelerometer", ("hum", "accelerometer"), daq("hum", ACCELEROMETER)),
    Planted("hum on the load cell", ("hum", "force"), daq("hum", FORCE)),
    Planted("range beyond the module", ("input", "accelerometer"),
            change=lambda table: tuple(replace(row, maximum=2e3) if row.name == "accelerometer" else row
                                       for row in table)),
    Planted("another accelerometer", ("sensor", "accelerometer"), daq("exchanged", ACCELEROMETER)),
    Planted("saturated LVDT", ("overload", "displacement"), daq("saturated", DISPLACEMENT)),
    Planted("zero of the load cell", ("zero", "force"), daq("offset", FORCE)),
    Planted("zero of the LVDT", ("tester_reading", "displacement"), daq("offset", DISPLACEMENT)),
    Planted("chassis without power", ("identity", "acquisition"), daq("device_gone")),
    Planted("dead watchdog", ("watchdog", "tester"), tester("dead_watchdog")),
    Planted("dead emergency stop", ("emergency_stop", "tester"), tester("dead_emergency_stop")),
    Planted("another register map", ("identity", "tester"), tester("wrong_map_version")),
    Planted("silent thermometer", ("reading", "thermometer"), thermometer("silent")),
    Planted("open sensor of the thermometer", ("reading", "thermometer"), thermometer("open_sensor")),
    Planted("IEPE supply off", ("blow", "hammer, accelerometer"),
            change=lambda table: tuple(replace(row, excitation_current=0.0) for row in table), place=Place.MASS),
)  # fmt: skip


def examined(
    laboratory: Laboratory, table: Table, place: Place, *, trip: bool = True, mass: float = SUSPENDED_MASS
) -> tuple[Check, ...]:
    """The checks of the laboratory with its accelerometer at `place`, which it leaves afterwards."""
    addresses = laboratory.addresses
    noisy = tuple(replace(row, noise=NOISE[row.name]) for row in table)
    instruments = Instruments(addresses.daq, addresses.tester, addresses.thermometer, noisy)
    laboratory.bench.mount(SENSOR, {Place.CALIBRATOR: CALIBRATOR, Place.MASS: MASS}.get(place, BEAM))
    try:
        return examine(instruments, Examination(place, trip, mass=mass)).checks
    finally:
        laboratory.bench.mount(SENSOR, BEAM)


def failures(checks: tuple[Check, ...]) -> set[tuple[str, str]]:
    return {(check.id, check.subject) for check in checks if check.state is CheckState.FAILED}
