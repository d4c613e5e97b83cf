"""An identification without joints is stored with its reason, and no older joints take its place."""

from dataclasses import replace
from pathlib import Path

import pytest
from sqlalchemy import text

from analysis.inverse.frequency_law import FrequencyLaw
from jointlab.identification.inverse import LIKELIHOOD, PAPER
from jointlab.identification.pipeline import Identification
from jointlab.identification.read import newest_joints, read_inverse, why_not_compared
from jointlab.identification.run import recompute
from jointlab.identification.save import save_identification
from store.catalogue import Catalogue
from store.errors import LeftOutError
from store.exports.content import content_of
from store.measurements.runs import Run, get_run
from store.results.analyses import latest_analysis
from store.results.modes import get_modes
from store.states import AnalysisKind
from tests.jointlab.identification.left_out import REASON, identified_then_left_out, without_joints


@pytest.fixture
def twice(catalogue: Catalogue, tmp_path: Path) -> tuple[Run, Identification]:
    """A run that was identified, and a second time with its joints left out; and the first of both."""
    number, found = identified_then_left_out(catalogue, tmp_path / "bundle")
    return catalogue.read(get_run, number), found


def test_reading_the_newest_joints_tells_why_there_are_none(
    catalogue: Catalogue, twice: tuple[Run, Identification]
) -> None:
    run, _ = twice
    for read in (newest_joints, read_inverse):
        with pytest.raises(LeftOutError, match="no joint matrices: no mode") as told:
            read(catalogue, run)
        assert told.value.reason == REASON
    with catalogue.reading() as session:
        modes = latest_analysis(session, run.id, AnalysisKind.MODES)
        with pytest.raises(LeftOutError, match="no modes: no mode"):
            get_modes(session, modes.id)
        assert why_not_compared(session, run.id) == REASON


def test_older_joints_and_modes_are_not_the_latest_of_a_query_or_an_export(
    catalogue: Catalogue, twice: tuple[Run, Identification]
) -> None:
    run, _ = twice
    with catalogue.reading() as session:
        for view in ("v_joint_stiffness", "v_modes"):
            latest = session.execute(text(f"SELECT latest, count(*) FROM {view} GROUP BY latest")).all()
            assert [bool(each) for each, _ in latest] == [False], view
        kinds = {part.kind for part in content_of(session, run.id).parts}
    assert kinds == {"frequency_responses"}


def test_older_joints_of_the_papers_method_are_not_the_latest_where_it_alone_is_left_out(
    catalogue: Catalogue, twice: tuple[Run, Identification]
) -> None:
    run, first = twice
    assert first.inverse is not None
    without_paper = replace(first.inverse, paper=None, paper_left_out="Too few points were struck")
    with catalogue.writing() as session:
        save_identification(session, run.id, first)
        save_identification(session, run.id, replace(first, inverse=without_paper))
    with catalogue.reading() as session:
        methods = session.scalars(text("SELECT DISTINCT method FROM v_joint_stiffness WHERE latest")).all()
        parts = content_of(session, run.id).parts
    assert methods == [LIKELIHOOD]
    assert {part.labels["method"] for part in parts if part.kind == AnalysisKind.JOINT_MATRICES} == {LIKELIHOOD}


def test_what_was_left_out_is_compared_with_what_is_computed_again(
    catalogue: Catalogue, twice: tuple[Run, Identification]
) -> None:
    run, _ = twice
    again, standing = recompute(catalogue, run.id)
    assert again.inverse is not None
    assert again.options.joint_law is FrequencyLaw.CONSTANT
    assert standing.startswith("It is not that of analysis")


def test_joints_that_are_identified_again_after_that_are_shown(
    catalogue: Catalogue, twice: tuple[Run, Identification]
) -> None:
    run, first = twice
    assert first.inverse is not None
    with catalogue.writing() as session:
        save_identification(session, run.id, first)
    assert list(newest_joints(catalogue, run)) == [LIKELIHOOD, PAPER]
    without_paper = replace(first.inverse, paper=None, paper_left_out="too few points")
    with catalogue.writing() as session:
        save_identification(session, run.id, without_joints(first))
        save_identification(session, run.id, replace(first, inverse=without_paper))
    assert list(newest_joints(catalogue, run)) == [LIKELIHOOD]
