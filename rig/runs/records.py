"""What a run is asked to do (`RunOrder`), and the records that it writes. Plain values, without a database."""

from dataclasses import dataclass
from datetime import datetime
from typing import Literal, Protocol

from rig.runs.completed_points import NOTHING_COMPLETED, CompletedPoints
from rig.sequences.sequence import Sequence
from store.instrument import Instrument, StoredChannel
from store.states import RunState
from store.waveforms.waveform import Waveform


@dataclass(frozen=True)
class BegunWith:
    """The instruments that a resumed run began with.

    Attributes:
        started_at: UTC.
        channels, instruments: with which it began; the same must be connected.
        reason: why it goes on, for its history.
    """

    started_at: datetime
    channels: tuple[StoredChannel, ...]
    instruments: tuple[Instrument, ...]
    reason: str


@dataclass(frozen=True)
class RunOrder:
    """One run to begin or to resume. It has a JSON form: `pydantic.TypeAdapter(RunOrder)`.

    Attributes:
        waveform_file: name of its waveform file, which no run of another database has.
        sequence: the whole sequence, with its seed drawn.
        who: for the history of the run.
        completed: what is measured already.
        begun_with: of a run that is resumed; None for a run that begins.
        planned: whether the run stays in the catalogue even if it does not begin.
        reset: whether to reset the tester first, because the cause of its trip is removed.
    """

    run_id: int
    waveform_file: str
    sequence: Sequence
    who: str
    completed: CompletedPoints = NOTHING_COMPLETED
    begun_with: BegunWith | None = None
    planned: bool = True
    reset: bool = False


@dataclass(frozen=True)
class ResetRecord:
    """The tester was asked to reset before the run: `outcome` is "done", or the message of its refusal."""

    at: datetime
    who: str
    interlocks: tuple[str, ...]
    outcome: str
    kind: Literal["reset"] = "reset"


@dataclass(frozen=True)
class BeginRecord:
    """The run begins, or goes on: every instrument has answered. `reason` is for its history."""

    at: datetime
    who: str
    channels: tuple[StoredChannel, ...]
    instruments: tuple[Instrument, ...]
    reason: str | None
    kind: Literal["begin"] = "begin"


@dataclass(frozen=True)
class BlowRecord:
    """One blow, accepted or refused; its waveform goes with it.

    Attributes:
        point: such as 3y.
        number: counts the blows at the point in this set, from 1.
        reason: why it was refused; None where it counts.
        peak_force: N.
        struck_at: UTC.
    """

    set_number: int
    point: str
    number: int
    accepted: bool
    reason: str | None
    peak_force: float
    temperature_c: float
    struck_at: datetime
    kind: Literal["blow"] = "blow"


@dataclass(frozen=True)
class SinePointRecord:
    """One sine point; its waveform goes with it. Fields as those of `store.measurements.sine_records.SineRecord`."""

    order_number: int
    specimen: str
    configuration: str
    commanded_pp_mm: float
    reached_pp_mm: float
    frequency: float
    elapsed: float
    recorded_at: datetime
    temperature_c: float
    driven_frequency: float | None = None
    kind: Literal["sine"] = "sine"


@dataclass(frozen=True)
class EndRecord:
    """The run has ended; a run that was stopped or failed has a reason.

    Attributes:
        who: the person who stopped it; None where it ended without one.
        by_itself: whether it ended early without the request of a person.
    """

    at: datetime
    who: str | None
    state: RunState
    reason: str | None
    by_itself: bool = False
    kind: Literal["end"] = "end"


Record = ResetRecord | BeginRecord | BlowRecord | SinePointRecord | EndRecord


class RunRecords(Protocol):
    """Destination of the records of one run."""

    def write(self, record: Record, waveform: Waveform | None = None) -> None:
        """Store a record, with the waveform of a blow or sine point; it is stored when this returns.

        Raises StoreError where it could not be stored.
        """
