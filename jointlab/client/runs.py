"""Requests for runs, and for what they recorded."""

import time
from collections.abc import Iterator
from datetime import date
from typing import Any

from jointlab.client.connection import POLL_INTERVAL, Connection
from jointlab.documents.runs import (
    AmendmentDocument,
    BlowDocument,
    RunDetails,
    RunSummary,
    SineRecordDocument,
    WaveformDocument,
)
from rig.sequences.sequence import Sequence
from store.states import RunState


class RunRequests:
    """Runs, their blows and sine records, and corrections of their article."""

    _connection: Connection

    def runs(
        self,
        state: RunState | None = None,
        article: str | None = None,
        since: date | None = None,
        until: date | None = None,
        specimen: str | None = None,
    ) -> Iterator[RunSummary]:
        """Runs, newest first; those that began from one day (UTC) to another, both included."""
        days = {name: day.isoformat() for name, day in (("since", since), ("until", until)) if day is not None}
        return self._connection.pages(RunSummary, "/runs", state=state, article=article, specimen=specimen, **days)

    def run(self, run: int) -> RunDetails:
        """One run."""
        return self._connection.get(RunDetails, f"/runs/{run}")

    def create_run(self, sequence: str | Sequence | dict[str, Any]) -> RunSummary:
        """Store a run to be started later; `sequence` is the name of a stored one, or a whole one."""
        given = sequence.model_dump(mode="json") if isinstance(sequence, Sequence) else sequence
        return self._connection.post(RunSummary, "/runs", {"sequence": given})

    def wait_for_run(self, run: int, timeout: float | None = None) -> RunDetails:
        """Wait while a run is under way; one that has not begun is returned at once.

        A run whose process was lost stays `running` until it is resumed, so give a timeout where nobody looks on.

        Args:
            run: its number.
            timeout: s; None for no end.

        Raises:
            TimeoutError: the run is still under way.
        """
        ends = None if timeout is None else time.monotonic() + timeout
        while (found := self.run(run)).state is RunState.RUNNING:
            if ends is not None and time.monotonic() > ends:
                raise TimeoutError(f"run {run} is still running after {timeout:g} s")
            time.sleep(POLL_INTERVAL)
        return found

    def blows(self, run: int, accepted: bool | None = None) -> Iterator[BlowDocument]:
        """Blows of a run, in the order of measuring."""
        return self._connection.pages(BlowDocument, f"/runs/{run}/blows", accepted=accepted, limit=1000)

    def sine_records(self, run: int) -> Iterator[SineRecordDocument]:
        """Sine records of a run, in the order of measuring."""
        return self._connection.pages(SineRecordDocument, f"/runs/{run}/sine-records", limit=1000)

    def withdraw_blow(self, blow: int, reason: str) -> BlowDocument:
        """Withdraw an accepted blow; a hammer session that still lasts repeats its point."""
        return self._connection.post(BlowDocument, f"/blows/{blow}/withdraw", {"reason": reason})

    def blow_waveform(self, blow: int) -> WaveformDocument:
        """The records of a blow."""
        return self._connection.get(WaveformDocument, f"/blows/{blow}/waveform")

    def amend(self, run: int, article: dict[str, object], reason: str) -> AmendmentDocument:
        """Correct values of a run's article, such as ``{"beam": {"length": 0.914}}``; earlier results stay.

        Raises:
            ProblemError: the service says why not.
        """
        body = {"article": article, "reason": reason}
        return self._connection.post(AmendmentDocument, f"/runs/{run}/amendments", body)
