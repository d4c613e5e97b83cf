"""Specimens: the cylinders of one joint of a test article, known over the years."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.errors import NotFoundError
from store.models.measurements import SpecimenRow


@dataclass(frozen=True)
class Specimen:
    """One joint's cylinders; `name` is the joint's."""

    id: int
    article: str
    name: str
    description: str | None


def get_specimen(session: Session, specimen_id: int) -> Specimen:
    """One specimen.

    Raises:
        NotFoundError: there is no such specimen.
    """
    row = session.get(SpecimenRow, specimen_id)
    if row is None:
        raise NotFoundError(f"there is no specimen {specimen_id}")
    return _specimen(row)


def list_specimens(session: Session, *, article: str | None = None, after: int = 0, limit: int = 100) -> list[Specimen]:
    """Specimens in the order of storing, of one article or all; `after` a number, to go on with a list."""
    query = select(SpecimenRow).where(SpecimenRow.id > after).order_by(SpecimenRow.id).limit(limit)
    if article is not None:
        query = query.filter_by(article=article)
    return [_specimen(row) for row in session.scalars(query)]


def _specimen(row: SpecimenRow) -> Specimen:
    return Specimen(row.id, row.article, row.name, row.description)
