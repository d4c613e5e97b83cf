"""Documents on the dynamic stiffness that fitted laws give at one amplitude and frequency."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from store.quantity import quantity

LARGEST_AMPLITUDE = 100.0
"""The largest amplitude that may be asked for, mm peak to peak."""
HIGHEST_FREQUENCY = 1e6
"""The highest frequency that may be asked for, Hz."""


class TermDocument(BaseModel):
    """One complex stiffness; intervals are [low, high] and hold 95 %."""

    k: Annotated[float, quantity("N/m")]
    k_ci95: Annotated[tuple[float, float], quantity("N/m")]
    h: Annotated[float, quantity("N/m")]
    h_ci95: Annotated[tuple[float, float], quantity("N/m")]
    gamma: Annotated[float, quantity("1")]
    gamma_ci95: Annotated[tuple[float, float], quantity("1")]


class JointDocument(BaseModel):
    """Translational terms of a joint of two such cylinders."""

    k11: TermDocument
    k22: TermDocument
    k12: TermDocument


class SpecimenStiffness(BaseModel):
    """One specimen by its own law."""

    specimen: str
    shear: TermDocument = Field(description="a of one cylinder")
    compression: TermDocument = Field(description="b of one cylinder")
    joint: JointDocument
    beyond: list[str] = Field(description="in which way this is outside of what was measured; empty inside")
    notices: list[str] = Field(description="what speaks against the points behind it, one sentence each")
    contradicted: bool = Field(
        description="whether compression, shear and angled contradict each other; then no interval can be relied on"
    )


class ScatterDocument(BaseModel):
    """One quantity over specimens."""

    unit: Literal["N/m", "1"]
    mean: float
    mean_ci95: tuple[float, float]
    deviation: float = Field(description="standard deviation between specimens")
    single_specimen_ci95: tuple[float, float] = Field(description="where another specimen of the kind lies")


class TermScatterDocument(BaseModel):
    """One term of a cylinder over specimens: k and h in N/m, and gamma."""

    k: ScatterDocument
    h: ScatterDocument
    gamma: ScatterDocument


class SpecimensDocument(BaseModel):
    """How specimens of one kind differ."""

    specimens: list[str]
    shear: TermScatterDocument
    compression: TermScatterDocument


class StiffnessDocument(BaseModel):
    """Dynamic stiffness at one amplitude and frequency, by the fitted laws."""

    analysis_id: int | None = Field(description="of the sine points behind it; null where they are a bundle's")
    amplitude_pp_mm: Annotated[float, quantity("mm", "peak to peak")]
    frequency: Annotated[float, quantity("Hz")]
    extrapolated: bool = Field(description="whether this is outside of what was measured of any specimen")
    specimens: list[SpecimenStiffness]
    scatter: SpecimensDocument | None = Field(description="null for one specimen alone")
