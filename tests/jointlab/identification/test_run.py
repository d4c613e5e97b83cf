"""A report is of the identification that is stored, by its choices, and says so where it cannot be."""

import numpy as np
from sqlalchemy import text

from analysis.inverse.frequency_law import FrequencyLaw
from analysis.modal.estimator import Estimator
from jointlab.identification.inverse import LIKELIHOOD
from jointlab.identification.options import Options
from jointlab.identification.read import read_inverse
from jointlab.identification.run import identify_run, recompute
from jointlab.identification.save import save_identification
from jointlab.runs.amendment import amend_article
from store.catalogue import Catalogue
from store.measurements.blows import list_blows, withdraw_blow
from store.measurements.runs import get_run
from store.results.analyses import add_analysis, list_analyses
from store.results.dynamic_stiffness import add_dynamic_stiffness, list_dynamic_stiffness
from store.states import AnalysisKind

CHOSEN = Options(
    without=("transducer_lag",), elements=1, joint_law=FrequencyLaw.CONSTANT, estimator=Estimator.HV,
    force_window=0.05, exponential_window=0.5,
)  # fmt: skip


def test_what_is_stored_is_found_again_by_its_choices_until_a_blow_is_taken_back(
    measured_catalogue: Catalogue, measured: int
) -> None:
    first = identify_run(measured_catalogue, measured, CHOSEN)
    with measured_catalogue.writing() as session:
        stored = save_identification(session, measured, first)
    again, standing = recompute(measured_catalogue, measured)
    assert again.options == CHOSEN
    assert standing == f"It is that of analysis {stored.likelihood_joints}"
    assert first.inverse is not None
    assert again.inverse is not None
    for name, joint in first.inverse.likelihood.joints.items():
        np.testing.assert_allclose(again.inverse.likelihood.joints[name].k_ci95, joint.k_ci95, rtol=1e-9)

    with measured_catalogue.writing() as session:  # a sweep that was stopped, identified, and resumed later
        (newest,) = list_analyses(session, measured, AnalysisKind.DYNAMIC_STIFFNESS)[:1]
        fewer = add_analysis(session, kind=newest.kind, method=newest.method, settings={}, runs=[measured])
        add_dynamic_stiffness(session, fewer, list_dynamic_stiffness(session, newest.id)[:-1])
    assert recompute(measured_catalogue, measured)[1].startswith("It is not that of analysis")

    with measured_catalogue.writing() as session:
        blow = next(each for each in list_blows(session, measured) if each.accepted and each.waveform is not None)
        assert blow.id is not None
        withdraw_blow(session, blow.id, "another mark was hit", "test")
    _, standing = recompute(measured_catalogue, measured)
    assert standing.startswith(f"It is not that of analysis {stored.likelihood_joints}: blows were taken back")

    with measured_catalogue.writing() as session:
        amend_article(session, measured, {"beam": {"density": 7900.0}}, reason="weighed", who="test")
    amended, standing = recompute(measured_catalogue, measured)
    assert standing.startswith(f"It is not that of analysis {stored.likelihood_joints}: the setup was amended since")
    with measured_catalogue.writing() as session:
        save_identification(session, measured, amended)
        run = get_run(session, measured)
        joints = list_analyses(session, measured, AnalysisKind.JOINT_MATRICES)
    newest = next(each for each in joints if each.method == LIKELIHOOD)
    assert (newest.settings["density"], newest.settings["setup_version"]) == (7900.0, 2)
    assert stored.likelihood_joints in {each.id for each in joints}
    # what is drawn of either is on the beam that it is of
    assert read_inverse(measured_catalogue, run).measured.inputs == again.inverse.measured.inputs


def test_a_run_whose_article_is_amended_is_identified_again_and_keeps_its_earlier_results(
    measured_catalogue: Catalogue, measured: int
) -> None:
    quick = Options(elements=1, joint_law=FrequencyLaw.CONSTANT)

    def rows() -> dict[tuple[int, str, str], tuple[float, bool]]:
        query = "SELECT analysis_id, joint, element, stiffness, latest FROM v_joint_stiffness WHERE method = :method"
        with measured_catalogue.reading() as session:
            found = session.execute(text(query), {"method": LIKELIHOOD})
            return {(row[0], row[1], row[2]): (row[3], bool(row[4])) for row in found}

    def identify() -> int | None:
        with measured_catalogue.writing() as session:
            found = identify_run(measured_catalogue, measured, quick)
            return save_identification(session, measured, found).likelihood_joints

    first = identify()
    before = rows()
    with measured_catalogue.writing() as session:
        amend_article(session, measured, {"beam": {"density": 7900.0}}, reason="weighed", who="test")
    second = identify()
    after = rows()
    earlier = {key: stiffness for key, (stiffness, _) in before.items() if key[0] == first}
    assert {key: stiffness for key, (stiffness, _) in after.items() if key[0] == first} == earlier
    assert {latest for (analysis, *_), (_, latest) in after.items() if analysis == first} == {False}
    assert {latest for (analysis, *_), (_, latest) in after.items() if analysis == second} == {True}
    k22 = {analysis: after[analysis, "I", "k22"][0] for analysis in (first, second) if analysis is not None}
    assert abs(k22[second or 0] / k22[first or 0] - 1) > 1e-4  # of a heavier beam
