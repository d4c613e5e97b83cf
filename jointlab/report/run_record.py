"""Who measured a run, with which instruments, and its conclusions, for its report."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from jointlab.diagnosis.save import newest_diagnosis
from rig.checks.check import Place
from store.catalogue import Catalogue
from store.instrument import Instrument, StoredChannel
from store.measurements.amendments import Amendment, list_amendments
from store.measurements.instruments import list_channels, list_instruments
from store.measurements.runs import Run, get_run, list_run_events
from store.measurements.specimens import list_specimens
from store.service.commissioning import CommissioningRecord, list_commissioning_records
from store.states import RunState

EXAMINATIONS = 1000
"""Examinations of a rig that are searched for the last one before a run."""


@dataclass(frozen=True)
class RunRecord:
    """The stored data of a run other than its measurement.

    Attributes:
        who: began and resumed it, each once; who has stopped it has not measured it.
        descriptions: of specimens, by joint, where there are any.
        examination: of the rig, the last one on its bench before the run began; None where there is none.
        amendments: of its set-up, oldest first; the last one is in force.
        diagnosis: the newest one, in the format jointlab-diagnosis/1, or None.
        diagnosis_number: of it, or None.
    """

    run: Run
    who: tuple[str, ...]
    channels: tuple[StoredChannel, ...]
    instruments: tuple[Instrument, ...]
    descriptions: Mapping[str, str]
    examination: CommissioningRecord | None
    amendments: tuple[Amendment, ...]
    diagnosis: Mapping[str, Any] | None
    diagnosis_number: int | None

    @property
    def calibrated(self) -> tuple[tuple[str, Instrument], ...]:
        """Every instrument with what it is used for: the name of its channel, or its kind."""
        on_channels = ((each.name, each.instrument) for each in self.channels)
        return (*on_channels, *((each.kind, each) for each in self.instruments))


def read_run_record(catalogue: Catalogue, run_id: int) -> RunRecord:
    """Read the record of a run.

    Raises:
        StoreError: there is no such run, or the database cannot be read.
    """
    diagnosis = newest_diagnosis(catalogue, run_id)
    with catalogue.reading() as session:
        run = get_run(session, run_id)
        examined = (
            list_commissioning_records(session, rig=run.rig, place=Place.BENCH, limit=EXAMINATIONS) if run.rig else []
        )
        return RunRecord(
            run=run,
            who=tuple(
                dict.fromkeys(
                    event.who
                    for event in list_run_events(session, run_id)
                    if event.who and event.state in (RunState.CREATED, RunState.RUNNING)
                )
            ),
            channels=tuple(list_channels(session, run_id)),
            instruments=tuple(list_instruments(session, run_id)),
            descriptions={
                each.name: each.description
                for each in list_specimens(session, article=run.article)
                if each.description is not None
            },
            examination=next((each for each in examined if each.created_at <= run.started_at), None),
            amendments=tuple(list_amendments(session, run_id)),
            diagnosis=None if diagnosis is None else diagnosis.document,
            diagnosis_number=None if diagnosis is None else diagnosis.analysis_id,
        )
