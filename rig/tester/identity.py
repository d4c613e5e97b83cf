"""Whether this driver may drive a tester: what it is, its own limits, its watchdog and its detectors."""

from collections.abc import Collection
from typing import cast

from rig.registers import DETECTORS, IDENTITY, Action, Interlock, name_of
from rig.tester.missing_functions import Lack, unaccepted
from rig.tester.modbus import ModbusProtocolError
from rig.tester.status import TesterIdentity, TesterMismatchError, detectors_from
from rig.tester.wire import TesterWire

HAS_TO_STOP = (Interlock.UPPER_DISPLACEMENT, Interlock.LOWER_DISPLACEMENT, Interlock.FORCE, Interlock.ERROR)
"""Detectors that have to stop the actuator where there are any."""


def verified_identity(wire: TesterWire, without: Collection[Lack]) -> TesterIdentity:
    """The identity of the tester at `wire`, which commands nothing.

    Args:
        without: functions of `NEEDS_CONSENT` that the tester may lack.

    Raises:
        TesterMismatchError: this driver may not drive it.
        RigError: it does not answer.
    """
    url, tester_map = wire.url, wire.map
    if why := unaccepted(tester_map.lacks, without):
        raise TesterMismatchError(f"{tester_map.name} at {url} has {why}")
    try:
        found = wire.identity()
    except ModbusProtocolError as error:
        raise TesterMismatchError(f"{url} is no tester with {tester_map.name}: {error}") from error
    if faults := [fault for probe in tester_map.probes if (fault := probe.fault(found))]:
        raise TesterMismatchError(f"{url} {'; '.join(faults)}")
    found["serial"] = serial = str(found.get("serial", tester_map.name))
    watching = wire.detectors()
    detectors = detectors_from(watching) if watching else {}
    limits = {name: value for name, value in found.items() if isinstance(value, float) and name.endswith("_limit")}
    watchdog_time = None if tester_map.heartbeat is None else cast(float, found["watchdog_time"])
    if watchdog_time is not None and not watchdog_time > 0:
        raise TesterMismatchError(f"{url} has its watchdog off; set its time before driving it")
    limits |= {f"{name_of(interlock)}_limit": detector.limit for interlock, detector in detectors.items()}
    missing = [name for name, value in limits.items() if name != "lower_displacement_limit" and not value > 0]
    if missing:
        raise TesterMismatchError(f"{url} has no {', '.join(missing)}; set it at the instrument")
    strange = [*IDENTITY.out_of_range(found), *DETECTORS.out_of_range(watching)]
    if strange:
        raise TesterMismatchError(f"{url} has {', '.join(strange)}; set it at the instrument")
    mild = [
        name_of(interlock)
        for interlock in HAS_TO_STOP
        if interlock in detectors and detectors[interlock].action < Action.HOLD
    ]
    if mild:
        raise TesterMismatchError(f"{url} only indicates {', '.join(mild)}; set these detectors to stop the actuator")
    return TesterIdentity(serial, watchdog_time, limits, detectors, tester_map.name, tester_map.lacks)
