"""Documents on results of several runs over each other."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, Field

from jointlab.documents.fields import NumberOrNull
from jointlab.documents.results import ACCELERANCE
from store.quantity import quantity

INTERVALS = "95 % interval of each point, [low, high]; null where it is not known"


class OverlaidRun(BaseModel):
    """One of the runs, and which results it has."""

    run_id: int
    title: str
    article: str
    started_at: datetime = Field(description="UTC; of a run that has not begun, when it was planned")
    sine_points: int = Field(description="identified ones")
    has_accelerances: bool
    joints: list[str] = Field(description="joints that maximum likelihood finds from the hammer")
    failed: bool = Field(description="true where that fit fails its checks: its joints are not overlaid")


class OverlaidRow(BaseModel):
    """A row of accelerances."""

    input: str = Field(description="where the hammer struck, such as 1y")
    response: str = Field(description="where the accelerometer sat, such as 3y")


class SweepCurve(BaseModel):
    """k and gamma of one run by rising frequency; all lists are of one length."""

    run_id: int
    frequency: Annotated[list[float], quantity("Hz", "of the records")]
    stiffness: Annotated[list[float], quantity("N/m", "k")]
    stiffness_ci95: Annotated[list[list[NumberOrNull]], quantity("N/m", INTERVALS)]
    loss_factor: Annotated[list[float], quantity("1", "gamma")]
    loss_factor_ci95: Annotated[list[list[NumberOrNull]], quantity("1", INTERVALS)]


class SweepOverlay(BaseModel):
    """A joint in one configuration of the tester, by the runs that have it."""

    specimen: str
    configuration: str
    curves: list[SweepCurve]


class AcceleranceCurve(BaseModel):
    """One accelerance of one run over frequency."""

    run_id: int
    frequency: Annotated[list[float], quantity("Hz")]
    real: Annotated[list[float], quantity(ACCELERANCE)]
    imaginary: Annotated[list[float], quantity(ACCELERANCE)]


class TermInterval(BaseModel):
    """A term by one run."""

    run_id: int
    ci95: Annotated[tuple[float, float], quantity("N/m, or 1 for gamma", "interval that holds 95 %")]


class TermOverlay(BaseModel):
    """A term of a joint by the hammer, by the runs that determine it."""

    joint: str
    term: str = Field(description="k22, k12, gamma22 or gamma12")
    intervals: list[TermInterval]


class OverlayDocument(BaseModel):
    """What two of the runs or more have in common; `runs`, and the runs of each list, are in the order asked for."""

    runs: list[OverlaidRun]
    amplitudes_pp_mm: Annotated[
        list[float], quantity("mm", "peak to peak, commanded, in common: those of most runs first, then the smallest")
    ]
    amplitude_pp_mm: Annotated[NumberOrNull, quantity("mm", "that of `sweeps`; null where none is in common")]
    sweeps: list[SweepOverlay]
    rows: list[OverlaidRow] = Field(description="in common: driving points first, then those of most runs")
    row: OverlaidRow | None = Field(description="that of `accelerances`; null where none is in common")
    accelerances: list[AcceleranceCurve] = Field(description="of the first set of each run")
    joints: list[TermOverlay]
