"""Routes of results: of one run, the newest or those of one analysis, and of a test article over all its runs."""

from typing import Annotated

import numpy as np
from fastapi import APIRouter, Path, Query, Response

from analysis.comparison import Agreement
from api.service.access import ReaderContext
from api.service.context import Jobs
from api.service.etags import TaggedRoute
from api.service.idempotent_requests import IdempotentRequest
from api.service.pages import LongPaging, Page, Paging
from api.service.parameters import ArticleName, ChosenAnalysis, RunNumber, check_rising, document, first_of, number_of
from api.service.problems import problems
from api.service.resources.jobs import queue_job, queueing, queues
from jointlab.documents.fields import LARGEST, LARGEST_EXACT, OneLine
from jointlab.documents.jobs import OfRun
from jointlab.documents.results import (
    AnalysisDocument,
    ComparisonDocument,
    DiagnosisDocument,
    DiagnosisSummary,
    ElementDocument,
    FoundComparison,
    FoundPoint,
    FrequencyResponseDocument,
    JointMatrixDocument,
    ModesDocument,
    SetSummary,
    StiffnessPoint,
)
from jointlab.documents.stiffness import HIGHEST_FREQUENCY, LARGEST_AMPLITUDE, StiffnessDocument
from jointlab.identification.document import plain
from jointlab.identification.law import laws_of_points, points_of_run, stiffness_at
from jointlab.identification.law_document import stiffness_document
from jointlab.identification.read import newest_joint_analyses, why_not_compared
from jointlab.identification.save import unobservable_reasons
from store.errors import NotFoundError
from store.measurements.frequency_responses import FrequencyResponseSet, list_frequency_responses
from store.measurements.runs import get_run
from store.results.analyses import Analysis, chosen_analysis, list_analyses
from store.results.comparisons import list_comparisons
from store.results.diagnoses import get_diagnosis, list_diagnoses
from store.results.dynamic_stiffness import list_dynamic_stiffness
from store.results.joint_matrices import JointMatrix, list_joint_matrices
from store.results.modes import get_modes
from store.results.result_queries import find_comparisons, find_elements, find_sine_points
from store.states import AnalysisKind, ConfigurationName
from store.validation import TextLike

analyses = APIRouter(prefix="/runs/{run_id}/analyses", tags=["analyses"], route_class=TaggedRoute)
frequency_responses = APIRouter(prefix="/runs/{run_id}/frequency-responses", tags=["FRFs"], route_class=TaggedRoute)
modes = APIRouter(prefix="/runs/{run_id}/modes", tags=["modes"], route_class=TaggedRoute)
joint_matrices = APIRouter(tags=["joint matrices"], route_class=TaggedRoute)
dynamic_stiffness = APIRouter(tags=["dynamic stiffness"], route_class=TaggedRoute)
comparisons = APIRouter(tags=["comparisons"], route_class=TaggedRoute)
diagnoses = APIRouter(prefix="/diagnoses", tags=["gap diagnoses"], route_class=TaggedRoute)
SpecimenName = Annotated[OneLine | None, Query(description="only of this joint's cylinders")]
Configuration = Annotated[ConfigurationName | None, Query(description="only in this one")]
JointName = Annotated[OneLine | None, Query(description="only of this joint")]


@analyses.get("", name="list_", responses=problems(404))
def list_all_analyses(
    context: ReaderContext, paging: Paging, run_id: RunNumber, kind: AnalysisKind | None = None
) -> Page[AnalysisDocument]:
    """List the analyses of a run, newest first."""
    with context.catalogue.reading() as session:
        get_run(session, run_id)
        found = list_analyses(session, run_id, kind)
    return paging.of_whole([document(AnalysisDocument, each) for each in found])


@frequency_responses.get("", name="list_", responses=problems(404, 500))
def list_sets(
    context: ReaderContext, paging: Paging, run_id: RunNumber, analysis: ChosenAnalysis = None
) -> Page[SetSummary]:
    """The accelerances of a run, the newest or those of one analysis, set by set."""
    sets = context.catalogue.read(list_frequency_responses, run_id, analysis)
    return paging.of_whole([_set(found) for found in sets])


@frequency_responses.get("/{set_number}/{point}", name="get", responses=problems(404, 500))
def one_accelerance(
    context: ReaderContext,
    run_id: RunNumber,
    set_number: Annotated[int, Path(ge=1, le=10_000, description="number of the set, from 1")],
    point: Annotated[
        str,
        TextLike(r"^[1-9][0-9]{0,5}[xyr]$", "write node and direction, such as 3y"),
        Path(description="where the hammer struck, such as 3y"),
    ],
    analysis: ChosenAnalysis = None,
) -> FrequencyResponseDocument:
    """The accelerance of a run from one blow point, the newest or that of one analysis."""
    sets = context.catalogue.read(list_frequency_responses, run_id, analysis)
    for found in sets:
        inputs = [str(each) for each in found.inputs]
        if found.number == set_number and point in inputs:
            row = inputs.index(point)
            accelerance = np.asarray(found.accelerance[row])
            return FrequencyResponseDocument(
                response=str(found.response),
                input=point,
                frequency=found.frequency.tolist(),
                real=accelerance.real.tolist(),
                imaginary=accelerance.imag.tolist(),
                coherence=None if found.coherence is None else plain(found.coherence[row]),
                variance=None if found.variance is None else plain(found.variance[row]),
            )
    raise NotFoundError(f"run {run_id} has no accelerance of set {set_number} from {point}")


@modes.get("", name="get", responses=problems(404, 500))
def modes_of_run(context: ReaderContext, run_id: RunNumber, analysis: ChosenAnalysis = None) -> ModesDocument:
    """The modes of a run, the newest or those of one analysis."""
    with context.catalogue.reading() as session:
        made = chosen_analysis(session, run_id, AnalysisKind.MODES, analysis)
        found = get_modes(session, made.id)
    return ModesDocument(
        analysis_id=made.id,
        method=made.method,
        frequency_hz=plain(found.frequency),
        frequency_ci95=plain(found.frequency_ci95),
        loss_factor=plain(found.loss_factor),
        loss_factor_ci95=plain(found.loss_factor_ci95),
        predicted_hz=plain(found.predicted_frequency),
        points=[str(dof) for dof in found.dofs],
        shapes_real=plain(found.shapes.real),
        shapes_imaginary=plain(found.shapes.imag),
    )


@joint_matrices.get("/runs/{run_id}/joint-matrices", name="of_run", responses=problems(404, 500))
def joint_matrices_of_run(
    context: ReaderContext,
    paging: Paging,
    run_id: RunNumber,
    method: Annotated[OneLine | None, Query(description="only by this method, as it is named in the answer")] = None,
    analysis: ChosenAnalysis = None,
) -> Page[JointMatrixDocument]:
    """The joint matrices of a run, those of its newest identification by each method or those of one analysis.

    404 says why, where the newest identification has none.
    """
    with context.catalogue.reading() as session:
        get_run(session, run_id)
        kind = AnalysisKind.JOINT_MATRICES
        chosen = (
            newest_joint_analyses(session, run_id)
            if analysis is None
            else [chosen_analysis(session, run_id, kind, analysis)]
        )
        every = [(made, found) for made in chosen for found in list_joint_matrices(session, made.id)]
    matrices = [_joint_matrix(made, found) for made, found in every if method in (None, made.method)]
    if not matrices:
        raise NotFoundError(f"run {run_id} has no joint matrices by {method!r}")
    return paging.of_whole(matrices)


@joint_matrices.get("/joint-elements", name="of_article", responses=problems())
def elements_of_article(
    context: ReaderContext,
    paging: Paging,
    article: ArticleName,
    joint: JointName = None,
    method: Annotated[OneLine | None, Query(description="only by this method")] = None,
) -> Page[ElementDocument]:
    """Every element that was ever identified of an article's joints, newest first."""
    found = context.catalogue.read(
        find_elements, article=article, joint=joint, method=method, before=paging.number, limit=paging.rows
    )
    return paging.of_rows([document(ElementDocument, each, **place._asdict()) for place, each in found])


@dynamic_stiffness.get("/runs/{run_id}/dynamic-stiffness", name="of_run", responses=problems(404))
def sine_points_of_run(
    context: ReaderContext,
    paging: LongPaging,
    run_id: RunNumber,
    specimen: SpecimenName = None,
    configuration: Configuration = None,
    analysis: ChosenAnalysis = None,
) -> Page[StiffnessPoint]:
    """The sine points of a run, the newest or those of one analysis, in the order of measuring."""
    with context.catalogue.reading() as session:
        made = chosen_analysis(session, run_id, AnalysisKind.DYNAMIC_STIFFNESS, analysis)
        found = list_dynamic_stiffness(session, made.id)
    return paging.of_whole(
        [
            document(StiffnessPoint, point, analysis_id=made.id)
            for point in found
            if specimen in (None, point.specimen) and configuration in (None, point.configuration)
        ]
    )


@dynamic_stiffness.get("/dynamic-stiffness", name="of_article", responses=problems())
def sine_points_of_article(
    context: ReaderContext,
    paging: Paging,
    article: ArticleName,
    specimen: SpecimenName = None,
    configuration: Configuration = None,
    amplitude_pp_mm: Annotated[float | None, Query(gt=0, le=100, description="only at this amplitude, mm")] = None,
    frequency: Annotated[float | None, Query(gt=0, le=1e6, description="only at this commanded frequency, Hz")] = None,
    lowest_frequency: Annotated[float | None, Query(ge=0, le=1e6, description="Hz")] = None,
    highest_frequency: Annotated[float | None, Query(ge=0, le=1e6, description="Hz")] = None,
) -> Page[FoundPoint]:
    """Every sine point that was ever evaluated of an article's specimens, newest first."""
    check_rising("lowest_frequency", lowest_frequency, "highest_frequency", highest_frequency)
    found = context.catalogue.read(
        find_sine_points,
        article=article,
        specimen=specimen,
        configuration=configuration,
        amplitude_pp_mm=amplitude_pp_mm,
        frequency=frequency,
        lowest_frequency=lowest_frequency,
        highest_frequency=highest_frequency,
        before=paging.number_up_to(LARGEST_EXACT),
        limit=paging.rows,
    )
    return paging.of_rows([document(FoundPoint, point, **place._asdict()) for place, point in found])


@dynamic_stiffness.get("/runs/{run_id}/dynamic-stiffness/at", responses=problems(404))
def at(
    context: ReaderContext,
    run_id: RunNumber,
    amplitude_pp_mm: Annotated[
        float, Query(gt=0, le=LARGEST_AMPLITUDE, description="peak to peak, mm", examples=[0.03])
    ],
    frequency: Annotated[float, Query(gt=0, le=HIGHEST_FREQUENCY, description="Hz", examples=[80])],
    specimen: Annotated[
        list[OneLine] | None, Query(description="only these joints' cylinders; repeat for several")
    ] = None,
) -> StiffnessDocument:
    """The fitted law of each joint at any amplitude and frequency, and the range of a single specimen of the kind.

    The law goes through the newest sine points of the run. It is fitted when it is first asked for, which takes a
    second for a whole sweep of two joints, and kept.
    """
    analysis = points_of_run(context.catalogue, run_id)
    laws = laws_of_points(context.catalogue, run_id, analysis)
    return stiffness_document(stiffness_at(laws, 1e-3 * amplitude_pp_mm, frequency, specimen or ()), analysis)


@comparisons.get("/runs/{run_id}/comparisons", name="of_run", responses=problems(404))
def comparison_of_run(
    context: ReaderContext, paging: Paging, run_id: RunNumber, analysis: ChosenAnalysis = None
) -> Page[ComparisonDocument]:
    """The comparison on a run, element by element: the newest or that of one analysis.

    404 says why, where the newest joints are not compared.
    """
    with context.catalogue.reading() as session:
        if analysis is None and (why := why_not_compared(session, run_id)):
            raise NotFoundError(f"the joints of run {run_id} are not compared: {why}")
        made = chosen_analysis(session, run_id, AnalysisKind.COMPARISONS, analysis)
        found = list_comparisons(session, made.id)
    return paging.of_whole([document(ComparisonDocument, each) for each in found])


@comparisons.get("/comparisons", name="of_article", responses=problems())
def comparisons_of_article(
    context: ReaderContext,
    paging: Paging,
    article: ArticleName,
    joint: JointName = None,
    verdict: Annotated[Agreement | None, Query(description="only with this one")] = None,
) -> Page[FoundComparison]:
    """Every comparison that was ever made on an article, newest first."""
    found = context.catalogue.read(
        find_comparisons, article=article, joint=joint, verdict=verdict, before=paging.number, limit=paging.rows
    )
    return paging.of_rows([document(FoundComparison, each, **ids._asdict()) for ids, each in found])


@diagnoses.get("", name="list_", responses=problems() | first_of("diagnosis_id", "gap-diagnoses-get"))
def list_all_diagnoses(
    context: ReaderContext,
    paging: Paging,
    run: Annotated[int | None, Query(ge=1, le=LARGEST, description="only of this run")] = None,
) -> Page[DiagnosisSummary]:
    """List diagnoses, newest first."""
    found = context.catalogue.read(list_diagnoses, run_id=run, before=paging.number, limit=paging.rows)
    return paging.of_rows([document(DiagnosisSummary, each, id=each.analysis_id) for each in found])


@diagnoses.post("", **queues(404))
def diagnose(request: Annotated[IdempotentRequest, queueing("diagnose")], queue: Jobs, given: OfRun) -> Response:
    """Queue a diagnosis of a run; the job's result has its number."""
    return queue_job(request, queue, "diagnose", given.model_dump(), (given.run,))


@diagnoses.get("/{diagnosis_id}", name="get", responses=problems(404))
def one_diagnosis(context: ReaderContext, diagnosis_id: Annotated[int, number_of("diagnosis")]) -> DiagnosisDocument:
    """One diagnosis."""
    found = context.catalogue.read(get_diagnosis, diagnosis_id)
    return document(DiagnosisDocument, found, id=found.analysis_id)


def _set(found: FrequencyResponseSet) -> SetSummary:
    return document(
        SetSummary,
        found,
        response=str(found.response),
        inputs=[str(point) for point in found.inputs],
        lines=int(found.frequency.size),
        highest_frequency=float(found.frequency[-1]),
    )


def _joint_matrix(analysis: Analysis, found: JointMatrix) -> JointMatrixDocument:
    return JointMatrixDocument(
        analysis_id=analysis.id,
        method=analysis.method,
        joint=found.joint,
        node=found.node,
        k=plain(found.stiffness),
        k_ci95=plain(found.stiffness_ci95),
        h=plain(found.damping),
        h_ci95=plain(found.damping_ci95),
        gamma=plain(found.loss_factor),
        gamma_ci95=plain(found.loss_factor_ci95),
        observable=plain(found.observable),
        not_observable=unobservable_reasons(analysis, found.joint),
    )
