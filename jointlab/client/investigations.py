"""Requests for investigations of a gap."""

import time
from collections.abc import Iterator

from jointlab.client.connection import POLL_INTERVAL, Connection
from jointlab.documents.investigations import InvestigationDocument, InvestigationSummary
from rig.sequences.sequence import Sequence
from store.states import InvestigationState


class InvestigationRequests:
    """Investigations: begin, answer, continue, stop."""

    _connection: Connection

    def investigations(self, run: int | None = None) -> Iterator[InvestigationSummary]:
        """Investigations, those begun last first: all, or those of one run."""
        return self._connection.pages(InvestigationSummary, "/investigations", run=run)

    def investigate(
        self, run: int, *, minutes: float | None = None, experiments: int | None = None, certain: float | None = None
    ) -> InvestigationDocument:
        """Begin an investigation of the gap of a run; it moves no machine by itself.

        Args:
            run: its number.
            minutes: of rig time in all; 240 by default.
            experiments: that are carried out at most; 3 by default.
            certain: probability of the verdict at which it ends; 0.95 by default.
        """
        body = {"run": run} | _budget(minutes, experiments, certain)
        return self._connection.post(InvestigationDocument, "/investigations", body)

    def investigation(self, investigation: int) -> InvestigationDocument:
        """One investigation."""
        return self._connection.get(InvestigationDocument, f"/investigations/{investigation}")

    def wait_for_investigation(self, investigation: int) -> InvestigationDocument:
        """Wait until an investigation has diagnosed: it then waits for an answer, or has ended in any way."""
        while (found := self.investigation(investigation)).state is InvestigationState.WORKING:
            time.sleep(POLL_INTERVAL)
        return found

    def investigation_sequence(self, investigation: int) -> Sequence:
        """The sequence of the experiment that an investigation asks for; `create_run` takes it."""
        return self._connection.get(Sequence, f"/investigations/{investigation}/sequence")

    def answer_investigation(
        self,
        investigation: int,
        *,
        run: int | None = None,
        readings: dict[str, float] | None = None,
        refusal: str | None = None,
    ) -> InvestigationDocument:
        """Answer what an investigation asks for; all data are then diagnosed again.

        Args:
            investigation: its number.
            run: with the data that were asked for.
            readings: by name, each in the unit that was asked for.
            refusal: why the experiment cannot be made.

        Raises:
            ProblemError: it waits for no answer, or for another one; not exactly one answer is given.
        """
        given = {"run": run, "readings": readings, "refusal": refusal}
        body = {name: value for name, value in given.items() if value is not None}
        return self._connection.post(InvestigationDocument, f"/investigations/{investigation}/answer", body)

    def continue_investigation(
        self,
        investigation: int,
        *,
        minutes: float | None = None,
        experiments: int | None = None,
        certain: float | None = None,
    ) -> InvestigationDocument:
        """Go on with an investigation that was stopped, has failed or, with a larger budget, has spent its budget."""
        body = _budget(minutes, experiments, certain)
        return self._connection.post(InvestigationDocument, f"/investigations/{investigation}/continue", body)

    def stop_investigation(self, investigation: int) -> InvestigationDocument:
        """Stop an investigation; one that has ended stays as it is."""
        return self._connection.post(InvestigationDocument, f"/investigations/{investigation}/stop")


def _budget(minutes: float | None, experiments: int | None, certain: float | None) -> dict[str, float]:
    given = {"minutes": minutes, "experiments": experiments, "certain": certain}
    return {name: value for name, value in given.items() if value is not None}
