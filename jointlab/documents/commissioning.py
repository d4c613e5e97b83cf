"""Documents on examinations of the rig."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, Field

from jointlab.documents.fields import OneLine, Request
from rig.checks.check import CheckState, Place
from store.quantity import quantity
from store.states import Verdict


class CheckDocument(BaseModel):
    """One check of an examination."""

    id: str
    subject: str = Field(description="the channel or instrument")
    state: CheckState
    measured: float | str | None = Field(description="in `unit`, or as a text; null where nothing was")
    limit: float | str | None = Field(description="what it was compared with, alike")
    unit: str = Field(description="of both; empty for texts and ratios")
    advice: str = Field(description="what to do; empty where it was passed")


class ExaminedInstrument(BaseModel):
    """An instrument that an examination was made with."""

    kind: str
    model: str
    serial: str
    sensitivity: float | None = Field(description="in the channel table, V for each unit of the channel")


class ExaminationDocument(BaseModel):
    """A commissioning record: an examination of a rig, and who answers for it."""

    id: int
    rig: str
    place: Place = Field(description="where the sensors were")
    who: str
    verdict: Verdict
    checks: list[CheckDocument]
    instruments: list[ExaminedInstrument]
    created_at: datetime
    checksum: str = Field(description="over all of it, as the audit log has it, too")


class ExaminationRequest(Request):
    """A request to examine the rig."""

    place: Place = Field(default=Place.BENCH, description="where the sensors are")
    trip: bool = Field(
        default=False, description="trip watchdog and emergency stop, with hydraulics on: the machine is clear"
    )
    hammer: OneLine = Field(default="hammer", description="name of its channel")
    accelerometer: OneLine = Field(default="accelerometer", description="name of its channel")
    mass: Annotated[float | None, quantity("kg", "that hangs with the accelerometer and is struck", gt=0, le=1000)] = (
        None
    )
