"""Routes of the hall: every rig's state from its own drive process, and a STOP for each."""

from typing import Annotated

from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter, Path, Request

from api.service.access import ReaderContext, stranger
from api.service.context import Context
from api.service.pages import Page, Paging
from api.service.problems import problems
from jointlab.burst_log import AuditEvent
from jointlab.documents.rig import HallRigDocument, HallRigState, RigStopped
from rig.errors import RigError
from store.errors import NotFoundError

router = APIRouter(prefix="/rigs", tags=["rigs"])


@router.get("", name="list", responses=problems())
def list_rigs(context: ReaderContext, paging: Paging) -> Page[HallRigDocument]:
    """The rigs of `[[hall]]` in the configuration, as their drive processes say it."""
    seen_rigs = () if context.hall is None else context.hall.seen()
    rigs = [
        HallRigDocument(
            rig=seen.given.rig,
            page=None if seen.given.page is None else str(seen.given.page),
            heard_at=seen.heard_at,
            trouble=seen.trouble or None,
            state=None if seen.state is None else HallRigState.model_validate(seen.state.model_dump()),
        )
        for seen in seen_rigs
    ]
    return paging.of_whole(rigs)


@router.post("/{name}/stop", responses=problems(404, 502, needs_key=False))
async def stop(
    request: Request, context: Context, name: Annotated[str, Path(description="of the rig", max_length=50)]
) -> RigStopped:
    """STOP for a rig of the hall; answers with a driven actuator at rest. It needs no key, and stands until reset.

    The drive process of the rig listens for STOP by itself, too, and is reached there where this service is not.
    """
    hall = context.hall
    if hall is None or name not in hall.names:
        raise NotFoundError(f"[[hall]] has no rig {name!r}")
    own_thread = CapacityLimiter(1)  # a stop does not wait for readers, and not for the stop of another rig
    try:
        detail = await to_thread.run_sync(hall.stop, name, limiter=own_thread)
    except RigError as error:
        _note(request, context, name, f"failed: {error}")
        raise
    _note(request, context, name, "done")
    return RigStopped(rig=name, detail=detail)


def _note(request: Request, context: Context, name: str, outcome: str) -> None:
    """Note a stop; its caller does not wait for the database."""
    context.bursts.note(context.catalogue, AuditEvent(stranger(request), "stop", f"rig {name}", outcome))
