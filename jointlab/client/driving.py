"""Driving the rig: the control lease, held while a context lasts, and the requests that need it."""

import logging
import threading

from jointlab.client.connection import Connection, ProblemError
from jointlab.documents.commissioning import ExaminationDocument, ExaminationRequest
from jointlab.documents.rig import LeaseDocument, RigDocument
from jointlab.documents.runs import Acknowledged, RunSummary

log = logging.getLogger(__name__)
PATIENCE = 150.0
"""Seconds that the instruments may take for what they are asked for, and a little more: 120 s to begin a run."""


class Driver:
    """The holder of the control lease, which is renewed in the background until the context is left."""

    def __init__(self, connection: Connection, holder: str, *, by_force: bool = False) -> None:
        self._connection = connection
        self._lease = connection.post(LeaseDocument, "/rig/lease", {"holder": holder, "by_force": by_force})
        self._header = {"Control-Lease": self._lease.token}
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._renew, name="control lease", daemon=True)
        self._thread.start()

    def start(
        self, run: int, *, automatic: bool = False, reset: bool = False, seen: RigDocument | None = None
    ) -> RunSummary:
        """Begin a run that was created; returns when it is under way.

        Args:
            run: its number.
            automatic: let a simulated bench strike and mount without prompts.
            reset: reset a tripped tester, because the cause is removed.
            seen: the state of the rig when this was decided; None: it is asked for now. STOP since then refuses it.

        Raises:
            ProblemError: the service says why not.
        """
        stop_epoch = self._seen(seen).stop_epoch
        return self._post(f"/runs/{run}/start", {"automatic": automatic, "reset": reset, "stop_epoch": stop_epoch})

    def pause(self, run: int) -> RunSummary:
        """Pause the run; returns with an actuator that it drives at rest."""
        return self._post(f"/runs/{run}/pause")

    def resume(
        self, run: int, *, automatic: bool | None = None, reset: bool = False, seen: RigDocument | None = None
    ) -> RunSummary:
        """Continue a run that was paused, stopped, failed or cut off; by default with its former operator.

        Args:
            run, reset: as for `start`.
            automatic: as for `start`; None: as before.
            seen: as for `start`; a further pause since then refuses it, too.

        Raises:
            ProblemError: the service says why not.
        """
        rig = self._seen(seen)
        body: dict[str, object] = {"automatic": automatic, "reset": reset}
        body |= {"stop_epoch": rig.stop_epoch, "pause": rig.pause}
        return self._post(f"/runs/{run}/resume", body)

    def answer(self, run: int, prompt: int) -> RunSummary:
        """Confirm that the operator has done what `prompt` asked for."""
        return self._post(f"/runs/{run}/answer", {"prompt": prompt})

    def acknowledge_interlock(self, run: int, reason: str) -> list[str]:
        """Reset the tester that had tripped, because the cause is removed; which interlocks had tripped."""
        path = f"/runs/{run}/acknowledge-interlock"
        return self._connection.post(Acknowledged, path, {"reason": reason}, self._header, PATIENCE).interlocks

    def examine(self, asked: ExaminationRequest) -> ExaminationDocument:
        """Examine the rig, and sign what was found; nothing is carried out meanwhile."""
        body = asked.model_dump(mode="json")
        return self._connection.post(ExaminationDocument, "/examinations", body, self._header, PATIENCE)

    def reset_stop(self) -> None:
        """Release the STOP that is in force, after its cause is removed; nothing moves by this."""
        stop = self._connection.get(RigDocument, "/rig").stop
        if stop is not None:
            self._connection.request("POST", "/rig/reset-stop", body={"epoch": stop.epoch}, headers=self._header)

    def give_back(self) -> None:
        """Give the lease back."""
        self._ended.set()
        self._thread.join()
        try:
            self._connection.request("DELETE", "/rig/lease", headers=self._header)
        except ProblemError as problem:
            if problem.status != 409:
                raise
            log.info("the control lease had ended before it was given back")

    def _seen(self, seen: RigDocument | None) -> RigDocument:
        return self._connection.get(RigDocument, "/rig") if seen is None else seen

    def _post(self, path: str, body: dict[str, object] | None = None) -> RunSummary:
        return self._connection.post(RunSummary, path, body, self._header, PATIENCE)

    def _renew(self) -> None:
        while not self._ended.wait(self._lease.seconds / 3):
            try:
                self._connection.request("PUT", "/rig/lease", headers=self._header)
            except ProblemError as problem:
                # the next request that drives fails, with the reason; nobody would catch an exception here
                log.warning("the control lease could not be renewed: %s", problem)
