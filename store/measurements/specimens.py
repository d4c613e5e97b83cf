"""Specimens: the cylinders of one joint of a test article, known over the years."""

from dataclasses import dataclass

from sqlalchemy import ColumnElement, or_, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from store.models.measurements import SineRecordRow, SpecimenRow
from store.models.results import AnalysisRunRow, DynamicStiffnessRow, JointMatrixRow
from store.models.rows import equal, found_or_added, from_row, get_row


@dataclass(frozen=True)
class Specimen:
    """The cylinders of one joint; `name` is the joint's."""

    id: int
    article: str
    name: str
    description: str | None


def get_specimen(session: Session, specimen_id: int) -> Specimen:
    """One specimen, or NotFoundError."""
    return from_row(Specimen, get_row(session, SpecimenRow, specimen_id, "specimen"))


def list_specimens(session: Session, *, article: str | None = None, after: int = 0, limit: int = 100) -> list[Specimen]:
    """Specimens of one article or of all, in the order of storing; a page begins after the number `after`."""
    query = select(SpecimenRow).where(SpecimenRow.id > after, *equal(SpecimenRow, article=article))
    return [from_row(Specimen, row) for row in session.scalars(query.order_by(SpecimenRow.id).limit(limit))]


def specimen_id(session: Session, article: str, name: str) -> int:
    """Number of the specimen of joint `name` of an article; a new specimen gets a row."""
    query = select(SpecimenRow).filter_by(article=article, name=name)
    return found_or_added(session, query, lambda: SpecimenRow(article=article, name=name))[0].id


def runs_with_specimen(run_id: InstrumentedAttribute[int], article: str | None, name: str) -> ColumnElement[bool]:
    """The condition that a run has a sine record, a sine point or a joint of a specimen, of one article or of any."""
    numbers = select(SpecimenRow.id).where(*equal(SpecimenRow, article=article, name=name))
    analysed = select(AnalysisRunRow.run_id).where(
        or_(
            *(
                AnalysisRunRow.analysis_id.in_(select(table.analysis_id).where(table.specimen_id.in_(numbers)))
                for table in (DynamicStiffnessRow, JointMatrixRow)
            )
        )
    )
    recorded = select(SineRecordRow.run_id).where(SineRecordRow.specimen_id.in_(numbers))
    return or_(run_id.in_(recorded), run_id.in_(analysed))
