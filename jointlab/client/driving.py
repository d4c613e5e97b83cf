"""Driving the rig: the control lease, held for as long as a context lasts, and what needs it."""

from __future__ import annotations

import logging
import threading

from jointlab.client.connection import Connection, ProblemError
from jointlab.documents.rig import LeaseDocument
from jointlab.documents.runs import Acknowledged, RunSummary

log = logging.getLogger(__name__)


class Driver:
    """Whoever has the control lease. It is renewed in the background, and given back when the context is left."""

    def __init__(self, connection: Connection, holder: str, *, by_force: bool = False) -> None:
        self._connection = connection
        self._lease = connection.post(LeaseDocument, "/rig/lease", {"holder": holder, "by_force": by_force})
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._keep, name="control lease", daemon=True)
        self._thread.start()

    def start(self, run: int, *, automatic: bool = False, reset: bool = False) -> RunSummary:
        """Begin a run that was created; returns when it is under way.

        Args:
            run: its number.
            automatic: let a simulated bench strike and mount without prompts.
            reset: reset a tripped tester, because the cause is removed.

        Raises:
            ProblemError: the service says why not.
        """
        return self._post(f"/runs/{run}/start", {"automatic": automatic, "reset": reset})

    def pause(self, run: int) -> RunSummary:
        """Hold the run where it is; returns with the actuator at rest."""
        return self._post(f"/runs/{run}/pause")

    def resume(self, run: int, *, automatic: bool = False, reset: bool = False) -> RunSummary:
        """Let a run go on that was paused, stopped, failed or cut off."""
        return self._post(f"/runs/{run}/resume", {"automatic": automatic, "reset": reset})

    def answer(self, run: int, prompt: int) -> RunSummary:
        """What the operator was asked for by `prompt` is done."""
        return self._post(f"/runs/{run}/answer", {"prompt": prompt})

    def acknowledge_interlock(self, run: int, reason: str) -> list[str]:
        """Reset the tester that had tripped, because the cause is removed; which interlocks had tripped."""
        path = f"/runs/{run}/acknowledge-interlock"
        headers = {"Control_Lease": self._lease.token}
        return self._connection.post(Acknowledged, path, {"reason": reason}, **headers).interlocks

    def give_back(self) -> None:
        """Drive no more."""
        self._ended.set()
        self._thread.join()
        try:
            self._connection.request("DELETE", "/rig/lease", headers={"Control-Lease": self._lease.token})
        except ProblemError as problem:
            if problem.status != 409:
                raise
            log.info("the control lease had ended before it was given back")

    def _post(self, path: str, body: dict[str, object] | None = None) -> RunSummary:
        return self._connection.post(RunSummary, path, body, Control_Lease=self._lease.token)

    def _keep(self) -> None:
        while not self._ended.wait(self._lease.seconds / 3):
            try:
                self._connection.request("PUT", "/rig/lease", headers={"Control-Lease": self._lease.token})
            except ProblemError as problem:
                # whatever drives next will be told; here nobody would hear an exception
                log.warning("the control lease could not be renewed: %s", problem)
