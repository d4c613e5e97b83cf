"""Routes of runs: planning and listing them, and driving the one that is carried out."""

from collections.abc import Callable
from typing import Annotated, Any

from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter, Depends, Query, Request, Response

from api.service.access import ReaderContext, caller_of, check_scope, stranger
from api.service.context import Context, Rig, Services
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import IdempotentRequest, LeaseToken, driving, idempotent
from api.service.pages import Page, Paging
from api.service.parameters import (
    Day,
    IdempotencyKey,
    OptionalArticle,
    RunNumber,
    check_rising,
    document,
    first_of,
    links,
)
from api.service.problems import AccessError, problems
from jointlab.burst_log import AuditEvent
from jointlab.documents.fields import OneLine, Why
from jointlab.documents.runs import (
    Acknowledged,
    AmendmentDocument,
    Beginning,
    Continuation,
    NewAmendment,
    NewRun,
    PromptAnswer,
    RunDetails,
    RunEventDocument,
    RunSummary,
)
from jointlab.errors import ConflictError
from jointlab.runs.amendment import amend_article
from jointlab.sequences import sequence_named
from jointlab.supervision.lease import LeaseError
from rig.errors import RigError
from rig.registers import interlock_names
from rig.sequences.sequence import Sequence
from store.errors import StoreError
from store.measurements.amendments import list_amendments
from store.measurements.runs import day_limits, get_run, list_run_events, list_runs
from store.states import RunKind, RunState, Scope

router = APIRouter(prefix="/runs", tags=["runs"], route_class=TaggedRoute)
DRIVING = problems(404, 409, 502)
Unable = ConflictError | RigError | AccessError | None
"""Why a run could not be ended or paused."""
RESULTS = (
    "channels-of-run", "blows-and-points-points", "blows-and-points-blows", "blows-and-points-sine-records",
    "analyses-list", "FRFs-list", "modes-get", "joint-matrices-of-run", "dynamic-stiffness-of-run",
    "comparisons-of-run",
)  # fmt: skip
"""Requests that read what a run has recorded and what was computed of it."""
NEXT = links(
    201, "run_id", "runs-get", "runs-history", "runs-start", "runs-pause", "runs-resume", "runs-stop", "runs-answer",
    *RESULTS,
)  # fmt: skip


@router.get("", responses=problems() | first_of("run_id", "runs-get", "runs-history", *RESULTS))
def list_(
    context: ReaderContext,
    paging: Paging,
    state: RunState | None = None,
    kind: Annotated[RunKind | None, Query(description="measured from a sequence, or imported")] = None,
    article: OptionalArticle = None,
    specimen: Annotated[OneLine | None, Query(description="with sines or results of this joint's cylinders")] = None,
    since: Annotated[Day | None, Query(description="that began on this day (UTC) or later")] = None,
    until: Annotated[Day | None, Query(description="that began on this day (UTC) or before")] = None,
    text: Annotated[OneLine | None, Query(description="that the title contains, in large or small letters")] = None,
) -> Page[RunSummary]:
    """List runs, newest first."""
    check_rising("since", since, "until", until)
    first, end = day_limits(since, until)
    with context.catalogue.reading() as session:
        found = list_runs(
            session, kind=kind, state=state, article=article, specimen=specimen, text=text, since=first, until=end,
            before=paging.number, limit=paging.rows,
        )  # fmt: skip
    return paging.of_rows([document(RunSummary, run, started_at=run.began_at) for run in found])


@router.post("", status_code=201, response_model=RunSummary, responses=problems(404, 409) | NEXT)
def create(
    request: Annotated[IdempotentRequest, idempotent("create run", "new run", Scope.CONTROL)], rig: Rig, given: NewRun
) -> Response:
    """Store a run to be started later; its sequence is checked against limits and channels of the rig."""

    def plan() -> RunSummary:
        number = rig.plan(_sequence(request.services, given.sequence), request.caller.name)
        return _summary(request.services, number)

    return request.once(plan, 201)


@router.get("/{run_id}", responses=problems(404))
def get(context: ReaderContext, run_id: RunNumber) -> RunDetails:
    """One run."""
    run = context.catalogue.read(get_run, run_id)
    return document(RunDetails, run, started_at=run.began_at)


@router.get("/{run_id}/history", responses=problems(404))
def history(context: ReaderContext, paging: Paging, run_id: RunNumber) -> Page[RunEventDocument]:
    """How the run came to where it is, oldest first."""
    found = context.catalogue.read(list_run_events, run_id)
    return paging.of_whole([document(RunEventDocument, event) for event in found])


@router.get("/{run_id}/amendments", responses=problems(404))
def amendments(context: ReaderContext, paging: Paging, run_id: RunNumber) -> Page[AmendmentDocument]:
    """Amendments of the run's setup, oldest first."""
    found = context.catalogue.read(list_amendments, run_id)
    return paging.of_whole([document(AmendmentDocument, each) for each in found])


@router.post("/{run_id}/amendments", status_code=201, response_model=AmendmentDocument, responses=problems(404, 409))
def amend(
    request: Annotated[IdempotentRequest, idempotent("amend setup", "run {run_id}", Scope.CONTROL)],
    run_id: RunNumber,
    given: NewAmendment,
) -> Response:
    """Correct the article of a run. Records and results stay; what is computed from now on is of the new version."""

    def store() -> AmendmentDocument:
        with request.services.catalogue.writing() as session:
            made = amend_article(session, run_id, given.article, reason=given.reason, who=request.caller.name)
        return document(AmendmentDocument, made)

    return request.once(store, 201, **given.model_dump())


@router.post("/{run_id}/start", response_model=RunSummary, responses=DRIVING)
def start(
    request: Annotated[IdempotentRequest, driving("start run")],
    rig: Rig,
    run_id: RunNumber,
    how: Beginning | None = None,
) -> Response:
    """Begin a run that was created; answers when its instruments have answered, and the run is under way."""
    given = (how or Beginning()).model_dump()
    given["automatic"] = bool(given["automatic"])
    return _drive(
        request, run_id, lambda: rig.start(run_id, request.caller.name, lease=request.lease, **given), **given
    )


async def _at_once(
    request: Request, context: Context, rig: Rig, run_id: int, words: tuple[str, str], do: Callable[[str], object]
) -> Unable:
    """Bring the machine to rest for a caller who may; returns what went wrong, for a request that was not sent before.

    Where the database does not say who asks, it is done, too: everybody may stop the machine. Raises StoreError then.

    Args:
        words: the action as the audit log has it, and what the run is then.
        do: with the run, for the caller with this name.
    """
    silent: StoreError | None = None
    who = stranger(request)
    try:
        caller = await caller_of(request, soon=True)
        check_scope(caller, Scope.CONTROL)
        who = caller.name
    except AccessError as error:
        return error
    except StoreError as error:
        silent = error
    try:
        # it waits for no other request
        await to_thread.run_sync(do, who, limiter=CapacityLimiter(1))
    except (ConflictError, RigError) as error:
        if silent is not None:
            raise
        return error
    if silent is not None:
        action, so = words
        context.bursts.note(context.catalogue, AuditEvent(who, action, f"run {run_id}", "done"))
        raise StoreError(f"{_rests(rig, run_id, so)}; but {silent}") from silent
    return None


async def _answer_afterwards(
    request: IdempotentRequest, rig: Rig, run_id: int, unable: Unable, so: str, wait: Callable[[], object]
) -> Response:
    """Note what was done at once, or why it was not, `wait`, and answer with the run, which is `so` now."""

    def tell() -> RunSummary:
        if isinstance(unable, ConflictError):
            request.services.catalogue.read(get_run, run_id)  # NotFoundError where there is no such run
        if unable is not None:
            raise unable
        wait()
        return _summary(request.services, run_id)

    try:
        return await to_thread.run_sync(request.once, tell)
    except StoreError as error:
        if isinstance(unable, RigError):  # that the machine may move on comes first
            unable.add_note(str(error))
            raise unable from error
        if unable is not None:
            raise
        raise StoreError(f"{_rests(rig, run_id, so)}; but {error}") from error


def _rests(rig: Rig, run_id: int, so: str) -> str:
    return f"run {run_id} is {so}" + (", with the actuator at rest" if rig.state.is_driven else "")


async def _pause_at_once(
    request: Request, context: Context, rig: Rig, run_id: RunNumber, _key: IdempotencyKey, token: LeaseToken = None
) -> Unable:
    """Pause the run for the client with the control lease, which needs no database."""
    try:
        rig.lease.check(token)
    except LeaseError as error:
        return error
    return await _at_once(request, context, rig, run_id, ("pause run", "paused"), lambda _: rig.pause(run_id))


@router.post("/{run_id}/pause", response_model=RunSummary, responses=DRIVING)
async def pause(
    unable: Annotated[Unable, Depends(_pause_at_once)],
    request: Annotated[IdempotentRequest, idempotent("pause run", "run {run_id}", Scope.CONTROL)],
    rig: Rig,
    run_id: RunNumber,
) -> Response:
    """Pause the run where it is; answers with an actuator that it drives at rest.

    That is brought to rest first, also where the request was sent before, and where the database does not say
    who asks; only the answer waits for the database.
    """
    if isinstance(unable, LeaseError):
        await request.refuse_unless_answered(unable)
    return await _answer_afterwards(request, rig, run_id, unable, "paused", lambda: None)


@router.post("/{run_id}/resume", response_model=RunSummary, responses=DRIVING)
def resume(
    request: Annotated[IdempotentRequest, driving("resume run")],
    rig: Rig,
    run_id: RunNumber,
    how: Continuation | None = None,
) -> Response:
    """Let a paused run go on, or one that was stopped, failed or lost its process, at the next point not measured.

    The pause of a paused run is named by its number, `pause` of the rig. So a request that arrives late ends no other.
    """
    given = (how or Continuation()).model_dump()
    return _drive(
        request, run_id, lambda: rig.resume(run_id, request.caller.name, lease=request.lease, **given), **given
    )


async def _end_at_once(request: Request, context: Context, rig: Rig, run_id: RunNumber, _key: IdempotencyKey) -> Unable:
    """End the run for a caller who may."""
    return await _at_once(
        request, context, rig, run_id, ("stop run", "stopped"), lambda who: rig.end_run(run_id, who)
    )  # fmt: skip


@router.post("/{run_id}/stop", response_model=RunSummary, responses=DRIVING)
async def stop(
    unable: Annotated[Unable, Depends(_end_at_once)],
    request: Annotated[IdempotentRequest, idempotent("stop run", "run {run_id}", Scope.CONTROL)],
    rig: Rig,
    run_id: RunNumber,
) -> Response:
    """End the run and wait until it is stored; answers with an actuator that it drives at rest.

    That is brought to rest first, also where the request was sent before, and where the database does not say
    who asks; only the answer waits for the database. `POST /rig/stop` needs no key, and waits for nothing.
    """
    return await _answer_afterwards(request, rig, run_id, unable, "stopped", lambda: rig.wait(timeout=10.0))


@router.post("/{run_id}/answer", response_model=RunSummary, responses=DRIVING)
def answer(
    request: Annotated[IdempotentRequest, driving("answer prompt")], rig: Rig, run_id: RunNumber, given: PromptAnswer
) -> Response:
    """Confirm that the operator has done what a prompt asks for; the run goes on."""
    return _drive(request, run_id, lambda: rig.answer(run_id, given.prompt, request.lease), prompt=given.prompt)


@router.post("/{run_id}/acknowledge-interlock", response_model=Acknowledged, responses=DRIVING)
def acknowledge(
    request: Annotated[IdempotentRequest, driving("acknowledge interlock")], rig: Rig, run_id: RunNumber, why: Why
) -> Response:
    """Reset the tester that tripped in this run, because the cause has been removed; `resume` goes on then."""

    def reset() -> Acknowledged:
        _summary(request.services, run_id)
        return Acknowledged(interlocks=list(interlock_names(rig.acknowledge_interlocks(request.lease))))

    return request.once(reset, reason=why.reason)


def _drive(request: IdempotentRequest, run_id: int, do: Callable[[], object], **details: Any) -> Response:
    """Do something with a run, if that was not done before, and answer with the run; `details` go to the audit log."""

    def carry_out() -> RunSummary:
        try:
            do()
        except ConflictError:
            request.services.catalogue.read(get_run, run_id)  # NotFoundError where there is no such run
            raise
        return _summary(request.services, run_id)

    return request.once(carry_out, **details)


def _sequence(context: Services, given: str | Sequence) -> Sequence:
    if isinstance(given, Sequence):
        return given
    return context.catalogue.read(sequence_named, given)


def _summary(context: Services, run_id: int) -> RunSummary:
    run = context.catalogue.read(get_run, run_id)
    return document(RunSummary, run, started_at=run.began_at)
