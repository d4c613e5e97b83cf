"""Dynamic stiffness points of the direct method, measured here or imported as given."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from sqlalchemy import insert, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from store.database.columns import finite
from store.errors import NotFoundError, StoreError
from store.measurements.specimens import specimen_id
from store.models.measurements import SpecimenRow
from store.models.results import DynamicStiffnessRow
from store.results.analyses import article_of
from store.states import CONFIGURATIONS


@dataclass(frozen=True)
class StoredStiffness:
    """One steady-state sine point; standard errors (`_se`) and what has them are None where they are not known.

    Attributes:
        order_number: the order of measuring, from 1.
        elapsed: s since the start of the run.
        specimen: the joint (I or II) whose cylinders were tested.
        configuration: compression, shear or angled.
        amplitude_pp_mm: peak-to-peak amplitude of the series, mm; reached_pp_mm: that of the first harmonic.
        frequency: Hz, commanded, as the amplitude is; reached_frequency: that of the record.
        stiffness, damping: real and imaginary part k and h of the complex stiffness, N/m.
        loss_factor: h/k.
        magnitude: |k_d|, N/m.
        loss_angle_deg: degrees.
        degrees_of_freedom: behind the standard errors; None where these are known beforehand.
        stiffness_damping_covariance: of k and h, (N/m)^2.
        sd_rel: relative standard deviation per real and imaginary part at `amplitude_pp_mm`, as in an imported table;
            the standard errors are those at the reached amplitude.
        thd_percent: total harmonic distortion of the force, %; thd_displacement_percent: of the displacement.
        loop_energy: loop integral of force over displacement, J a cycle.
        loop_energy_excess: by how much it is more than pi X^2 h, the ellipse of the first harmonic, J a cycle.
        flags: what to mind about this point, a word or a sentence each.
        shared_errors: by source, how far one standard deviation of it moves k and h at this point, N/m; other points
            share it, and it is part of the standard errors.
        sine_record_id: the record it was computed from, or None for an imported point.
    """

    order_number: int
    elapsed: float
    specimen: str
    configuration: str
    amplitude_pp_mm: float
    frequency: float
    stiffness: float
    damping: float
    loss_factor: float
    magnitude: float
    loss_angle_deg: float
    stiffness_se: float | None = None
    damping_se: float | None = None
    loss_factor_se: float | None = None
    magnitude_se: float | None = None
    loss_angle_se_deg: float | None = None
    degrees_of_freedom: float | None = None
    stiffness_damping_covariance: float | None = None
    sd_rel: float | None = None
    reached_frequency: float | None = None
    reached_pp_mm: float | None = None
    reached_pp_se_mm: float | None = None
    thd_percent: float | None = None
    thd_se_percent: float | None = None
    thd_displacement_percent: float | None = None
    thd_displacement_se_percent: float | None = None
    loop_energy: float | None = None
    loop_energy_se: float | None = None
    loop_energy_excess: float | None = None
    loop_energy_excess_se: float | None = None
    temperature_c: float | None = None
    flags: tuple[str, ...] = ()
    shared_errors: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    sine_record_id: int | None = None


_JSON = ("flags", "shared_errors")
_NUMBERS = tuple(each.name for each in fields(StoredStiffness) if each.name not in ("specimen", *_JSON))
# Columns instead of objects of the model: a sweep has a thousand points.
COLUMNS: tuple[InstrumentedAttribute[Any], ...] = (
    SpecimenRow.name,
    *(getattr(DynamicStiffnessRow, name) for name in (*_JSON, *_NUMBERS)),
)
"""Columns of points and their specimens for a query; `from_columns` takes their values."""


def from_columns(specimen: str, flags: list[str], shared: dict[str, Any] | None, *numbers: Any) -> StoredStiffness:
    """The point with these values of `COLUMNS`."""
    return StoredStiffness(
        specimen=specimen,
        flags=tuple(flags),
        shared_errors={source: (move[0], move[1]) for source, move in (shared or {}).items()},
        **dict(zip(_NUMBERS, numbers, strict=True)),
    )


def add_dynamic_stiffness(session: Session, analysis_id: int, points: Sequence[StoredStiffness]) -> None:
    """Store the points of an analysis; StoreError if a configuration is unknown or a value is not finite."""
    if not points:
        return
    article = article_of(session, analysis_id)
    specimens = {name: specimen_id(session, article, name) for name in sorted({point.specimen for point in points})}
    rows = []
    for point in points:
        where = f"sine point {point.order_number}"
        if point.configuration not in CONFIGURATIONS:
            raise StoreError(f"{where}: configuration {point.configuration!r} is none of {', '.join(CONFIGURATIONS)}")
        row = asdict(point)
        for name, value in row.items():
            if isinstance(value, float) and not math.isfinite(value):
                finite(value, f"{where}: {name}")
        row.update(
            analysis_id=analysis_id,
            specimen_id=specimens[row.pop("specimen")],
            flags=list(point.flags),
            shared_errors={source: list(move) for source, move in point.shared_errors.items()} or None,
        )
        rows.append(row)
    session.execute(insert(DynamicStiffnessRow), rows)


def list_dynamic_stiffness(session: Session, analysis_id: int) -> list[StoredStiffness]:
    """The points of an analysis in the order of measuring, or NotFoundError."""
    rows = session.execute(
        select(*COLUMNS)
        .join(SpecimenRow, SpecimenRow.id == DynamicStiffnessRow.specimen_id)
        .where(DynamicStiffnessRow.analysis_id == analysis_id)
        .order_by(DynamicStiffnessRow.order_number)
    ).all()
    if not rows:
        raise NotFoundError(f"analysis {analysis_id} has no dynamic stiffness points")
    return [from_columns(*row) for row in rows]
