"""Routes of health: what does not work, whether the service is alive, and whether it is ready."""

from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response

from api.service.context import Context
from api.service.problems import problem, problems
from jointlab.disk_probe import DiskProbe
from jointlab.documents.laboratory import Alive, Health, Ready
from jointlab.drive.phase import Phase
from store.errors import StoreError
from store.probe import DatabaseProbe
from store.version import software_version

router = APIRouter(prefix="/health", tags=["health"])
# coroutines, because all threads may wait for the database


async def _database(request: Request) -> DatabaseProbe:
    probe: DatabaseProbe = request.app.state.probe
    return probe


async def _disks(request: Request) -> DiskProbe:
    probe: DiskProbe = request.app.state.disks
    return probe


Database = Annotated[DatabaseProbe, Depends(_database)]
Disks = Annotated[DiskProbe, Depends(_disks)]


@router.get("", name="health", responses=problems(needs_key=False))
async def get_health(context: Context, database: Database, disks: Disks) -> Health:
    """Say what does not work, without waiting for it; a database that does not answer is a 503."""
    state, found = database.state, list[str]()
    if state.answers is False:
        raise StoreError(f"the database does not answer: {state.why}")
    if context.runs is not None:
        if (silent := context.runs.state.tester_silent) is not None:
            found.append(f"the rig does not answer: {silent}")
        if (waiting := context.runs.records_wait) is not None:
            found.append(f"records of the rig wait to be stored: {waiting}")
    if context.jobs is not None and (trouble := context.jobs.trouble) is not None:
        found.append(f"jobs wait: {trouble}")
    if disks.trouble is not None:
        found.append(disks.trouble)
    return Health(
        status="impaired" if found else "ok", impairments=tuple(found), version=software_version(),
        drives_a_rig=context.runs is not None,
    )  # fmt: skip


@router.get("/live", name="live", responses=problems(needs_key=False))
async def get_live() -> Alive:
    """Say that the service is alive: its event loop answers. Where nothing answers, start the service again."""
    return Alive(version=software_version())


@router.get("/ready", name="ready", response_model=Ready, responses=problems(needs_key=False))
async def get_ready(context: Context, database: Database, disks: Disks) -> Response | Ready:
    """Say whether the service can do its work; a 503 names each part that is missing. A restart cures none of them."""
    state, missing = database.state, list[str]()
    if state.answers is not True:
        missing.append(f"database: {state.why or 'it has not answered yet'}")
    if context.runs is not None and context.runs.state.phase is Phase.UNKNOWN:
        missing.append(f"drive process: {context.runs.state.tester_silent or 'it has not answered yet'}")
    if context.jobs is not None and (trouble := context.jobs.trouble) is not None:
        missing.append(f"executor of jobs: {trouble}")
    if disks.trouble is not None:
        missing.append(f"disk space: {disks.trouble}")
    return problem(503, "; ".join(missing)) if missing else Ready(version=software_version())
