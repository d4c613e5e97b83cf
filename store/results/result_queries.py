"""Results of an article over all its runs, in pages; an index makes each page fast, however many results there are."""

from typing import NamedTuple

from sqlalchemy import ScalarSelect, Select, func, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from store.models.measurements import SpecimenRow
from store.models.results import (
    AnalysisRow,
    AnalysisRunRow,
    ComparisonRow,
    DynamicStiffnessRow,
    JointElementRow,
    JointMatrixRow,
)
from store.models.rows import equal, newest_first
from store.results.comparisons import Comparison, comparison_of
from store.results.dynamic_stiffness import COLUMNS, StoredStiffness, from_columns


class ResultIds(NamedTuple):
    """Numbers of a result's row, of its analysis and of the first run of that analysis."""

    id: int
    analysis_id: int
    run_id: int


class Element(NamedTuple):
    """One element of a joint's matrices, k and h in N/m, N or N m, with 95 % intervals; None for unknown values."""

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
        query = query.join(AnalysisRow, AnalysisRow.id == matrix.analysis_id).where(AnalysisRow.method == method)
    rows = session.execute(newest_first(query, element.id, before, limit))
    return [(ResultIds(*row[:3]), Element(*row[3:])) for row in rows]


def find_sine_points(
    session: Session,
    *,
    article: str,
    specimen: str | None = None,
    configuration: str | None = None,
    amplitude_pp_mm: float | None = None,
    frequency: float | None = None,
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
    exact = {"configuration": configuration, "amplitude_pp_mm": amplitude_pp_mm, "frequency": frequency}
    query = query.where(*equal(point, **exact))
    if lowest_frequency is not None:
        query = query.where(point.frequency >= lowest_frequency)
    if highest_frequency is not None:
        query = query.where(point.frequency <= highest_frequency)
    rows = session.execute(newest_first(query, point.id, before, limit))
    return [(ResultIds(*row[:3]), from_columns(*row[3:])) for row in rows]


def find_comparisons(
    session: Session,
    *,
    article: str,
    joint: str | None = None,
    verdict: str | None = None,
    before: int | None = None,
    limit: int = 100,
) -> list[tuple[ResultIds, Comparison]]:
    """Comparisons of both experiments on an article, newest first."""
    query = select(ComparisonRow, _run_of(ComparisonRow.analysis_id))
    query = query.where(*equal(ComparisonRow, article=article, joint=joint, verdict=verdict))
    found = session.execute(newest_first(query, ComparisonRow.id, before, limit))
    return [(ResultIds(row.id, row.analysis_id, run), comparison_of(row)) for row, run in found]


def _run_of(analysis_id: InstrumentedAttribute[int]) -> ScalarSelect[int]:
    first = select(func.min(AnalysisRunRow.run_id)).where(AnalysisRunRow.analysis_id == analysis_id)
    return first.scalar_subquery()


def _specimens(article: str, name: str | None) -> Select[int]:
    query = select(SpecimenRow.id).filter_by(article=article)
    return query if name is None else query.filter_by(name=name)
