"""Documents on results: analyses, accelerances, modes, joints, sine points, comparisons and diagnoses."""

from datetime import datetime
from typing import Annotated, Any

from pydantic import BaseModel, Field

from jointlab.documents.fields import NumberOrNull
from store.quantity import quantity
from store.states import Excitation

ACCELERANCE = "(m/s^2)/N"
MATRIX_UNITS = "N/m, N, N m"
COMPARED_UNITS = "N/m, or 1 for gamma"


class AnalysisDocument(BaseModel):
    """One computation; times are UTC."""

    id: int = Field(description="give it as `analysis` to read its results")
    kind: str = Field(description="what was computed, such as modes")
    method: str
    settings: dict[str, Any]
    parents: list[int] = Field(description="analyses whose results it was made from")
    software_version: str
    created_at: datetime


class SetSummary(BaseModel):
    """One set of accelerances: where the beam was struck or shaken, and how."""

    number: int
    excitation: Excitation = Field(description="by a roving hammer, or by a shaker that stays")
    response: str = Field(description="where the accelerometer sat, such as 3y; of a sine, where the shaker pushed")
    inputs: list[str] = Field(description="where the hammer struck; of a sine, where the accelerometer went")
    lines: int
    highest_frequency: Annotated[float, quantity("Hz")]
    averages: int
    peak_force: Annotated[float, quantity("N", "of the blows, or amplitude of the sine")]
    temperature_c: Annotated[float, quantity("degC")]
    window: str
    sample_rate: Annotated[float, quantity("Hz")]
    block_seconds: Annotated[float, quantity("s", "length of a record")]
    estimator: str


class FrequencyResponseDocument(BaseModel):
    """One accelerance over frequency."""

    response: str
    input: str
    frequency: Annotated[list[float], quantity("Hz")]
    real: Annotated[list[float], quantity(ACCELERANCE)]
    imaginary: Annotated[list[float], quantity(ACCELERANCE)]
    coherence: Annotated[list[NumberOrNull] | None, quantity("1", "0 to 1; null where it was not measured")]
    variance: Annotated[
        list[NumberOrNull] | None, quantity("((m/s^2)/N)^2", "of the real and of the imaginary part; null: not known")
    ]


class ModesDocument(BaseModel):
    """The modes of a run, by rising frequency; an interval is [low, high], null is not known."""

    analysis_id: int
    method: str
    frequency_hz: Annotated[list[float], quantity("Hz")]
    frequency_ci95: Annotated[list[list[NumberOrNull]], quantity("Hz")]
    loss_factor: Annotated[list[float], quantity("1")]
    loss_factor_ci95: Annotated[list[list[NumberOrNull]], quantity("1")]
    predicted_hz: Annotated[list[NumberOrNull], quantity("Hz", "of the beam on the identified joints")]
    points: list[str] = Field(description="degrees of freedom of the shapes, such as 3y")
    shapes_real: Annotated[
        list[list[float]], quantity("1/kg", "modal constants: a row for each mode, a column for each point")
    ]
    shapes_imaginary: Annotated[list[list[float]], quantity("1/kg")]


class JointMatrixDocument(BaseModel):
    """One joint by one method; rows and columns are x, y, rotation; an interval is [low, high], null is not known."""

    analysis_id: int
    method: str
    joint: str
    node: int
    k: Annotated[list[list[float]], quantity(MATRIX_UNITS, "stiffness")]
    k_ci95: Annotated[list[list[list[NumberOrNull]]], quantity(MATRIX_UNITS)]
    h: Annotated[list[list[float]], quantity(MATRIX_UNITS, "structural damping")]
    h_ci95: Annotated[list[list[list[NumberOrNull]]], quantity(MATRIX_UNITS)]
    gamma: Annotated[
        list[list[NumberOrNull]], quantity("1", "loss factor; null where k is not distinguishable from zero")
    ]
    gamma_ci95: Annotated[list[list[list[NumberOrNull]]], quantity("1")]
    observable: list[list[bool]] = Field(description="false where only a prior or a sum determines the term")
    not_observable: dict[str, str] = Field(description="by term, such as k11, why it is not observable")


class TableColumn(BaseModel):
    """A column of a table."""

    name: str
    unit: str = Field(description="1 for ratios, empty for texts and numbers of things")


class TableSummary(BaseModel):
    """A table of results: a row for each place along its dimensions."""

    name: str
    rows: int
    columns: tuple[TableColumn, ...]


class ElementDocument(BaseModel):
    """One element of a joint's matrices; rows and columns 1, 2, 3 are x, y, rotation."""

    id: int
    analysis_id: int
    run_id: int
    joint: str
    matrix_row: int
    matrix_column: int
    stiffness: Annotated[float, quantity(MATRIX_UNITS)]
    stiffness_low: Annotated[NumberOrNull, quantity(MATRIX_UNITS)]
    stiffness_high: Annotated[NumberOrNull, quantity(MATRIX_UNITS)]
    damping: Annotated[float, quantity(MATRIX_UNITS)]
    damping_low: Annotated[NumberOrNull, quantity(MATRIX_UNITS)]
    damping_high: Annotated[NumberOrNull, quantity(MATRIX_UNITS)]
    loss_factor: Annotated[NumberOrNull, quantity("1")]
    loss_factor_low: Annotated[NumberOrNull, quantity("1")]
    loss_factor_high: Annotated[NumberOrNull, quantity("1")]
    observable: bool


class StiffnessPoint(BaseModel):
    """One sine point; null is not known."""

    analysis_id: int
    order_number: int
    specimen: str
    configuration: str
    amplitude_pp_mm: Annotated[float, quantity("mm", "peak to peak, commanded")]
    frequency: Annotated[float, quantity("Hz", "commanded")]
    stiffness: Annotated[float, quantity("N/m", "k")]
    stiffness_se: Annotated[NumberOrNull, quantity("N/m", "standard error")]
    damping: Annotated[float, quantity("N/m", "h")]
    damping_se: Annotated[NumberOrNull, quantity("N/m", "standard error")]
    loss_factor: Annotated[float, quantity("1", "gamma")]
    loss_factor_se: Annotated[NumberOrNull, quantity("1", "standard error")]
    degrees_of_freedom: Annotated[
        NumberOrNull, quantity("1", "behind the standard errors; null where known beforehand")
    ]
    reached_frequency: Annotated[NumberOrNull, quantity("Hz", "of the record")]
    reached_pp_mm: Annotated[NumberOrNull, quantity("mm", "peak to peak, reached by the first harmonic")]
    reached_pp_se_mm: Annotated[NumberOrNull, quantity("mm", "standard error")]
    thd_percent: Annotated[NumberOrNull, quantity("%", "total harmonic distortion of the force")]
    thd_se_percent: Annotated[NumberOrNull, quantity("%", "standard error")]
    thd_displacement_percent: Annotated[NumberOrNull, quantity("%", "total harmonic distortion of the displacement")]
    thd_displacement_se_percent: Annotated[NumberOrNull, quantity("%", "standard error")]
    loop_energy: Annotated[NumberOrNull, quantity("J", "of one cycle, all harmonics")]
    loop_energy_se: Annotated[NumberOrNull, quantity("J", "standard error")]
    loop_energy_excess: Annotated[NumberOrNull, quantity("J", "loop energy less pi X^2 h, that of the first harmonic")]
    loop_energy_excess_se: Annotated[NumberOrNull, quantity("J", "standard error")]
    temperature_c: Annotated[NumberOrNull, quantity("degC")]
    flags: list[str] = Field(description="warnings about this point")


class FoundPoint(StiffnessPoint):
    """One sine point, and the run it was found in."""

    id: int
    run_id: int


class ComparisonDocument(BaseModel):
    """One element by both experiments; intervals are [low, high] and hold 95 %."""

    joint: str = Field(description="a joint, or all whose sum is compared, such as I+II")
    element: str = Field(description="k11, k22, k12, gamma11, gamma22 or gamma12")
    inverse: Annotated[list[float] | None, quantity(COMPARED_UNITS, "null where that experiment does not determine it")]
    direct: Annotated[list[float], quantity(COMPARED_UNITS)]
    verdict: str
    reason: str | None
    frequency: Annotated[float | None, quantity("Hz")]
    amplitude_pp_mm: Annotated[float | None, quantity("mm", "peak to peak")]


class FoundComparison(ComparisonDocument):
    """A comparison, and the run it was found in."""

    id: int
    analysis_id: int
    run_id: int


class DiagnosisSummary(BaseModel):
    """The finding of a diagnosis, in short."""

    id: int
    status: str = Field(description="none, explained, partial or unknown")
    effects: list[str] = Field(description="that explain the gap")
    gap_before_percent: Annotated[float | None, quantity("%", "on held-out data")]
    gap_after_percent: Annotated[float | None, quantity("%", "on held-out data")]
    created_at: datetime | None


class DiagnosisDocument(DiagnosisSummary):
    """A diagnosis with all that it found."""

    document: dict[str, Any] = Field(description="in the format jointlab-diagnosis/1")
