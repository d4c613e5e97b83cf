"""Analyses: what was computed from a run, when and how; results of older ones are read by their numbers."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from fastapi import APIRouter
from pydantic import BaseModel, Field

from api.service.access import Reader
from api.service.context import Context
from api.service.documents import RunNumber
from api.service.etags import TaggedRoute
from api.service.pages import Cursor, Limit, Page, page_of_whole
from api.service.problems import problems
from store.analyses import Analysis, list_analyses
from store.runs import get_run
from store.states import AnalysisKind

router = APIRouter(prefix="/runs/{run_id}/analyses", tags=["analyses"], route_class=TaggedRoute)


class AnalysisDocument(BaseModel):
    """One computation; times are UTC."""

    id: int = Field(description="give it as `analysis` to read its results")
    kind: str = Field(description="what was computed, such as modes")
    method: str
    settings: dict[str, Any]
    parents: list[int] = Field(description="analyses whose results it was made from")
    software_version: str
    created_at: datetime

    @classmethod
    def of(cls, found: Analysis) -> AnalysisDocument:
        """What is shown of an analysis."""
        same = set(cls.model_fields) - {"parents"}
        return cls(**{name: getattr(found, name) for name in same}, parents=list(found.parents))


@router.get("", responses=problems(401, 403, 404))
def list_(
    _who: Reader,
    context: Context,
    run_id: RunNumber,
    kind: AnalysisKind | None = None,
    limit: Limit = 100,
    cursor: Cursor = None,
) -> Page[AnalysisDocument]:
    """List what was computed from a run, newest first."""
    with context.catalogue.reading() as session:
        get_run(session, run_id)
        found = list_analyses(session, run_id, kind)
    return page_of_whole([AnalysisDocument.of(each) for each in found], limit, cursor)
