"""Runs: what was measured, is being measured, and is to be measured; and steering the one that is carried out."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from anyio import CapacityLimiter, to_thread
from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, ConfigDict, Field

from api.service.access import Reader
from api.service.context import Context, Rig, Services
from api.service.documents import Name, RunNumber, WholeSequence, Why, Words
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import Act, acting, driving
from api.service.links import RESULTS, first_of, run_links
from api.service.pages import LARGEST, Cursor, Limit, Page, number_from, page_of, page_of_whole
from api.service.problems import problems
from api.service.resources.sequences import sequence_named
from jointlab.errors import ConflictError
from rig.errors import RigError
from rig.sequence import Sequence
from store.errors import StoreError
from store.runs import Run, get_run, list_run_events, list_runs
from store.states import RunState, Scope

router = APIRouter(prefix="/runs", tags=["runs"], route_class=TaggedRoute)
DRIVING = problems(401, 403, 404, 409, 502)


class RunSummary(BaseModel):
    """One run; times are UTC."""

    id: int
    kind: str
    state: RunState
    title: str
    article: str
    started_at: datetime
    finished_at: datetime | None
    reason: str | None
    configuration_hash: str
    software_version: str

    @classmethod
    def of(cls, run: Run) -> RunSummary:
        """What is shown of a run."""
        return cls(**{name: getattr(run, name) for name in cls.model_fields})


class RunDetails(RunSummary):
    """One run with what was built and what was asked for."""

    setup: dict[str, object] = Field(description="as a bundle's setup.json has it")
    sequence: dict[str, object] = Field(description="as it is carried out; empty where the run was imported")


class RunEventDocument(BaseModel):
    """A run came into a state; times are UTC."""

    state: RunState
    reason: str | None
    who: str | None
    happened_at: datetime


class NewRun(BaseModel):
    """What is to be measured."""

    model_config = ConfigDict(extra="forbid")

    sequence: Name | WholeSequence = Field(description="name of a sequence that is kept, or a whole one")


class Beginning(BaseModel):
    """How a run begins or goes on."""

    model_config = ConfigDict(extra="forbid")

    automatic: bool = Field(default=False, description="let the hands of a simulated bench strike and mount, unasked")
    reset: bool = Field(default=False, description="reset a tripped tester, because its cause has been seen to")


class PromptAnswer(BaseModel):
    """What the operator was asked for is done."""

    model_config = ConfigDict(extra="forbid")

    prompt: int = Field(ge=1, le=LARGEST, description="number of the prompt")


class Acknowledged(BaseModel):
    """Interlocks of the tester that were reset; none where none had tripped."""

    interlocks: list[str]


@router.get("", responses=problems(401, 403) | first_of("run_id", "runs-get", "runs-history", *RESULTS))
def list_(
    _who: Reader,
    context: Context,
    state: RunState | None = None,
    kind: Annotated[Words | None, Query(description="sequence, import, ...")] = None,
    article: Annotated[Words | None, Query(description="the test article")] = None,
    limit: Limit = 100,
    cursor: Cursor = None,
) -> Page[RunSummary]:
    """List runs, newest first."""
    with context.catalogue.reading() as session:
        found = list_runs(
            session, kind=kind, state=state, article=article, limit=limit + 1, before=number_from(cursor)
        )  # fmt: skip
    return page_of([RunSummary.of(run) for run in found], limit, lambda run: run.id)


@router.post("", status_code=201, response_model=RunSummary, responses=problems(401, 403, 404, 409) | run_links())
def create(
    act: Annotated[Act, acting("create run", "new run", Scope.CONTROL)], context: Context, rig: Rig, wanted: NewRun
) -> Response:
    """Store a run to be started later; its sequence is checked against the limits of the rig."""

    def plan() -> RunSummary:
        number = rig.plan(_sequence(context, wanted.sequence), act.who.name)
        return _summary(context, number)

    return act.once(plan, 201)


@router.get("/{run_id}", responses=problems(401, 403, 404))
def get(_who: Reader, context: Context, run_id: RunNumber) -> RunDetails:
    """One run."""
    with context.catalogue.reading() as session:
        run = get_run(session, run_id)
    return RunDetails(**RunSummary.of(run).model_dump(), setup=run.setup, sequence=run.sequence)


@router.get("/{run_id}/history", responses=problems(401, 403, 404))
def history(
    _who: Reader, context: Context, run_id: RunNumber, limit: Limit = 100, cursor: Cursor = None
) -> Page[RunEventDocument]:
    """How the run came to where it is, oldest first."""
    with context.catalogue.reading() as session:
        found = list_run_events(session, run_id)
    return page_of_whole([RunEventDocument(**vars(event)) for event in found], limit, cursor)


@router.post("/{run_id}/start", response_model=RunSummary, responses=DRIVING)
def start(
    act: Annotated[Act, driving("start run")],
    context: Context,
    rig: Rig,
    run_id: RunNumber,
    how: Beginning | None = None,
) -> Response:
    """Begin a run that was created; answers when its instruments have answered, and the run is under way."""
    how = how or Beginning()

    def begin() -> RunSummary:
        rig.start(run_id, act.who.name, automatic=how.automatic, reset=how.reset)
        return _summary(context, run_id)

    return act.once(begin, **how.model_dump())


@router.post("/{run_id}/pause", response_model=RunSummary, responses=DRIVING)
def pause(act: Annotated[Act, driving("pause run")], context: Context, rig: Rig, run_id: RunNumber) -> Response:
    """Hold the run where it is; answers with the actuator at rest."""

    def hold() -> RunSummary:
        rig.pause(run_id)
        return _summary(context, run_id)

    return act.once(hold)


@router.post("/{run_id}/resume", response_model=RunSummary, responses=DRIVING)
def resume(
    act: Annotated[Act, driving("resume run")],
    context: Context,
    rig: Rig,
    run_id: RunNumber,
    how: Beginning | None = None,
) -> Response:
    """Let a paused run go on, or one that was stopped, failed or lost its process, at the next point not measured."""
    how = how or Beginning()

    def go_on() -> RunSummary:
        rig.resume(run_id, act.who.name, automatic=how.automatic, reset=how.reset)
        return _summary(context, run_id)

    return act.once(go_on, **how.model_dump())


@router.post("/{run_id}/stop", response_model=RunSummary, responses=DRIVING)
async def stop(
    act: Annotated[Act, acting("stop run", "run {run_id}", Scope.CONTROL)],
    context: Context,
    rig: Rig,
    run_id: RunNumber,
) -> Response:
    """End the run and wait until it is stored; answers with the actuator at rest.

    The actuator is brought to rest first, also where the request was sent before; only the answer waits for the
    database. `POST /rig/stop` needs no key, and waits for nothing.
    """
    unable: ConflictError | RigError | None = None
    try:
        await to_thread.run_sync(rig.stop, run_id, limiter=CapacityLimiter(1))  # a stop waits for nobody
    except (ConflictError, RigError) as error:
        unable = error  # for a request that was not sent before

    def end() -> RunSummary:
        if unable is not None:
            raise unable
        rig.wait(timeout=10.0)
        return _summary(context, run_id)

    try:
        return await to_thread.run_sync(act.once, end)
    except StoreError as error:
        if unable is not None:
            raise
        raise StoreError(f"run {run_id} is stopped, with the actuator at rest; but {error}") from error


@router.post("/{run_id}/answer", response_model=RunSummary, responses=DRIVING)
def answer(
    act: Annotated[Act, driving("answer prompt")], context: Context, rig: Rig, run_id: RunNumber, given: PromptAnswer
) -> Response:
    """Say that what the operator was asked for is done; the run goes on."""

    def reply() -> RunSummary:
        rig.answer(run_id, given.prompt)
        return _summary(context, run_id)

    return act.once(reply, prompt=given.prompt)


@router.post("/{run_id}/acknowledge-interlock", response_model=Acknowledged, responses=DRIVING)
def acknowledge(
    act: Annotated[Act, driving("acknowledge interlock")], context: Context, rig: Rig, run_id: RunNumber, why: Why
) -> Response:
    """Reset the tester that had tripped in this run, because its cause has been seen to; `resume` goes on then."""

    def reset() -> Acknowledged:
        _summary(context, run_id)
        return Acknowledged(interlocks=list(rig.acknowledge_interlocks()))

    return act.once(reset, reason=why.reason)


def _sequence(context: Services, wanted: str | Sequence) -> Sequence:
    if isinstance(wanted, Sequence):
        return wanted
    with context.catalogue.reading() as session:
        return sequence_named(session, wanted)


def _summary(context: Services, run_id: int) -> RunSummary:
    with context.catalogue.reading() as session:
        return RunSummary.of(get_run(session, run_id))
