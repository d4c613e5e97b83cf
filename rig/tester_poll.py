"""A look at the tester by whoever does not drive it.

It is one read of the STATUS block: nothing is commanded, armed or reset, and no heartbeat is sent, so the instrument's
watchdog acts as if nobody had looked. The connection is opened for it and closed again, for an instrument or a serial
line that takes one client at a time.
"""

from __future__ import annotations

from contextlib import closing

from rig.errors import RigError
from rig.modbus import ModbusLink
from rig.registers import STATUS, ChecksumError
from rig.tester_status import TesterStatus, status_from

TIMEOUT = 0.25  # s, of connecting and of the reply, so that whoever wants the line next has it soon


def poll_tester(url: str) -> TesterStatus:
    """What the tester at `url` reports, asked once.

    Raises:
        RigError: it does not answer within `TIMEOUT`, or not with a status.
    """
    with closing(ModbusLink(url, timeout=TIMEOUT)) as link:
        words = link.read_input(STATUS.address, STATUS.count)
    try:
        return status_from(STATUS.unpack(words))
    except ChecksumError as error:
        raise RigError(f"{url}: {error}") from error
