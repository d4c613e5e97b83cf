"""Events of the drive process, beside those that a sequence reports of itself."""

from enum import StrEnum

from rig import events
from rig.events import Event
from store.states import RunState


class PromptKind(StrEnum):
    """What a prompt asks for."""

    GO = "go"
    STRIKE = "strike"
    MOUNT = "mount"
    TASK = "task"
    POINTS = "points"


class OperatorAsked(Event):
    """The operator is asked for `text`; a sequence that waits goes on with the answer to prompt `number`."""

    number: int
    kind: PromptKind
    text: str


class OperatorAnswered(Event):
    """Prompt `number` was answered or withdrawn."""

    number: int


class BlowWithdrawn(Event):
    """Blow `blow` at `point` of run `run_id`, which had been accepted, was withdrawn for `reason`."""

    run_id: int
    point: str
    blow: int
    reason: str


class RunStopping(Event):
    """A stop of run `run_id` was requested."""

    run_id: int | None


class RunEnded(Event):
    """Run `run_id` ended as `state`; `reason` says why, or what was left out of it. `created`: it did not begin."""

    run_id: int | None
    state: RunState
    reason: str | None


class ExaminationEnded(Event):
    """The examination of the rig has ended."""


class StopLatched(Event):
    """STOP is in force, as `who` asked for `why`: nothing moves until it is reset."""

    who: str
    why: str


class StopReset(Event):
    """STOP was reset."""


class TesterSilent(Event):
    """The tester does not answer while no run drives it, for `reason`."""

    reason: str


class TesterAnswers(Event):
    """The tester answers again."""


class UnaskedMotion(Event):
    """The tester moves, or does not show that it rests, while no run drives it: `reason` says what it shows."""

    reason: str


class LeaseChanged(Event):
    """`holder` drives the rig from now on; None: nobody does."""

    holder: str | None


EVENTS: dict[str, type[Event]] = {
    name: kind
    for module in (vars(events), globals())
    for name, kind in tuple(module.items())
    if isinstance(kind, type) and issubclass(kind, Event) and kind is not Event
}
"""Every kind of event by its name."""
