"""Results of an article over all its runs, in pages; each begins with an index, however many points there are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from sqlalchemy import ScalarSelect, Select, func, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from store.dynamic_stiffness import COLUMNS, StoredStiffness, from_columns
from store.models.measurements import SpecimenRow
from store.models.results import (
    AnalysisRow,
    AnalysisRunRow,
    ComparisonRow,
    DynamicStiffnessRow,
    JointElementRow,
    JointMatrixRow,
)


class ResultIds(NamedTuple):
    """Where a result stands: the numbers of its row, its analysis and the first run that it is about."""

    id: int
    analysis_id: int
    run_id: int


class Element(NamedTuple):
    """One element of a joint's matrices, k and h in N/m, N or N m, with 95 % intervals; None is not known."""

    joint: str
    matrix_row: int
    matrix_column: int
    stiffness: float
    stiffness_low: float | None
    stiffness_high: float | None
    damping: float
    damping_low: float | None
    damping_high: float | None
    loss_factor: float | None
    loss_factor_low: float | None
    loss_factor_high: float | None
    observable: bool


class Compared(NamedTuple):
    """One element by both experiments, with 95 % intervals."""

    article: str
    joint: str
    element: str
    frequency: float | None
    amplitude_pp_mm: float | None
    inverse_low: float | None
    inverse_high: float | None
    direct_low: float
    direct_high: float
    verdict: str
    reason: str | None


def find_elements(
    session: Session,
    *,
    article: str,
    joint: str | None = None,
    method: str | None = None,
    before: int | None = None,
    limit: int = 100,
) -> list[tuple[ResultIds, Element]]:
    """Elements of the joint matrices of an article, newest first."""
    matrix, element = JointMatrixRow, JointElementRow
    names = [name for name in Element._fields if name != "joint"]
    query = (
        select(element.id, matrix.analysis_id, _run_of(matrix.analysis_id), matrix.joint,
               *[getattr(element, name) for name in names])
        .join(matrix, matrix.id == element.joint_matrix_id)
        .where(matrix.specimen_id.in_(_specimens(article, joint)))
    )  # fmt: skip
    if method is not None:
        query = query.join(AnalysisRow, AnalysisRow.id == matrix.analysis_id)
        query = query.where(AnalysisRow.method == method)
    if before is not None:
        query = query.where(element.id < before)
    rows = session.execute(query.order_by(element.id.desc()).limit(limit))
    return [(_place(row), Element(*row[3:])) for row in rows]


def find_sine_points(
    session: Session,
    *,
    article: str,
    specimen: str | None = None,
    configuration: str | None = None,
    amplitude_pp_mm: float | None = None,
    lowest_frequency: float | None = None,
    highest_frequency: float | None = None,
    before: int | None = None,
    limit: int = 100,
) -> list[tuple[ResultIds, StoredStiffness]]:
    """Dynamic stiffness of an article's specimens, newest first."""
    point = DynamicStiffnessRow
    query = (
        select(point.id, point.analysis_id, _run_of(point.analysis_id), *COLUMNS)
        .join(SpecimenRow, SpecimenRow.id == point.specimen_id)
        .where(point.specimen_id.in_(_specimens(article, specimen)))
    )
    wanted = {"configuration": configuration, "amplitude_pp_mm": amplitude_pp_mm}
    for name, value in wanted.items():
        if value is not None:
            query = query.where(getattr(point, name) == value)
    if lowest_frequency is not None:
        query = query.where(point.frequency >= lowest_frequency)
    if highest_frequency is not None:
        query = query.where(point.frequency <= highest_frequency)
    if before is not None:
        query = query.where(point.id < before)
    rows = session.execute(query.order_by(point.id.desc()).limit(limit))
    return [(_place(row), from_columns(*row[3:])) for row in rows]


def find_comparisons(
    session: Session,
    *,
    article: str,
    joint: str | None = None,
    verdict: str | None = None,
    before: int | None = None,
    limit: int = 100,
) -> list[tuple[ResultIds, Compared]]:
    """Comparisons of both experiments on an article, newest first."""
    row = ComparisonRow
    columns = [getattr(row, name) for name in Compared._fields]
    query = select(row.id, row.analysis_id, _run_of(row.analysis_id), *columns).filter_by(article=article)
    for name, value in {"joint": joint, "verdict": verdict}.items():
        if value is not None:
            query = query.where(getattr(row, name) == value)
    if before is not None:
        query = query.where(row.id < before)
    found = session.execute(query.order_by(row.id.desc()).limit(limit))
    return [(_place(each), Compared(*each[3:])) for each in found]


def _run_of(analysis_id: InstrumentedAttribute[int]) -> ScalarSelect[int | None]:
    first = select(func.min(AnalysisRunRow.run_id)).where(AnalysisRunRow.analysis_id == analysis_id)
    return first.scalar_subquery()


def _specimens(article: str, name: str | None) -> Select[int]:
    query = select(SpecimenRow.id).filter_by(article=article)
    return query if name is None else query.filter_by(name=name)


def _place(row: Sequence[Any]) -> ResultIds:
    return ResultIds(row[0], row[1], row[2])
