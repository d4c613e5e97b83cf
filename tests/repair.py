"""A simulated laboratory made whole between tests."""

from rig.registers import State
from rig.tester import driver as tester
from simlab.laboratory import Laboratory


def repair(laboratory: Laboratory) -> None:
    """Clear every simulated fault, and reset a tester that has tripped."""
    for instrument in (laboratory.daq, laboratory.thermometer, laboratory.tester):
        instrument.faults.clear()
    laboratory.tester.release_emergency_stop()
    if laboratory.tester.device.status()["state"] == State.TRIPPED:
        with tester.connect(laboratory.addresses.tester) as driver:
            driver.reset()
