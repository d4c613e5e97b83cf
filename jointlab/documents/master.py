"""Documents on master curves: what is asked of a specimen, and what sweeps at several temperatures answer."""

from collections.abc import Sequence
from datetime import datetime
from enum import StrEnum
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from analysis.direct.shift_law import ShiftLaw
from jointlab.documents.fields import LARGEST, OneLine, Request
from jointlab.documents.stiffness import HIGHEST_FREQUENCY, LARGEST_AMPLITUDE
from store.quantity import quantity
from store.states import ConfigurationName

LOWEST_FREQUENCY = 1e-3
"""The lowest frequency that may be asked for, Hz."""
COLDEST, WARMEST = -100.0, 300.0
"""Limits of temperatures that may be asked for, degrees Celsius."""
ROOM = 23.0
"""The usual temperature of a laboratory, degrees Celsius."""
MOST_FREQUENCIES, MOST_RUNS = 100, 1000

Temperature = Annotated[float, Field(ge=COLDEST, le=WARMEST)]
Frequency = Annotated[float, Field(ge=LOWEST_FREQUENCY, le=HIGHEST_FREQUENCY)]
Ends = tuple[float, float]
ParameterName = Literal["C1", "C2", "E"]
ParameterUnit = Literal["1", "K", "kJ/mol"]


class WlfConstants(Request):
    """Constants of WLF at the reference temperature, where they are known."""

    model_config = ConfigDict(frozen=True)

    c1: Annotated[float, quantity("1", "C1", gt=0)]
    c2: Annotated[float, quantity("K", "C2", gt=0)]


class MasterQuestion(Request):
    """What is asked of a specimen; of configuration and amplitude, where not given, those of most points are taken."""

    model_config = ConfigDict(frozen=True)

    article: OneLine = Field(description="the test article")
    specimen: OneLine = Field(description="the joint whose cylinders were tested")
    runs: Annotated[
        tuple[Annotated[int, Field(ge=1, le=LARGEST)], ...],
        Field(max_length=MOST_RUNS, description="only the points of these; of all runs where empty"),
    ] = ()
    configuration: ConfigurationName | None = None
    amplitude_pp_mm: Annotated[float | None, quantity("mm", "peak to peak, commanded", gt=0, le=LARGEST_AMPLITUDE)] = (
        None
    )
    frequencies: Annotated[
        tuple[Frequency, ...],
        Field(max_length=MOST_FREQUENCIES, description="to predict at, Hz", json_schema_extra={"x-unit": "Hz"}),
    ] = ()
    temperature_c: Annotated[Temperature, quantity("degC", "to predict at")] = ROOM
    reference_c: Annotated[
        Temperature | None, quantity("degC", "of the curve and the shift; the one to predict at where none is given")
    ] = None
    shift: ShiftLaw = Field(default=ShiftLaw.WLF, description="how frequencies shift with temperature")
    wlf: WlfConstants | None = Field(default=None, description="where its constants are known, and not to be fitted")
    vertical_shift: bool = Field(default=True, description="take stiffness in proportion to T in kelvin, as of rubber")

    @property
    def reference(self) -> float:
        """The reference temperature, degrees Celsius."""
        return self.temperature_c if self.reference_c is None else self.reference_c

    @property
    def constants(self) -> tuple[float, float] | None:
        """C1, and C2 in K, of WLF; None where they are to be fitted."""
        return None if self.wlf is None else (self.wlf.c1, self.wlf.c2)


class Cause(StrEnum):
    """Why points of the specimen are not in its master curve."""

    OTHER_SERIES = "other_series"
    """They have another configuration or amplitude; a master curve is of one."""
    OTHER_RUN = "other_run"
    """Runs were named, and theirs is none of them."""
    NO_TEMPERATURE = "no_temperature"
    """No temperature was recorded."""


class LeftOutDocument(BaseModel):
    """Points of the specimen that are not in the curve."""

    cause: Cause = Field(
        description="other_series: another configuration or amplitude; other_run: runs were named, and theirs is none "
        "of them; no_temperature: none was recorded"
    )
    configuration: str
    amplitude_pp_mm: Annotated[float, quantity("mm", "peak to peak")]
    points: int
    runs: list[int]
    temperatures_c: Annotated[list[float], quantity("degC", "of their sweeps")]


class ShiftParameter(BaseModel):
    """A parameter of the law of the shift at the reference temperature."""

    name: ParameterName = Field(description="C1 and C2 of WLF, or the activation energy E of Arrhenius")
    unit: ParameterUnit
    value: float
    standard_error: float | None = Field(description="null where it was given")
    ci95: Ends | None = Field(description="null where it was given")


class LagDocument(BaseModel):
    """By how much the points lag at all temperatures; it is taken for the tester's, and is not in the curve."""

    value: Annotated[float, quantity("s")]
    standard_error: Annotated[float, quantity("s")]
    ci95: Annotated[Ends, quantity("s")]


class DiscrepancyDocument(BaseModel):
    """Standard deviations of what law and shifts miss."""

    relaxation: Annotated[float, quantity("1", "of the amount of a relaxation")]
    level: Annotated[float, quantity("1", "of the vertical shift of a sweep, as its logarithm")]
    shift: Annotated[float, quantity("1", "of the horizontal shift of a sweep, as its logarithm")]
    exponent: Annotated[float, quantity("1", "of the power of frequency of a sweep")]
    point: Annotated[float, quantity("1", "of each point, as ln |k_d| and loss angle in rad")]


class SweepDocument(BaseModel):
    """The points at one temperature."""

    temperature_c: Annotated[float, quantity("degC")]
    runs: list[int]
    points: int
    lowest_frequency: Annotated[float, quantity("Hz")]
    highest_frequency: Annotated[float, quantity("Hz")]
    shift_factor: Annotated[float, quantity("1", "a_T by the law of the shift")]
    shift_factor_ci95: Annotated[Ends, quantity("1")]
    own_shift_factor: Annotated[float, quantity("1", "a_T with what this sweep has beyond the law")]
    own_shift_factor_ci95: Annotated[Ends, quantity("1")]


class ShiftCurve(BaseModel):
    """a_T by the law of the shift over the temperatures that were measured."""

    temperature_c: Annotated[list[float], quantity("degC")]
    shift_factor: Annotated[list[float], quantity("1")]
    shift_factor_ci95: Annotated[list[Ends], quantity("1")]


class CurveDocument(BaseModel):
    """The master curve at the reference temperature, to a decade beyond what was measured."""

    reduced_frequency: Annotated[list[float], quantity("Hz", "f a_T")]
    magnitude: Annotated[list[float], quantity("N/m", "|k_d|")]
    magnitude_ci95: Annotated[list[Ends], quantity("N/m")]
    k: Annotated[list[float], quantity("N/m")]
    k_ci95: Annotated[list[Ends], quantity("N/m")]
    gamma: Annotated[list[float], quantity("1")]
    gamma_ci95: Annotated[list[Ends], quantity("1")]


class MasterPointDocument(BaseModel):
    """A measured point, and where it is on the curve."""

    run: int
    frequency: Annotated[float, quantity("Hz")]
    temperature_c: Annotated[float, quantity("degC")]
    sweep: int = Field(description="its place among the sweeps, from 0")
    k: Annotated[float, quantity("N/m")]
    gamma: Annotated[float, quantity("1")]
    reduced_frequency: Annotated[float, quantity("Hz", "f a_T")]
    reduced_magnitude: Annotated[float, quantity("N/m", "|k_d| less the vertical shift")]
    gamma_without_lag: Annotated[float, quantity("1")]


class PredictionDocument(BaseModel):
    """What the curve says at a frequency and temperature; intervals hold 95 %."""

    frequency: Annotated[float, quantity("Hz")]
    temperature_c: Annotated[float, quantity("degC")]
    reduced_frequency: Annotated[float, quantity("Hz")]
    k: Annotated[float, quantity("N/m")]
    k_ci95: Annotated[Ends, quantity("N/m")]
    gamma: Annotated[float, quantity("1")]
    gamma_ci95: Annotated[Ends, quantity("1")]
    beyond: list[str] = Field(description="in which way this is outside of what was measured; empty inside")


class HammerStiffnessDocument(BaseModel):
    """k22 of the same joint by the hammer, at the amplitude and temperature of the blows."""

    run: int
    frequency: Annotated[float, quantity("Hz")]
    law: str = Field(description="of the joints over frequency")
    k: Annotated[float, quantity("N/m")]
    k_ci95: Annotated[Ends, quantity("N/m")]


class MasterDocument(BaseModel):
    """A master curve; intervals hold 95 %, temperatures are in degrees Celsius."""

    article: str
    specimen: str
    configuration: str
    amplitude_pp_mm: Annotated[float, quantity("mm", "peak to peak; the curve holds for this one")]
    runs: list[int]
    analyses: list[int] = Field(description="of the sine points")
    shift: ShiftLaw
    reference_c: Annotated[float, quantity("degC")]
    parameters: list[ShiftParameter] = Field(description="of the law of the shift")
    vertical_shift: bool = Field(description="whether stiffness is taken in proportion to T in kelvin")
    lag: LagDocument
    discrepancy: DiscrepancyDocument
    reduced_frequencies_covered: Annotated[Ends, quantity("Hz")]
    sweeps: list[SweepDocument]
    shift_curve: ShiftCurve
    curve: CurveDocument
    measured: list[MasterPointDocument]
    predictions: list[PredictionDocument]
    hammer_k22: list[HammerStiffnessDocument] = Field(description="beside cylinders at 45 degrees, which measure k22")
    left_out: list[LeftOutDocument]
    not_identified: list[int] = Field(description="runs with sine records of the specimen that were not identified")


class MasterSummary(BaseModel):
    """A master curve in short."""

    id: int
    article: str
    specimen: str
    configuration: str
    amplitude_pp_mm: Annotated[float, quantity("mm", "peak to peak")]
    shift: ShiftLaw
    reference_c: Annotated[float, quantity("degC")]
    lowest_reduced_frequency: Annotated[float, quantity("Hz", "that was measured")]
    highest_reduced_frequency: Annotated[float, quantity("Hz", "that was measured")]
    created_at: datetime | None


class StoredMasterDocument(MasterSummary):
    """A master curve with all that it says."""

    document: MasterDocument


def runs_text(runs: Sequence[int]) -> str:
    """Runs in words, as errors and reports name them: ``run 3``, or ``runs 3, 4``."""
    return f"run{'s' if len(runs) > 1 else ''} {', '.join(map(str, runs))}"
