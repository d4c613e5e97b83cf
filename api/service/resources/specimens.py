"""Specimens: the cylinders of one joint of a test article."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import BaseModel

from api.service.access import Reader
from api.service.context import Context
from api.service.documents import Words, number_of
from api.service.etags import TaggedRoute
from api.service.links import first_of
from api.service.pages import Cursor, Limit, Page, number_from, page_of
from api.service.problems import problems
from store.specimens import get_specimen, list_specimens

router = APIRouter(prefix="/specimens", tags=["specimens"], route_class=TaggedRoute)


class SpecimenDocument(BaseModel):
    """One joint's cylinders; `name` is the joint's."""

    id: int
    article: str
    name: str
    description: str | None


@router.get("", responses=problems(401, 403) | first_of("specimen_id", "specimens-get"))
def list_(
    _who: Reader,
    context: Context,
    article: Annotated[Words | None, Query(description="the test article")] = None,
    limit: Limit = 100,
    cursor: Cursor = None,
) -> Page[SpecimenDocument]:
    """List specimens in the order of first use."""
    with context.catalogue.reading() as session:
        found = list_specimens(session, article=article, after=number_from(cursor) or 0, limit=limit + 1)
    return page_of([SpecimenDocument(**vars(each)) for each in found], limit, lambda each: each.id)


@router.get("/{specimen_id}", responses=problems(401, 403, 404))
def get(_who: Reader, context: Context, specimen_id: Annotated[int, number_of("specimen")]) -> SpecimenDocument:
    """One specimen."""
    with context.catalogue.reading() as session:
        return SpecimenDocument(**vars(get_specimen(session, specimen_id)))
