"""What is stored of a run's identification, as analysis has it: for what page and report have in common."""

from __future__ import annotations

from jointlab.identification.direct import Direct, direct_of
from jointlab.identification.inverse import LIKELIHOOD, PAPER
from jointlab.identification.measurement import Measurement
from jointlab.identification.sine_points import sine_point
from store.analyses import Analysis, latest_analysis, list_analyses
from store.bundle_setup import Article, article_from
from store.catalogue import Catalogue
from store.dynamic_stiffness import list_dynamic_stiffness
from store.errors import NotFoundError, StoreError
from store.joint_matrices import JointMatrix, list_joint_matrices
from store.runs import Run
from store.states import AnalysisKind

METHODS = {LIKELIHOOD: "maximum likelihood", PAPER: "paper's method"}
"""The inverse methods by the names that pictures have for them."""


def article_of(run: Run) -> Article:
    """The article of a run.

    Raises:
        NotFoundError: its setup describes none.
    """
    try:
        return article_from(run.setup)
    except StoreError as error:
        raise NotFoundError(f"run {run.id} has no article whose joints its results could be of: {error}") from error


def stored_direct(catalogue: Catalogue, run: Run) -> dict[str, Direct]:
    """What the newest sine points of a run say of each joint's cylinders, by joint.

    Raises:
        NotFoundError: the run has none, or no article.
    """
    with catalogue.reading() as session:
        newest = latest_analysis(session, run.id, AnalysisKind.DYNAMIC_STIFFNESS)
        points = tuple(map(sine_point, list_dynamic_stiffness(session, newest.id)))
    return direct_of(Measurement(run.title, article_of(run), (), points, raw=False))


def newest_joints(catalogue: Catalogue, run: Run) -> dict[str, tuple[Analysis, dict[str, JointMatrix]]]:
    """The newest joints of a run by method and name, each with its analysis, in the order of `METHODS`.

    Raises:
        NotFoundError: the run has none.
    """
    newest: dict[str, tuple[Analysis, dict[str, JointMatrix]]] = {}
    with catalogue.reading() as session:
        for analysis in list_analyses(session, run.id, AnalysisKind.JOINT_MATRICES):
            if analysis.method not in newest:
                joints = {joint.joint: joint for joint in list_joint_matrices(session, analysis.id)}
                newest[analysis.method] = analysis, joints
    if not newest:
        raise NotFoundError(f"run {run.id} has no joint matrices")
    return {method: newest[method] for method in sorted(newest, key=[*METHODS, *newest].index)}
