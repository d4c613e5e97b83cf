"""The rigs of a hall: the state of each as its own drive process says it, and a STOP for each.

It asks the STOP listener of each rig, on whatever computer that is. So it needs no service, key or database there.
"""

import socket
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from datetime import UTC, datetime

from pydantic import BaseModel, ValidationError

from jointlab.drive.phase import Phase
from jointlab.settings import HallRig
from rig.errors import RigError

INTERVAL = 1.0  # s between two looks at a rig
LOOK_TIMEOUT = 2.0  # s that a look may take
FRESH = 5.0  # s for which a state is shown if the next look is delayed
STOP_TIMEOUT = 5.0  # s that STOP may take to answer; it answers within 3 s where the actuator does not come to rest
LONGEST_ANSWER = 65_536  # bytes


class ReportedStop(BaseModel):
    """A STOP that is in force."""

    epoch: int
    who: str
    why: str


class ReportedState(BaseModel):
    """The state of a machine, as its STOP listener reports it."""

    rig: str
    phase: Phase
    run_id: int | None
    activity: str
    reason: str | None
    interlocks: tuple[str, ...]
    tripped: bool = False
    tester_silent: str | None
    rest_unknown: str | None = None
    is_driven: bool = True
    stop: ReportedStop | None


class ReportedOutcome(BaseModel):
    """The answer of a STOP listener to STOP."""

    at_rest: bool | None
    detail: str


@dataclass(frozen=True)
class Seen:
    """A rig as the hall knows it now.

    Attributes:
        given: the rig as it was configured.
        state: None where its drive process does not answer; then nothing is known of the machine.
        trouble: why it does not answer; empty where it does.
        heard_at: its last answer; None where there was none since this program began.
    """

    given: HallRig
    state: ReportedState | None
    trouble: str
    heard_at: datetime | None


class Hall:
    """Looks at every rig, each in a thread of its own, until it is closed."""

    def __init__(self, rigs: Sequence[HallRig], now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._closed = threading.Event()
        self._rigs = {given.rig: given for given in rigs}
        self._seen = {given.rig: (now(), Seen(given, None, "it was not asked yet", None)) for given in rigs}
        self._threads = [
            threading.Thread(target=self._look, args=(given,), name=f"hall, {given.rig}", daemon=True) for given in rigs
        ]
        for thread in self._threads:
            thread.start()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all rigs, in the order of the configuration."""
        return tuple(self._rigs)

    def close(self) -> None:
        """Stop looking."""
        self._closed.set()
        for thread in self._threads:
            thread.join()

    def seen(self) -> tuple[Seen, ...]:
        """Every rig, in the order of the configuration; it does not wait."""
        now = self._now()
        return tuple(
            seen if now - at <= FRESH else Seen(seen.given, None, "it does not answer in time", seen.heard_at)
            for at, seen in tuple(self._seen.values())
        )

    def stop(self, name: str) -> str:
        """STOP for one rig: what its drive process says, which has confirmed the actuator at rest if it drives one.

        Raises:
            KeyError: there is no such rig.
            RigError: it was not confirmed at rest, or another rig answers there.
        """
        given = self._rigs[name]
        try:
            outcome = ReportedOutcome.model_validate_json(_ask(given, b"STOP\n", STOP_TIMEOUT))
            answered = state_of(given)
        except (OSError, ValidationError) as error:
            raise RigError(
                f"STOP of {name} is not confirmed ({reason_of(error)}); press the red button on it"
            ) from error
        if answered.rig != name:
            raise RigError(f"STOP reached {answered.rig}, and not {name}; press the red button on it, correct [[hall]]")
        if outcome.at_rest is False:
            raise RigError(f"{name}: {outcome.detail}; press the red button on it")
        return outcome.detail

    def _look(self, given: HallRig) -> None:
        while True:
            before = self._seen[given.rig][1].heard_at
            try:
                state = state_of(given)
                if state.rig == given.rig:
                    seen = Seen(given, state, "", datetime.now(UTC))
                else:
                    seen = Seen(given, None, f"{state.rig} answers there; correct [[hall]]", before)
            except (OSError, ValidationError) as error:
                seen = Seen(given, None, reason_of(error), before)
            self._seen[given.rig] = self._now(), seen
            if self._closed.wait(INTERVAL):
                return


def state_of(given: HallRig) -> ReportedState:
    """The state of a rig, from its drive process. Raises OSError or ValidationError where that fails."""
    return ReportedState.model_validate_json(_ask(given, b"STATE\n", LOOK_TIMEOUT))


def reason_of(error: OSError | ValidationError) -> str:
    """Why a rig does not answer, in a few words."""
    return "its answer is not understood" if isinstance(error, ValidationError) else error.strerror or str(error)


def _ask(given: HallRig, line: bytes, timeout: float) -> bytes:
    return ask(given.stop_address, given.stop_port, line, timeout)


def ask(address: str, port: int, line: bytes, timeout: float) -> bytes:
    """The answer of a STOP listener to a line, within `timeout` s. Raises OSError where there is none."""
    until = time.monotonic() + timeout
    with closing(socket.create_connection((address, port), timeout)) as connection:
        connection.sendall(line)
        answer = b""
        while more := connection.recv(4096):
            answer += more
            left = until - time.monotonic()
            if left <= 0 or len(answer) > LONGEST_ANSWER:
                raise TimeoutError("its answer does not end")
            connection.settimeout(left)
        return answer.strip()
