"""Whether the service can do its work; open to everybody."""

from __future__ import annotations

from fastapi import APIRouter
from pydantic import BaseModel

from api.service.context import Context
from api.service.problems import problems
from store.runs import list_runs
from store.version import software_version

router = APIRouter(prefix="/health", tags=["health"])


class Health(BaseModel):
    """Whether the service can do its work, and what it is."""

    status: str
    version: str
    drives_a_rig: bool


@router.get("", responses=problems())
def health(context: Context) -> Health:
    """Say whether the database answers."""
    with context.catalogue.reading() as session:
        list_runs(session, limit=1)
    return Health(status="ok", version=software_version(), drives_a_rig=context.runs is not None)
