"""The audit log: who asked for what, and what came of it."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from api.service.access import Admin
from api.service.context import Context
from api.service.documents import Words
from api.service.etags import TaggedRoute
from api.service.pages import Cursor, Limit, Page, number_from, page_of
from api.service.problems import problems
from store.audit import list_audit_entries

router = APIRouter(prefix="/audit", tags=["audit"], route_class=TaggedRoute)


class AuditDocument(BaseModel):
    """One deed; times are UTC."""

    id: int
    at: datetime
    who: str
    action: str
    target: str
    outcome: str = Field(description="begun, done, refused and why, or why it failed")
    details: dict[str, Any] = Field(description="what else was given; `begun` is the entry of the deed's beginning")


@router.get("", responses=problems(401, 403))
def list_(
    _who: Admin,
    context: Context,
    action: Annotated[Words | None, Query(description="start run, stop, ...")] = None,
    limit: Limit = 100,
    cursor: Cursor = None,
) -> Page[AuditDocument]:
    """List deeds, newest first."""
    with context.catalogue.reading() as session:
        found = list_audit_entries(session, action=action, before=number_from(cursor), limit=limit + 1)
    return page_of([AuditDocument(**vars(each)) for each in found], limit, lambda each: each.id)
