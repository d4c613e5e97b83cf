"""Documents on the laboratory: its service, instruments, channels and specimens."""

from datetime import date, datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from jointlab.documents.fields import OneLine, Request
from store.quantity import quantity


class Health(BaseModel):
    """Whether the service can do its work, and which version it is; `impairments` says what it cannot do, and why."""

    status: Literal["ok", "impaired"]
    impairments: tuple[str, ...] = ()
    version: str
    drives_a_rig: bool


class Alive(BaseModel):
    """The service is alive: its event loop answers. It may be unable to work."""

    status: Literal["alive"] = "alive"
    version: str


class Ready(BaseModel):
    """The service can do its work: database, drive process, executor of jobs and disks answer."""

    status: Literal["ready"] = "ready"
    version: str


class InstrumentDocument(BaseModel):
    """An instrument, known by its serial number."""

    id: int
    kind: str
    model: str
    serial: str
    details: dict[str, Any]


class CalibrationDocument(BaseModel):
    """One calibration, as its certificate gives it."""

    id: int
    instrument_id: int
    calibrated_on: date | None
    sensitivity: float | None = Field(description="in `sensitivity_unit`")
    sensitivity_unit: str | None
    uncertainty: Annotated[float | None, quantity("1", "of the sensitivity, relative, expanded (k = 2)")]
    certificate: str | None = Field(description="its number")
    due_on: date | None = Field(description="day until which it is valid")
    stored_at: datetime


class NewCalibration(Request):
    """What a certificate says."""

    calibrated_on: date
    sensitivity: float = Field(gt=0, description="in `sensitivity_unit`")
    sensitivity_unit: OneLine
    uncertainty: Annotated[float | None, quantity("1", "relative, expanded (k = 2)", gt=0, lt=1)] = None
    certificate: OneLine | None = Field(default=None, description="its number")
    due_on: date | None = Field(default=None, description="day until which it is valid")


class ChannelDocument(BaseModel):
    """One input channel, its sensor, and when that was calibrated."""

    name: str
    physical: str = Field(description="NI-DAQmx physical channel, such as cDAQ1Mod1/ai0")
    kind: str
    unit: str = Field(description="of minimum and maximum")
    sensitivity: float = Field(description="V for each `unit`; V/V of a bridge, C of a charge")
    minimum: float = Field(description="lowest value expected, in `unit`")
    maximum: float = Field(description="highest value expected, in `unit`")
    excitation_current: Annotated[float | None, quantity("A", "IEPE supply")]
    polarity: int | None = Field(
        description="1, or -1 where the sensor gives a negative voltage for a positive quantity; null in older runs"
    )
    serial: str
    calibrated_on: date | None
    uncertainty: Annotated[float | None, quantity("1", "of the sensitivity, relative, expanded (k = 2)")]
    certificate: str | None = Field(description="number of the calibration certificate")
    due_on: date | None = Field(description="day until which the calibration is valid")


class SpecimenDocument(BaseModel):
    """The cylinders of one joint; `name` is the joint's."""

    id: int
    article: str
    name: str
    description: str | None
