"""The messages between a drive process and the programs that steer it: a line of JSON each.

A program sends a request and gets one reply. A request that moves the actuator, or lets it move, has the number of the
lease that it was made with; the drive process compares it at the moment of driving. `Follow` is answered by a `News`
for everything that happens, until the connection ends.
"""

from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from analysis.errors import AnalysisError
from daq.channels import Channel
from daq.errors import DaqError
from jointlab.drive.journal import Entry
from jointlab.drive.prompts import Prompt
from jointlab.drive.state import RigState
from jointlab.errors import JointlabError
from rig.checks.examination import Examination, Examined
from rig.checks.live import LiveBlock
from rig.errors import RigError
from rig.registers import Interlock
from rig.runs.records import RunOrder
from rig.tester.limits import TesterLimits
from rig.tester.stop_latch import Stop
from store.errors import StoreError
from store.validation import faults_text

LONGEST_REQUEST = 2**26
"""Bytes of one line: an order has the records of the blows that the next ones are compared with."""
REPORTED_ERRORS = (RigError, DaqError, StoreError, JointlabError, AnalysisError)
"""Errors that a reply names; each keeps its class on the other side."""


class Message(BaseModel):
    """A line of the protocol."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Hello(Message):
    """The first request: `name` shows who asks, and this connection is its session until it ends.

    `Welcome` is the value of the reply. A session ends without a request for `jointlab.drive.server.SILENCE` s.
    """

    do: Literal["hello"] = "hello"
    release: str
    name: str


class TakeLease(Message):
    """Give the right to drive to `holder`, None: to nobody; the value of the reply is the new number of the lease.

    Raises ConflictError where a session of another program holds it, unless `by_force`.
    """

    do: Literal["take lease"] = "take lease"
    holder: str | None
    by_force: bool = False


class EndLease(Message):
    """The lease of this session has ended by itself: another program may take it. Until then its number is in force."""

    do: Literal["end lease"] = "end lease"


class Begin(Message):
    """Carry out a run, or go on with it; the reply comes when it has begun, that is when its instruments answered.

    It does not begin where `stop_epoch`, as it was seen by who asks, is not that of the last STOP any more.
    """

    do: Literal["begin"] = "begin"
    order: RunOrder
    limits: TesterLimits
    lease: int
    stop_epoch: int | None = None


class Pause(Message):
    """Pause the run; the reply comes with the actuator at rest. The value is the number of the pause."""

    do: Literal["pause"] = "pause"
    run_id: int


class Resume(Message):
    """Let a paused run go on, where `pause` is the number of its pause in force."""

    do: Literal["resume"] = "resume"
    run_id: int
    lease: int
    pause: int


class End(Message):
    """End the run, by choice and without latching a STOP; the reply comes with the actuator at rest."""

    do: Literal["end"] = "end"
    run_id: int
    who: str | None = None


class StopNow(Message):
    """STOP: latch it, end the run and halt the tester; the reply comes with its actuator at rest.

    The value is the number of the run that was ended, None where none was carried out.
    """

    do: Literal["stop"] = "stop"
    who: str
    why: str


class ResetStop(Message):
    """Release the latch of the STOP with this epoch."""

    do: Literal["reset stop"] = "reset stop"
    epoch: int
    lease: int


class Acknowledge(Message):
    """Reset the tester, because the cause of its trip is removed; the value is the interlocks that had fired."""

    do: Literal["acknowledge"] = "acknowledge"
    lease: int


class Examine(Message):
    """Examine instruments and channels; the value is what was `Examined`. ConflictError where a run is carried out."""

    do: Literal["examine"] = "examine"
    asked: Examination
    lease: int


class LookAtChannel(Message):
    """A block of a channel now; the value is a `LiveBlock`. ConflictError where anything else has the instruments."""

    do: Literal["look at channel"] = "look at channel"
    channel: str
    lease: int


class AskInputRange(Message):
    """The range of the input of a channel that need not be in the table; raises ConflictError as `LookAtChannel`.

    The value is the ends, in the channel's unit. ChannelError where the input does not take what the channel asks for.
    """

    do: Literal["ask input range"] = "ask input range"
    channel: Channel
    lease: int


class AnswerPrompt(Message):
    """The operator has done what prompt number `prompt` of the run asks for."""

    do: Literal["answer"] = "answer"
    run_id: int
    prompt: int
    lease: int


class FailPrompt(Message):
    """The operator cannot do what the prompt asks for, for `reason`: the run fails."""

    do: Literal["fail prompt"] = "fail prompt"
    run_id: int
    prompt: int
    reason: str


class AskOutcome(Message):
    """How the run ended that was carried out last: the reply has its error, where it was stopped or failed."""

    do: Literal["ask outcome"] = "ask outcome"


class Withdraw(Message):
    """An accepted blow does not count any more; a session that is still running asks for another one."""

    do: Literal["withdraw"] = "withdraw"
    run_id: int
    set_number: int
    point: str
    blow: int
    reason: str


class Follow(Message):
    """Send `News` of each event after number `after` in the journal `epoch`, as far back as events are kept."""

    do: Literal["follow"] = "follow"
    epoch: str | None
    after: int


class Ask(Message):
    """The present `Snapshot`; keeps a session."""

    do: Literal["ask"] = "ask"


class Quit(Message):
    """End the process; ConflictError where a run is carried out."""

    do: Literal["quit"] = "quit"


DriveRequest = (
    Hello | TakeLease | EndLease | Begin | Pause | Resume | End | StopNow | ResetStop | Acknowledge | Examine
    | LookAtChannel | AskInputRange | AnswerPrompt | FailPrompt | AskOutcome | Withdraw | Follow | Ask | Quit
)  # fmt: skip
REQUEST: TypeAdapter[DriveRequest] = TypeAdapter(Annotated[DriveRequest, Field(discriminator="do")])


@dataclass(frozen=True)
class Snapshot:
    """What a drive process does.

    Attributes:
        latest: number of the latest event.
        state, prompt: of the rig and its operator.
        stop: the STOP that is in force.
        holder: who drives.
        pause: number of the pause in force; a resume names it.
        stop_epoch: number of the last STOP, reset or not; None where it is not known.
    """

    latest: int = 0
    state: RigState = field(default_factory=RigState)
    prompt: Prompt | None = None
    stop: Stop | None = None
    holder: str | None = None
    pause: int | None = None
    stop_epoch: int | None = None


@dataclass(frozen=True)
class Welcome:
    """The answer to `Hello`.

    Attributes:
        epoch: names the journal.
        lease: number of the lease that is in force.
        tester_url: address of its tester.
        stop_address, stop_port: of the STOP listener.
        channels: that it measures with.
    """

    epoch: str
    rig: str
    lease: int
    tester_url: str | None
    stop_address: str
    stop_port: int
    channels: tuple[Channel, ...]


class Reply(Message):
    """The answer to a request: `value`, or the class of an error and its message.

    Attributes:
        latest: number of the latest event when the request was done.
    """

    latest: int
    value: Any = None
    error: str | None = None
    text: str = ""


class News(Message):
    """Events since the last news, oldest first, and what the rig does after them."""

    epoch: str
    entries: tuple[Entry, ...]
    snapshot: Snapshot


SNAPSHOT: TypeAdapter[Snapshot] = TypeAdapter(Snapshot)
WELCOME: TypeAdapter[Welcome] = TypeAdapter(Welcome)
INTERLOCKS: TypeAdapter[Interlock] = TypeAdapter(Interlock)
LIVE_BLOCK: TypeAdapter[LiveBlock] = TypeAdapter(LiveBlock)
INPUT_RANGE: TypeAdapter[tuple[float, float]] = TypeAdapter(tuple[float, float])
EXAMINED: TypeAdapter[Examined] = TypeAdapter(Examined)


class ProtocolError(RigError):
    """This version does not understand a line."""


def request_of(line: bytes) -> DriveRequest:
    """The request in a line. Raises ProtocolError where there is none."""
    try:
        return REQUEST.validate_json(line)
    except ValidationError as error:
        found = faults_text(error.errors()[:1], "request")
        raise ProtocolError(f"the drive process does not understand this request: {found}") from error


def error_of(reply: Reply) -> Exception:
    """The error in a reply, with its class; of a class that is not known here, a RigError."""
    kind = next((each for each in _classes(REPORTED_ERRORS) if each.__name__ == reply.error), RigError)
    error = kind.__new__(kind)  # its message is there; `__init__` may want further arguments
    Exception.__init__(error, reply.text)
    return error


def _classes(kinds: tuple[type[Exception], ...]) -> list[type[Exception]]:
    return [each for kind in kinds for each in (kind, *_classes(tuple(kind.__subclasses__())))]
