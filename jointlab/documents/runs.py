"""Documents on sequences and runs, and on the blows and sines that a run recorded."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, Field

from jointlab.documents.fields import LARGEST_EXACT, AnySequence, OneLine, Request
from rig.sequences.sequence import Sequence
from store.quantity import quantity
from store.states import RunState


class SequenceSummary(BaseModel):
    """A sequence's name, and when it was changed."""

    name: str
    title: str
    built_in: bool = Field(description="whether it comes with the program; such a one is neither changed nor deleted")
    changed_at: datetime | None = Field(description="null where it is built in")


class NamedSequence(BaseModel):
    """A sequence and its name."""

    name: str
    sequence: Sequence


class RunSummary(BaseModel):
    """One run; times are UTC."""

    id: int
    kind: str
    state: RunState
    title: str
    article: str
    started_at: datetime | None = Field(description="null where it has not begun")
    finished_at: datetime | None
    reason: str | None = Field(description="why it was stopped or failed; of a finished run, what was left out of it")
    configuration_hash: str
    software_version: str
    rig: str | None = Field(description="on which it is measured; null for an import")


class RunDetails(RunSummary):
    """One run with its article and its sequence."""

    setup: dict[str, object] = Field(description="as a bundle's setup.json has it, as it was amended last")
    setup_version: int = Field(description="1 as measured, one more with each amendment")
    sequence: dict[str, object] = Field(description="as it is carried out; empty where the run was imported")


class NewAmendment(Request):
    """Values of a run's article that were wrong, and why."""

    article: dict[str, object] = Field(
        min_length=1, description='only what changes, such as {"beam": {"length": 0.914}}; a list is whole'
    )
    reason: OneLine


class AmendmentDocument(BaseModel):
    """A version of a run's setup; times are UTC."""

    version: int = Field(description="from 2; the run was measured with version 1")
    setup: dict[str, object] = Field(description="whole, as a bundle's setup.json has it")
    reason: str
    who: str
    created_at: datetime


class RunEventDocument(BaseModel):
    """A change of a run's state; times are UTC."""

    state: RunState
    reason: str | None
    who: str | None
    happened_at: datetime


class NewRun(Request):
    """What is to be measured."""

    sequence: AnySequence = Field(description="name of a stored sequence, or a whole one")


class Beginning(Request):
    """How a run begins or goes on."""

    automatic: bool | None = Field(
        default=None,
        description="let the automatic operator of a simulated bench strike and mount, without prompts; null: not at a "
        "start, and as it was begun where a run is resumed",
    )
    reset: bool = Field(default=False, description="reset a tripped tester, because the cause has been removed")
    stop_epoch: int | None = Field(
        default=None,
        ge=0,
        le=LARGEST_EXACT,
        description="`stop_epoch` of the rig when this was decided: a STOP since then refuses the request, however "
        "late it arrives; null: one from its arrival on",
    )


class Continuation(Beginning):
    """How a run goes on."""

    pause: int | None = Field(
        default=None,
        ge=0,
        le=LARGEST_EXACT,
        description="`pause` of the rig, for a run that is paused: no other pause is ended; null: the run has ended",
    )


class PromptAnswer(Request):
    """The operator has done what a prompt asked for."""

    prompt: int = Field(ge=1, le=LARGEST_EXACT, description="number of the prompt")


class Acknowledged(BaseModel):
    """Interlocks of the tester that were reset; none where none had tripped."""

    interlocks: list[str]


class PointDocument(BaseModel):
    """A point struck in a set, and how many of its blows were accepted and refused."""

    set_number: int
    point: str = Field(description="node and direction, such as 3y")
    accepted: int
    refused: int


class BlowDocument(BaseModel):
    """One blow, accepted or refused with its reason; times are UTC."""

    id: int
    set_number: int
    point: str
    number: int = Field(description="counts the blows at the point, refused ones too, from 1")
    accepted: bool
    reason: str | None
    peak_force: Annotated[float | None, quantity("N")]
    temperature_c: Annotated[float | None, quantity("degC")]
    struck_at: datetime | None
    has_waveform: bool


class SineRecordDocument(BaseModel):
    """One steady sine of the tester as it was recorded; times are UTC."""

    id: int
    order_number: int = Field(description="the order of measuring, from 1")
    specimen: str
    configuration: str
    commanded_pp_mm: Annotated[float, quantity("mm", "peak to peak")]
    reached_pp_mm: Annotated[float | None, quantity("mm", "peak to peak")]
    frequency: Annotated[float, quantity("Hz", "as planned")]
    driven_frequency: Annotated[
        float | None, quantity("Hz", "of the motion, where that was beside a multiple of the mains")
    ]
    elapsed: Annotated[float, quantity("s", "since the run began")]
    recorded_at: datetime | None
    temperature_c: Annotated[float | None, quantity("degC")]
    has_waveform: bool


class Trace(BaseModel):
    """What one channel recorded, in its unit."""

    name: str
    unit: str
    values: list[float]


class WaveformDocument(BaseModel):
    """One record of all channels on one clock, verified against its checksum."""

    sample_rate: Annotated[float, quantity("Hz", "of the samples given here")]
    started_at: datetime | None
    trigger_index: int | None = Field(description="of the first sample given here that is not before the trigger")
    overloaded: list[str]
    traces: list[Trace]
