"""Routes of investigations: the cause of a gap by further experiments, each asked for and answered."""

from collections.abc import Callable
from typing import Annotated

from fastapi import APIRouter, Query, Response

from analysis.gap.experiments.requested_data import UNITS, Missing
from api.service.access import ReaderContext
from api.service.context import Jobs
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import IdempotentRequest, idempotent
from api.service.pages import Page, Paging
from api.service.parameters import document, first_of, links, number_of
from api.service.problems import problems
from jointlab.diagnosis.investigation import (
    Answer,
    Asked,
    Budget,
    Data,
    Probable,
    Readings,
    Refused,
    Step,
)
from jointlab.diagnosis.missing_text import missing_text
from jointlab.documents.fields import LARGEST, Request
from jointlab.documents.investigations import (
    AnswerDocument,
    BudgetDocument,
    ExplanationDocument,
    InvestigationDocument,
    InvestigationSummary,
    MissingDocument,
    MountingDocument,
    NewAnswer,
    NewBudget,
    NewInvestigation,
    RequestedDocument,
    StepDocument,
)
from jointlab.jobs.investigations import (
    StoredInvestigation,
    answer,
    begin,
    get_investigation,
    go_on,
    list_investigations,
    sequence_for_request,
    stop,
)
from rig.sequences.sequence import Sequence
from rig.tester.limits import TesterLimits
from store.catalogue import Catalogue
from store.states import InvestigationState, Scope

router = APIRouter(prefix="/investigations", tags=["investigations"], route_class=TaggedRoute)
InvestigationNumber = Annotated[int, number_of("investigation")]
ONE = ("get", "sequence", "answer", "continue", "stop")
OF_ONE = tuple(f"investigations-{name}" for name in ONE)
TARGET = "investigation {investigation_id}"


@router.get("", name="list_", responses=problems() | first_of("investigation_id", *OF_ONE))
def list_all(
    context: ReaderContext,
    paging: Paging,
    run: Annotated[int | None, Query(ge=1, le=LARGEST, description="only those of this run")] = None,
) -> Page[InvestigationSummary]:
    """List investigations, those begun last first."""
    found = context.catalogue.read(list_investigations, run_id=run, before=paging.number, limit=paging.rows)
    return paging.of_rows([_summarised(each) for each in found])


@router.post(
    "",
    status_code=202,
    response_model=InvestigationDocument,
    name="create",
    responses=problems(404, 409, 429) | links(202, "investigation_id", *OF_ONE),
)
def create(
    request: Annotated[IdempotentRequest, idempotent("begin investigation", "jobs", Scope.ANALYSE)],
    queue: Jobs,
    given: NewInvestigation,
) -> Response:
    """Begin an investigation: the run is diagnosed, then an experiment is asked for. It moves no machine by itself."""
    return _diagnosing(request, given, lambda _, who: begin(queue, given.run, _budget(Budget(), given), who))


@router.get("/{investigation_id}", name="get", responses=problems(404))
def get(context: ReaderContext, investigation_id: InvestigationNumber) -> InvestigationDocument:
    """One investigation: the verdict so far, its experiments, and what it asks for."""
    return _documented(context.catalogue.read(get_investigation, investigation_id))


@router.get("/{investigation_id}/sequence", name="sequence", responses=problems(404, 409, 502))
def sequence(context: ReaderContext, investigation_id: InvestigationNumber) -> Sequence:
    """The sequence of the experiment that it asks for, to be planned and started like any other."""
    limits = TesterLimits() if context.runs is None else context.runs.instruments.limits
    return context.catalogue.read(sequence_for_request, investigation_id, limits)[1]


@router.post(
    "/{investigation_id}/answer",
    status_code=202,
    response_model=InvestigationDocument,
    name="answer",
    responses=problems(404, 409, 429),
)
def take_answer(
    request: Annotated[IdempotentRequest, idempotent("answer investigation", TARGET, Scope.ANALYSE)],
    queue: Jobs,
    investigation_id: InvestigationNumber,
    given: NewAnswer,
) -> Response:
    """Answer what it asks for, with a run, with readings or with a refusal; all data are then diagnosed again."""
    return _diagnosing(
        request, given, lambda catalogue, who: answer(queue, catalogue, investigation_id, _answer_of(given), who)
    )


@router.post(
    "/{investigation_id}/continue",
    status_code=202,
    response_model=InvestigationDocument,
    name="continue",
    responses=problems(404, 409, 429),
)
def go_on_with_it(
    request: Annotated[IdempotentRequest, idempotent("continue investigation", TARGET, Scope.ANALYSE)],
    queue: Jobs,
    investigation_id: InvestigationNumber,
    given: NewBudget,
) -> Response:
    """Go on with one that was stopped, has failed or, with a larger budget, has spent its budget."""
    return _diagnosing(
        request,
        given,
        lambda catalogue, who: go_on(queue, catalogue, investigation_id, who, lambda present: _budget(present, given)),
    )


@router.post(
    "/{investigation_id}/stop", response_model=InvestigationDocument, name="stop", responses=problems(404, 409)
)
def stop_it(
    request: Annotated[IdempotentRequest, idempotent("stop investigation", TARGET, Scope.ANALYSE)],
    queue: Jobs,
    investigation_id: InvestigationNumber,
) -> Response:
    """Stop it; one that has ended stays as it is. A run at the rig has a STOP of its own."""

    def do() -> InvestigationDocument:
        catalogue, who = request.services.catalogue, request.caller.name
        return _documented(stop(queue, catalogue, investigation_id, who))

    return request.once(do)


def _diagnosing(
    request: IdempotentRequest, given: Request, act: Callable[[Catalogue, str], StoredInvestigation]
) -> Response:
    """Answer a request, once, that lets an investigation diagnose; `act` takes the catalogue and who asks."""

    def do() -> InvestigationDocument:
        return _documented(act(request.services.catalogue, request.caller.name))

    return request.once(do, 202, **given.model_dump(exclude_none=True))


def _budget(present: Budget, given: NewBudget) -> Budget:
    """The present budget with the values that are given."""
    return Budget(**(vars(present) | given.model_dump(exclude={"run"}, exclude_none=True)))


def _answer_of(given: NewAnswer) -> Answer:
    if given.run is not None:
        return Data(str(given.run))
    return Refused(given.refusal) if given.refusal is not None else Readings(dict(given.readings or {}))


def _summarised(found: StoredInvestigation) -> InvestigationSummary:
    """An investigation in short."""
    state = found.investigation
    last = state.steps[-1] if state.steps else None
    return InvestigationSummary(
        id=found.id,
        run=found.run,
        state=found.state,
        leads=None if last is None else _explanation(last),
        ended=None if last is None else last.ended,
        experiments=len(state.made),
        minutes=state.minutes,
        asked_by=found.first.asked_by,
        created_at=found.first.created_at,
        changed_at=found.job.finished_at or found.job.created_at,
    )


def _documented(found: StoredInvestigation) -> InvestigationDocument:
    """An investigation with all its steps."""
    state = found.investigation
    return InvestigationDocument(
        **dict(_summarised(found)),
        budget=document(BudgetDocument, state.budget),
        steps=[_step(each) for each in state.steps],
        job=found.job.id,
        error=found.job.error if found.state is InvestigationState.FAILED else None,
    )


def _step(step: Step) -> StepDocument:
    return document(
        StepDocument,
        step,
        leads=_explanation(step),
        beside=[_explanation(each) for each in step.beside],
        otherwise=[_requested(each) for each in step.otherwise if each.experiment.information],
        asked=None if step.asked is None else _requested(step.asked),
        answer=None if step.answer is None else _answer_document(step.answer),
        missing=[_missing(each) for each in step.missing],
    )


def _explanation(found: Step | Probable) -> ExplanationDocument:
    return document(ExplanationDocument, found)


def _requested(asked: Asked) -> RequestedDocument:
    experiment = asked.experiment
    return document(RequestedDocument, experiment, experiment=experiment.id, text=asked.text, readings=asked.readings)


def _missing(missing: Missing) -> MissingDocument:
    return document(
        MissingDocument,
        missing,
        text=missing_text([missing]),
        unit=UNITS.get(missing.what),
        points=list(map(str, missing.points)),
        mountings=[
            MountingDocument(specimen=each.specimen, configuration=each.configuration.name.lower())
            for each in missing.mountings
        ],
    )


def _answer_document(given: Answer) -> AnswerDocument:
    match given:
        case Data(source):
            return AnswerDocument(run=int(source))
        case Readings(values):
            return AnswerDocument(readings=values)
        case Refused(reason):
            return AnswerDocument(refusal=reason)
