"""An operator that is a program, such as that of a simulated bench, beside the prompts of a drive process."""

import logging
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from queue import SimpleQueue
from typing import Protocol

from analysis.dof import Dof
from jointlab.drive.events import PromptKind
from jointlab.drive.journal import Entry, event_of
from jointlab.drive.prompts import Prompt
from jointlab.drive.protocol import AnswerPrompt, DriveRequest, FailPrompt, Snapshot
from jointlab.errors import ConflictError
from rig.errors import RigError, failure_reason
from rig.events import Event
from rig.operator import Operator
from store.catalogue import Catalogue
from store.measurements.runs import get_run, note_automatic

log = logging.getLogger(__name__)


class AutomaticOperator(Operator, Protocol):
    """An operator that needs no prompt, and observes the sequence."""

    def observe(self, event: Event) -> None:
        """Receive an event of the sequence."""


def obey(operator: Operator, prompt: Prompt) -> None:
    """Do what a prompt asks for. Raises RigError where the operator cannot."""
    match prompt.kind, prompt.subject:
        case PromptKind.GO, (point,):
            operator.go_to(Dof.parse(point))
        case PromptKind.STRIKE, (point, blow):
            operator.strike(Dof.parse(point), int(blow))
        case PromptKind.MOUNT, (specimen, configuration):
            operator.mount(specimen, configuration)
        case PromptKind.POINTS, (preset, *points):
            values = list(map(float, points))
            operator.run_points(float(preset), tuple(zip(values[::2], values[1::2], strict=True)))
        case _:
            operator.do_task(prompt.text)


def is_automatic(catalogue: Catalogue, run_id: int, asked: bool | None) -> bool:
    """Whether a run is automatic: as `asked`, which is then stored with the run; None: as it is stored."""
    with catalogue.reading() as session:
        stored = bool(get_run(session, run_id).automatic)
    wanted = stored if asked is None else asked
    if wanted != stored:
        with catalogue.writing() as session:
            note_automatic(session, run_id, wanted)
    return wanted


class Automation:
    """Lets the automatic operator of a rig obey the prompts of runs that were begun automatically.

    Prompts are obeyed in a thread of its own, one after the other.

    Args:
        operator: the program; None where there is none, and a person does everything.
        ask: passes a request to the drive process.
        lease: number of the present lease.
    """

    def __init__(
        self, operator: AutomaticOperator | None, ask: Callable[[DriveRequest], object], lease: Callable[[], int]
    ) -> None:
        self.operator = operator
        self._ask = ask
        self._lease = lease
        self._automatic_run: int | None = None  # whose prompts are obeyed without an answer of a person
        self._obeyed: int | None = None  # number of the last prompt that was obeyed
        self._prompts = SimpleQueue[tuple[int, Prompt] | None]()  # each with its run, which has one open at a time
        self._thread = threading.Thread(target=self._run, name="automatic operator", daemon=True)
        self._thread.start()

    @contextmanager
    def beginning(self, run_id: int, automatic: bool) -> Iterator[None]:
        """The context in which a run begins. Where it does not begin because of another run, nothing changes.

        Args:
            run_id: of the run; a run that another program begins is left to that.
            automatic: whether the operator does everything in the run.
        """
        mine = run_id if automatic and self.operator is not None else None
        before, self._automatic_run = self._automatic_run, mine
        try:
            yield
        except ConflictError:
            if self._automatic_run == mine:  # else the other run has begun meanwhile
                self._automatic_run = before
            raise

    def shown(self, snapshot: Snapshot) -> Prompt | None:
        """The open prompt to show to a person; None where the automatic operator obeys it.

        Where a person confirms what the automatic operator then does, a strike waits for the answer, too.
        """
        prompt = snapshot.prompt
        if prompt is None or self.operator is None:
            return prompt
        return None if self._is_automatic(snapshot) else replace(prompt, waits=True)

    def answer(self, prompt: Prompt) -> bool:
        """Let the operator obey a prompt that a person has confirmed; True if the drive process waits for an answer.

        Raises ConflictError where the prompt was obeyed before.
        """
        if self.operator is None:
            return True
        if self._obeyed == prompt.number:
            raise ConflictError(f"prompt {prompt.number} is not what is asked for now; it was answered")
        obey(self.operator, prompt)
        if not prompt.waits:
            self._obeyed = prompt.number
        return prompt.waits

    def observe(self, entries: Sequence[Entry]) -> None:
        """Tell the operator what has happened."""
        if self.operator is not None:
            for entry in entries:
                self.operator.observe(event_of(entry))

    def look(self, snapshot: Snapshot) -> None:
        """Obey the open prompt soon, once, where the run is automatic."""
        prompt = snapshot.prompt
        if prompt is not None and prompt.number != self._obeyed and self._is_automatic(snapshot):
            self._obeyed = prompt.number
            self._prompts.put((snapshot.state.run_id or 0, prompt))

    def _is_automatic(self, snapshot: Snapshot) -> bool:
        return self._automatic_run is not None and snapshot.state.run_id == self._automatic_run

    def close(self) -> None:
        """End after the present prompt."""
        self._prompts.put(None)
        self._thread.join()

    def _run(self) -> None:
        while (asked := self._prompts.get()) is not None:
            run_id, prompt = asked
            try:
                self._obey(run_id, prompt)
            except Exception as error:  # noqa: BLE001 - the run has ended meanwhile, or its process
                log.info("prompt %s of run %s: %s", prompt.number, run_id, error)

    def _obey(self, run_id: int, prompt: Prompt) -> None:
        assert self.operator is not None, "it is automatic"
        try:
            obey(self.operator, prompt)
            if prompt.waits:
                self._ask(AnswerPrompt(run_id=run_id, prompt=prompt.number, lease=self._lease()))
        except Exception as error:
            if not isinstance(error, RigError):
                log.exception("the automatic operator failed at prompt %s", prompt.number)
            self._ask(FailPrompt(run_id=run_id, prompt=prompt.number, reason=failure_reason(error, (RigError,))))
