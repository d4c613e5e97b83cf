"""Watching successive statuses of the tester for values that a sound instrument never reports.

The ranges of single values are checked where a status is read (`rig.tester.status`). Here one status is compared with
what was commanded and with the statuses before it, so that a frozen, stale or contradictory one stops the machine.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from rig.registers import CommandCode, State
from rig.tester.rest_judge import REST_PP
from rig.tester.status import CYCLING, ImplausibleStatusError, StatusFault, TesterStatus, state_text

CYCLES_LATE, TIME_LATE = 3.0, 0.3
"""Number of periods, and time in s. A cycling machine has to count a further cycle within the longer of the two. Motion
after a command to stop, or in a state of rest, is an error after the same time in s."""
STOPPED = frozenset({CommandCode.HOLD, CommandCode.HYDRAULICS_OFF})
"""Commands after which nothing cycles."""


@dataclass(frozen=True)
class StatusReading:
    """One status, and what it shows of its age.

    Attributes:
        status: as it was reported.
        ours: whether the command in force is the last one of this client.
        fresh: whether it has the latest heartbeat of this client.
        asked: the values of the last command of this client, as they were confirmed to be in force.
    """

    status: TesterStatus
    ours: bool
    fresh: bool
    asked: Mapping[str, float]


class StatusWatch:
    """Compares each status with those before it. One thread at a time may call it."""

    def __init__(self) -> None:
        self._counted: tuple[float, int, int] | None = None  # when, sequence and cycles as they last changed
        self._cycling_on_since: float | None = None  # when it first cycled after a command to stop
        self._moving_since: tuple[float, int, int] | None = None  # when rest was claimed in motion, sequence, cycles

    def check(self, reading: StatusReading, now: float) -> None:
        """Check a status that was read at `now`, s of `time.monotonic`.

        Raises ImplausibleStatusError where it is not what a sound instrument reports.
        """
        status = reading.status
        if not reading.fresh:
            raise ImplausibleStatusError(
                StatusFault.HEARTBEAT, f"heartbeat {status.heartbeat} is reported, which is not the last one sent"
            )
        if (status.state in CYCLING) != (status.amplitude_pp > 0.0) and status.state is not State.TRIPPED:
            raise ImplausibleStatusError(
                StatusFault.STATE,
                f"it is {state_text(status.state)} with an amplitude of {1e3 * status.amplitude_pp:g} mm in force",
            )
        if reading.ours and status.command is CommandCode.CYCLE and not status.stopped_by:
            self._check_in_force(status, reading.asked)
        if not (status.state in CYCLING and status.command in STOPPED):
            self._cycling_on_since = None
        elif self._cycling_on_since is None:
            self._cycling_on_since = now
        elif now - self._cycling_on_since > TIME_LATE:
            raise ImplausibleStatusError(
                StatusFault.COMMAND,
                f"it is {state_text(status.state)}, and its last command was {status.command.name.lower()}",
            )
        if status.state in CYCLING:
            self._check_cycles(status, now)
        else:
            self._counted = None
            self._check_rest(status, now)

    def _check_in_force(self, status: TesterStatus, asked: Mapping[str, float]) -> None:
        found = {"amplitude": status.amplitude_pp, "frequency": status.frequency}
        for name, value in found.items():
            if value != asked.get(name, value):
                raise ImplausibleStatusError(
                    StatusFault.COMMAND, f"{name} {asked[name]:g} was commanded, {value:g} is in force now"
                )

    def _check_cycles(self, status: TesterStatus, now: float) -> None:
        """Check that cycles are counted."""
        if self._counted is None or self._counted[1:] != (status.sequence, status.cycles):
            self._counted = (now, status.sequence, status.cycles)
        allowed = max(CYCLES_LATE / status.frequency, TIME_LATE) if status.frequency > 0.0 else math.inf
        if now - self._counted[0] > allowed:
            raise ImplausibleStatusError(
                StatusFault.FROZEN, f"it cycles, and counts {status.cycles} cycles since {now - self._counted[0]:.2g} s"
            )

    def _check_rest(self, status: TesterStatus, now: float) -> None:
        """Check that an actuator reported at rest does not cycle."""
        moves = status.state is not State.RAMPING and max(status.displacement_pp[:1], default=0.0) > REST_PP
        if not moves:
            self._moving_since = None
        elif self._moving_since is None or self._moving_since[1] != status.sequence:
            self._moving_since = (now, status.sequence, status.cycles)
        elif now - self._moving_since[0] > TIME_LATE and status.cycles >= self._moving_since[2] + 2:
            raise ImplausibleStatusError(
                StatusFault.STATE,
                f"it is {state_text(status.state)}, and moves by {1e3 * status.displacement_pp[0]:g} mm peak to peak",
            )
