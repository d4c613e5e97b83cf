"""Following a run at the terminal: what happens is shown at once, also while the operator is asked for something."""

import logging
import time
from contextlib import suppress

from api.commands.console import PlainConsole
from jointlab.drive.endpoint import NoDriveError
from jointlab.drive.events import PromptKind, RunEnded
from jointlab.drive.journal import event_of
from jointlab.drive.phase import Phase
from jointlab.drive.prompts import Prompt
from jointlab.errors import ConflictError
from jointlab.supervision.automatic_operator import obey
from jointlab.supervision.manager import REST_TIMEOUT, RunManager
from rig.errors import RequestError, RigError
from rig.events import Observer
from rig.operator import Operator
from store.provenance import who_is_here

FOLLOW_INTERVAL = 0.1  # s between two looks
LOST_TIMEOUT = 30.0  # s for which no drive process may answer; then nothing is waited for any more
log = logging.getLogger(__name__)


class RunFollower:
    """Shows what happens at the rig from its making on, and lets an operator obey the prompts of one run.

    Args:
        observer: gets every event.
        console: for what is no event: a drive process that is lost.

    Raises:
        NoDriveError: the drive process does not answer.
    """

    def __init__(self, rig: RunManager, observer: Observer, console: PlainConsole) -> None:
        self._rig = rig
        self._observer = observer
        self._console = console
        self._epoch = rig.journal.epoch
        self._after = rig.latest_event()  # runs before this one may be unknown here yet
        self._run_id: int | None = None
        self._asked: Prompt | None = None  # what the operator does at present
        self._lost_at: float | None = None
        self._has_ended = False

    def follow(self, run_id: int, operator: Operator) -> None:
        """Show what happens and let the operator obey prompts, until run `run_id` has ended; an error here ends it.

        Raises:
            NoDriveError: the drive process is lost, and with it the run.
            RigError: the operator could not obey.
        """
        self._run_id = run_id
        obeyed: int | None = None  # number of the last prompt
        try:
            while not self._has_ended:
                self.look()
                prompt = self._rig.prompt
                if prompt is not None and prompt.number != obeyed and self._rig.state.run_id == run_id:
                    obeyed = prompt.number
                    self._obey(run_id, operator, prompt)
        except NoDriveError:
            raise
        except BaseException:
            with suppress(RigError, ConflictError):  # it has ended, or its process; the error says what came first
                self._rig.end_run(run_id, who_is_here())
                self._rig.wait(REST_TIMEOUT)  # the catalogue knows its end before this program leaves
            raise

    def look(self) -> None:
        """Show what has happened; waits a moment for it. An operator who waits for a person calls it again and again.

        Raises:
            ConflictError: what the operator was asked for was taken back.
            NoDriveError: the drive process is lost, and with it the run.
        """
        entries = self._rig.journal.wait(self._after, FOLLOW_INTERVAL)
        if self._rig.journal.epoch != self._epoch:
            raise NoDriveError(
                f"the drive process has ended, and another one has taken its place: run {self._run_id} was cut off"
            )
        for entry in entries:
            self._after = entry.number
            event = event_of(entry)
            self._observer(event)
            if isinstance(event, RunEnded):
                self._has_ended = True
                break  # what follows is not of this run
        self._check_drive()
        if self._asked is not None:
            open_now = self._rig.prompt
            if self._has_ended or open_now is None or open_now.number != self._asked.number:
                raise ConflictError(f"prompt {self._asked.number} was withdrawn")

    def _check_drive(self) -> None:
        state = self._rig.state
        if state.phase is not Phase.UNKNOWN:
            self._lost_at = None
            return
        if self._lost_at is None:
            self._lost_at = time.monotonic()
            self._console.print(f"the drive process is lost ({state.tester_silent}); keep away from the machine")
        if time.monotonic() - self._lost_at > LOST_TIMEOUT:
            raise NoDriveError(
                f"no drive process has answered for {LOST_TIMEOUT:g} s ({state.tester_silent}): run {state.run_id} is "
                "lost; look at the machine before going near"
            )

    def _obey(self, run_id: int, operator: Operator, prompt: Prompt) -> None:
        self._asked = prompt if prompt.waits else None
        try:
            if prompt.waits and prompt.kind in (PromptKind.STRIKE, PromptKind.POINTS):
                operator.do_task(prompt.text)  # a simulated bench does it when a person says so
            else:
                obey(operator, prompt)
            if prompt.waits:
                self._rig.answer(run_id, prompt.number)
        except RequestError as error:
            self._rig.fail_prompt(run_id, prompt.number, str(error))
        except ConflictError:
            log.info("prompt %s was withdrawn meanwhile", prompt.number)
        finally:
            self._asked = None
