"""Stored results of a run's identification, as analysis has them, and what the stored joints do on its beam."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from sqlalchemy.orm import Session

from analysis.dof import Dof
from analysis.frequency_response import FrequencyResponses, Real
from analysis.inverse.frequency_dependent_joints import accelerance_on
from analysis.inverse.identification import identify_joints
from analysis.inverse.tolerances import Deviations
from analysis.modes import Modes, poles_from
from analysis.structure.beam import FreeBeam
from analysis.structure.joints import Joint
from jointlab.identification.direct import Direct, direct_of
from jointlab.identification.inverse import LIKELIHOOD, METHODS, PAPER
from jointlab.identification.measurement import MeasuredArticle, dof, responses_of
from jointlab.identification.save import NOT_COMPARED, PAPER_LEFT_OUT, SUSPENDED_METHOD, setup_version_of
from jointlab.identification.sine_points import sine_point
from jointlab.identification.structure import beam_of, free_beam_with
from store.catalogue import Catalogue
from store.errors import NotFoundError, StoreError
from store.exchange.bundle_setup import Article, article_from
from store.measurements.amendments import setup_of_version
from store.measurements.frequency_responses import list_frequency_responses
from store.measurements.runs import Run
from store.results.analyses import NO_RESULT, Analysis, get_analysis, latest_analysis, list_analyses
from store.results.dynamic_stiffness import list_dynamic_stiffness
from store.results.joint_matrices import JointMatrix, list_joint_matrices
from store.results.modes import get_modes
from store.states import AnalysisKind

NEEDED_SETTINGS = {"youngs_modulus", "density", "elements", "parameters"}


def article_of(run: Run) -> Article:
    """The article of a run.

    Raises:
        NotFoundError: its setup describes none.
    """
    try:
        return article_from(run.setup)
    except StoreError as error:
        raise NotFoundError(f"run {run.id} has no article whose joints its results could be of: {error}") from error


def read_direct(catalogue: Catalogue, run: Run) -> dict[str, Direct]:
    """Results of the newest sine points of a run for each joint's cylinders, by joint.

    Raises:
        NotFoundError: the run has none, or no article.
    """
    with catalogue.reading() as session:
        newest = latest_analysis(session, run.id, AnalysisKind.DYNAMIC_STIFFNESS)
        points = tuple(map(sine_point, list_dynamic_stiffness(session, newest.id)))
    return direct_of(MeasuredArticle(run.title, article_of(run), (), points, raw=False))


def newest_joints(catalogue: Catalogue, run: Run) -> dict[str, tuple[Analysis, dict[str, JointMatrix]]]:
    """The newest joints of a run by method and name, each with its analysis, in the order of `METHODS`.

    Those of the paper's method are left out where the newest identification had none.

    Raises:
        NotFoundError: the run has none; LeftOutError with the reason where its newest identification has none.
    """
    with catalogue.reading() as session:
        return {
            made.method: (made, {joint.joint: joint for joint in list_joint_matrices(session, made.id)})
            for made in newest_joint_analyses(session, run.id)
        }


def newest_joint_analyses(session: Session, run_id: int) -> list[Analysis]:
    """The newest analysis with joints by each method of a run, in the order of `METHODS`.

    That of the paper's method is left out where the newest identification had none. One of a newest identification that
    has no joints at all stands alone, and reading its joints tells why.

    Raises:
        NotFoundError: the run has none.
    """
    newest = {made.method: made for made in reversed(list_analyses(session, run_id, AnalysisKind.JOINT_MATRICES))}
    if not newest:
        raise NotFoundError(f"run {run_id} has no joint matrices")
    if {PAPER, LIKELIHOOD} <= set(newest) and newest[PAPER].id not in newest[LIKELIHOOD].parents:
        del newest[PAPER]
    return [newest[method] for method in sorted(newest, key=[*METHODS, *newest].index)]


def why_not_compared(session: Session, run_id: int) -> str:
    """Why the newest joints of a run are not compared with the tester's, a phrase; empty where nothing forbids it."""
    newest = next(
        (each for each in list_analyses(session, run_id, AnalysisKind.JOINT_MATRICES) if each.method == LIKELIHOOD),
        None,
    )
    return "" if newest is None else str(newest.settings.get(NOT_COMPARED) or newest.settings.get(NO_RESULT) or "")


@dataclass(frozen=True, eq=False)
class StoredInverse:
    """The hammer experiment of a run as it is stored.

    Attributes:
        measured: the reference set.
        predicted: by the method's name in pictures, the accelerances of the beam on its joints at the measured lines.
        regressions: by joint, the observed and the fitted side of the equations of the paper's method; empty where it
            is left out.
        paper_left_out: why it is, a sentence; empty where it is not.
    """

    measured: FrequencyResponses
    predicted: Mapping[str, FrequencyResponses]
    regressions: Mapping[str, tuple[Real, Real]]
    paper_left_out: str


def read_inverse(catalogue: Catalogue, run: Run) -> StoredInverse:
    """The newest joints of a run on its beam, with the material, the mesh and the damping that they were found with.

    Raises:
        NotFoundError: the run has no article, no accelerances, or no joints by maximum likelihood; or an older version
            found these, which did not keep on what beam.
    """
    newest = newest_joints(catalogue, run)
    if LIKELIHOOD not in newest:
        raise NotFoundError(f"run {run.id} has no joints by maximum likelihood")
    likelihood, found = newest[LIKELIHOOD]
    if not set(likelihood.settings) >= NEEDED_SETTINGS:
        raise NotFoundError(f"analysis {likelihood.id} does not say on what beam its joints were found")
    with catalogue.reading() as session:
        version = setup_version_of(likelihood)
        article = article_of(replace(run, setup=setup_of_version(session, run.id, version)))
        measured = responses_of(list_frequency_responses(session, run.id)[0])
        parents = [get_analysis(session, number) for number in likelihood.parents]
    beam = _beam(article, likelihood, parents)
    names = list(found)
    fitted = Deviations.labelled(likelihood.settings["parameters"], measured.response, measured.inputs, names)
    predicted = {
        METHODS[method]: accelerance_on(
            beam,
            _on_beam(joints),
            fitted if method == LIKELIHOOD else Deviations.none(len(names), len(measured.inputs)),
            measured.frequency,
            measured.response,
            measured.inputs,
            measured.decay,
        )
        for method, (_, joints) in newest.items()
        if method in METHODS
    }
    regressions = _regressions(catalogue, article, beam, newest[PAPER][0]) if PAPER in newest else {}
    return StoredInverse(measured, predicted, regressions, likelihood.settings.get(PAPER_LEFT_OUT, ""))


def _regressions(
    catalogue: Catalogue, article: Article, beam: FreeBeam, paper: Analysis
) -> dict[str, tuple[Real, Real]]:
    modes = catalogue.read(get_modes, paper.parents[0])
    shapes = Modes(poles_from(modes.frequency, modes.loss_factor), modes.shapes, tuple(map(dof, modes.dofs)))
    nodes = {joint.name: joint.node for joint in article.joints}
    solved = identify_joints(beam, shapes, nodes, tuple(map(Dof.parse, paper.settings["points"])))
    return {name: (found.regression.observed, found.regression.fitted) for name, found in solved.items()}


def _beam(article: Article, likelihood: Analysis, parents: list[Analysis]) -> FreeBeam:
    settings = likelihood.settings
    drawn = beam_of(article)
    beam = replace(drawn, youngs_modulus=settings["youngs_modulus"], density=settings["density"])
    tested = next(
        (each.settings for each in parents if (each.kind, each.method) == (AnalysisKind.MODES, SUSPENDED_METHOD)), None
    )
    ratios = article.beam.free_damping_ratios if tested is None else tuple(tested["damping_ratios"])
    elements = settings["elements"] // (len(article.node_positions) - 1)
    return free_beam_with(article, beam, ratios, elements)


def _on_beam(joints: Mapping[str, JointMatrix]) -> list[Joint]:
    return [Joint(each.joint, each.node, each.stiffness + 1j * each.damping) for each in joints.values()]
