"""Documents on the rig: its state, its control lease and its limits."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, Field, model_validator

from jointlab.documents.fields import LARGEST_EXACT, OneLine, Request
from jointlab.drive.phase import Phase
from store.quantity import quantity


class PromptDocument(BaseModel):
    """What the operator is asked to do."""

    number: int
    kind: str
    text: str
    waits: bool = Field(description="whether the run waits for the answer")


class StopDocument(BaseModel):
    """A STOP that is in force: nothing moves until it is reset."""

    epoch: int = Field(description="its number, to reset it with")
    who: str
    why: str


class HallRigState(BaseModel):
    """What the drive process of a rig says of its machine."""

    phase: Phase
    run_id: int | None = Field(description="the run that is carried out, or was last")
    activity: str
    reason: str | None = Field(
        description="why the last run ended, or what was left out of it; null while one is carried out"
    )
    interlocks: list[str] = Field(description="of the tester, that stopped it and were not acknowledged")
    tripped: bool = Field(
        description="whether something has stopped the tester that was not acknowledged, also where it names no "
        "interlock"
    )
    tester_silent: str | None = Field(
        description="why the tester does not answer while nothing is carried out; null where it does"
    )
    rest_unknown: str | None = Field(
        description="why the actuator may move although no run drives it, or a stop of it was not confirmed; null "
        "where it was seen at rest since"
    )
    is_driven: bool = Field(
        description="whether a tester is driven from here; where none is, nothing is known of a machine's rest"
    )
    stop: StopDocument | None = Field(description="the STOP that is in force; null where there is none")


class RigDocument(HallRigState):
    """The state of the rig."""

    title: str
    point: str | None = Field(description="that is struck, such as 3y; null while none is")
    blows: int
    blows_wanted: int
    sines: int
    sines_wanted: int
    ended_as: str | None = Field(description="how the last run ended; created where it did not begin")
    pressure: bool | None = Field(
        description="whether hydraulics are on while the run is paused; null where it does not drive the tester then"
    )
    pause: int | None = Field(description="number of the pause in force, to resume with; null where there is none")
    stop_epoch: int | None = Field(
        description="number of the last STOP, reset or not; a run is started and resumed with it. Null where it is not "
        "known"
    )
    prompt: PromptDocument | None
    driven_by: str | None = Field(description="who has the control lease")
    latest_event: int = Field(description="number of the latest event")


class HallRigDocument(BaseModel):
    """A rig of the hall."""

    rig: str
    page: str | None = Field(description="of its own service, where it is driven from")
    state: HallRigState | None = Field(
        description="null where its drive process does not answer: what the machine does is not known then"
    )
    trouble: str | None = Field(description="why its drive process does not answer; null where it does")
    heard_at: datetime | None = Field(description="its last answer; null where there was none since the service began")


class RigStopped(BaseModel):
    """A rig of the hall was stopped; an actuator that it drives is at rest. STOP is in force until reset at the rig."""

    rig: str
    detail: str


class LeaseRequest(Request):
    """A request for the control lease."""

    holder: OneLine = Field(description="to be shown to others")
    by_force: bool = Field(
        default=False,
        description="take it over: from another client of the same key, or with the scope engineer from anybody, "
        "also of another program",
    )


class LeaseDocument(BaseModel):
    """The right to drive: `token` goes into the header `Control-Lease` of every request that drives."""

    token: str
    holder: str
    seconds: Annotated[float, quantity("s", "until it ends unless it is renewed")]


class Limits(Request):
    """Limits of commands to the tester and of its readings. The tester has limits of its own beside these."""

    amplitude_pp: Annotated[float, quantity("m", "largest peak-to-peak amplitude"), Field(gt=0)]
    lowest_frequency: Annotated[float, quantity("Hz"), Field(gt=0)]
    highest_frequency: Annotated[float, quantity("Hz"), Field(gt=0)]
    lowest_preset: Annotated[float, quantity("m")]
    highest_preset: Annotated[float, quantity("m")]
    velocity: Annotated[float, quantity("m/s", "highest peak velocity of a cycle"), Field(gt=0)]
    acceleration: Annotated[float, quantity("m/s^2", "highest peak acceleration of a cycle"), Field(gt=0)]
    force: Annotated[float, quantity("N", "largest absolute force"), Field(gt=0)]

    @model_validator(mode="after")
    def _have_a_range(self) -> Limits:
        if self.lowest_frequency >= self.highest_frequency or self.lowest_preset > self.highest_preset:
            raise ValueError("the lowest frequency and preset have to be below the highest")
        return self


class StopResetRequest(Request):
    """A request to release a STOP, after its cause is removed."""

    epoch: int = Field(ge=1, le=LARGEST_EXACT, description="of the STOP that was looked at; a newer one stays in force")


class Stopped(BaseModel):
    """The number of the run that was stopped, null where none was carried out.

    The actuator is at rest where the rig drives a tester. STOP is in force until it is reset.
    """

    run_id: int | None
