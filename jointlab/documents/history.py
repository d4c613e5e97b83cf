"""Documents on the history of a specimen over its runs."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, Field

from jointlab.documents.fields import NumberOrNull
from store.quantity import quantity
from store.states import ConfigurationName

LOW, HIGH = (f"{end} end of the 95 % interval, null where it is not known" for end in ("lower", "upper"))
"""What the ends of an interval are, in the schema."""


class HistoryResult(BaseModel):
    """The newest result of one run."""

    run_id: int
    measured_at: datetime = Field(description="UTC")
    temperature_c: Annotated[NumberOrNull, quantity("degC", "null where it was not recorded")]
    stiffness: Annotated[float, quantity("N/m", "k")]
    stiffness_low: Annotated[NumberOrNull, quantity("N/m", LOW)]
    stiffness_high: Annotated[NumberOrNull, quantity("N/m", HIGH)]
    loss_factor: Annotated[float, quantity("1", "gamma")]
    loss_factor_low: Annotated[NumberOrNull, quantity("1", LOW)]
    loss_factor_high: Annotated[NumberOrNull, quantity("1", HIGH)]


class ChangeDocument(BaseModel):
    """Change from the first to the last result by a straight line through all; temperature is not taken out of it."""

    share: Annotated[float, quantity("1", "of the mean")]
    ci95: Annotated[tuple[float, float], quantity("1", "interval that holds 95 %")]


class HistoryDocument(BaseModel):
    """A specimen at one nominal point over its runs."""

    article: str
    specimen: str
    configuration: ConfigurationName
    amplitude_pp_mm: Annotated[float, quantity("mm", "peak to peak, commanded")]
    frequency: Annotated[float, quantity("Hz", "commanded")]
    days: Annotated[float, quantity("d", "from the first result to the last")]
    stiffness_change: ChangeDocument | None = Field(description="null for fewer than three results")
    loss_factor_change: ChangeDocument | None = Field(description="null for fewer than three results")
    results: list[HistoryResult] = Field(description="in the order of measuring, of at most the last 2,000 runs")
