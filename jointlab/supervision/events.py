"""What the service tells beside what a sequence tells of itself."""

from __future__ import annotations

from dataclasses import dataclass

from rig.events import Event


@dataclass(frozen=True)
class OperatorAsked(Event):
    """The operator is asked to do something, in `text`; what waits goes on with the answer to prompt `number`."""

    number: int
    kind: str
    text: str


@dataclass(frozen=True)
class OperatorAnswered(Event):
    """Prompt `number` was answered, or is no longer asked."""

    number: int


@dataclass(frozen=True)
class BlowWithdrawn(Event):
    """Blow `blow` at `point` of run `run_id`, which had counted, was taken back for `reason`."""

    run_id: int
    point: str
    blow: int
    reason: str


@dataclass(frozen=True)
class RunStopping(Event):
    """A stop of run `run_id` was asked for."""

    run_id: int | None


@dataclass(frozen=True)
class RunEnded(Event):
    """Run `run_id` ended as `state`, for `reason`; None is a run that never began."""

    run_id: int | None
    state: str
    reason: str | None


@dataclass(frozen=True)
class TesterSilent(Event):
    """The tester does not answer while nothing is carried out, for `reason`."""

    reason: str


@dataclass(frozen=True)
class TesterAnswers(Event):
    """The tester answers again."""


@dataclass(frozen=True)
class LeaseChanged(Event):
    """`holder` drives the rig from now on; None is nobody."""

    holder: str | None
