"""Joint matrices: k, h and gamma of each joint by the inverse methods, with their 95 % intervals."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from api.service.access import Reader
from api.service.context import Context
from api.service.documents import OfAnalysis, RunNumber, Words
from api.service.etags import TaggedRoute
from api.service.pages import Cursor, Limit, Page, number_from, page_of, page_of_whole
from api.service.problems import problems
from jointlab.identification.document import plain
from jointlab.identification.save import unobservable_reasons
from store.analyses import Analysis, list_analyses
from store.errors import NotFoundError
from store.joint_matrices import JointMatrix, list_joint_matrices
from store.quantity import quantity
from store.result_queries import Element, ResultIds, find_elements
from store.runs import get_run
from store.states import AnalysisKind

router = APIRouter(tags=["joint matrices"], route_class=TaggedRoute)
Known = float | None
UNITS = "N/m, N, N m"


class JointMatrixDocument(BaseModel):
    """One joint by one method; rows and columns are x, y, rotation; an interval is [low, high], null is not known."""

    analysis_id: int
    method: str
    joint: str
    node: int
    k: Annotated[list[list[float]], quantity(UNITS, "stiffness")]
    k_ci95: Annotated[list[list[list[Known]]], quantity(UNITS)]
    h: Annotated[list[list[float]], quantity(UNITS, "structural damping")]
    h_ci95: Annotated[list[list[list[Known]]], quantity(UNITS)]
    gamma: Annotated[list[list[Known]], quantity("1", "loss factor; null where k is not distinguishable from zero")]
    gamma_ci95: Annotated[list[list[list[Known]]], quantity("1")]
    observable: list[list[bool]] = Field(description="false where only a prior or a sum determines the term")
    not_observable: dict[str, str] = Field(description="by term, such as k11, why it is not observable")

    @classmethod
    def of(cls, analysis: Analysis, found: JointMatrix) -> JointMatrixDocument:
        """What is shown of a joint."""
        return cls(
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


class ElementDocument(BaseModel):
    """One element of a joint's matrices; rows and columns 1, 2, 3 are x, y, rotation."""

    id: int
    analysis_id: int
    run_id: int
    joint: str
    matrix_row: int
    matrix_column: int
    stiffness: Annotated[float, quantity(UNITS)]
    stiffness_low: Annotated[Known, quantity(UNITS)]
    stiffness_high: Annotated[Known, quantity(UNITS)]
    damping: Annotated[float, quantity(UNITS)]
    damping_low: Annotated[Known, quantity(UNITS)]
    damping_high: Annotated[Known, quantity(UNITS)]
    loss_factor: Annotated[Known, quantity("1")]
    loss_factor_low: Annotated[Known, quantity("1")]
    loss_factor_high: Annotated[Known, quantity("1")]
    observable: bool

    @classmethod
    def of(cls, place: ResultIds, element: Element) -> ElementDocument:
        """What is shown of an element."""
        return cls(**place._asdict(), **element._asdict())


@router.get("/runs/{run_id}/joint-matrices", responses=problems(401, 403, 404, 500))
def of_run(
    _who: Reader,
    context: Context,
    run_id: RunNumber,
    method: Annotated[Words | None, Query(description="only by this method, as it is named in the answer")] = None,
    analysis: OfAnalysis = None,
    limit: Limit = 100,
    cursor: Cursor = None,
) -> Page[JointMatrixDocument]:
    """The joint matrices of a run, the newest by each method or those of one analysis."""
    with context.catalogue.reading() as session:
        get_run(session, run_id)
        newest = {
            made.method: made
            for made in reversed(list_analyses(session, run_id, AnalysisKind.JOINT_MATRICES))
            if method in (None, made.method) and analysis in (None, made.id)
        }
        if not newest:
            which = (f" by {method!r}" if method else "") + (f" of analysis {analysis}" if analysis else "")
            raise NotFoundError(f"run {run_id} has no joint matrices{which}")
        matrices = [
            JointMatrixDocument.of(made, found)
            for made in newest.values()
            for found in list_joint_matrices(session, made.id)
        ]
    return page_of_whole(matrices, limit, cursor)


@router.get("/joint-elements", responses=problems(401, 403))
def of_article(
    _who: Reader,
    context: Context,
    article: Annotated[Words, Query(description="the test article")],
    joint: Annotated[Words | None, Query(description="only of this joint")] = None,
    method: Annotated[Words | None, Query(description="only by this method")] = None,
    limit: Limit = 100,
    cursor: Cursor = None,
) -> Page[ElementDocument]:
    """Every element that was ever identified of an article's joints, newest first."""
    with context.catalogue.reading() as session:
        found = find_elements(
            session, article=article, joint=joint, method=method, before=number_from(cursor), limit=limit + 1
        )
    return page_of([ElementDocument.of(*each) for each in found], limit, lambda each: each.id)
