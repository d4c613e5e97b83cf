"""A run's article is amended after the measurement: a new version beside the one that it was measured with."""

import copy
import math
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from jointlab.errors import ConflictError, JointlabError
from jointlab.runs.amendment import amend_article
from jointlab.sequences import BUILT_IN, built_in, sequence_of
from rig.errors import RequestError
from store.catalogue import Catalogue
from store.errors import NotFoundError, StoreError
from store.measurements.amendments import list_amendments, setup_of_version
from store.measurements.runs import finish_run, get_run, list_runs, start_run
from store.models.measurements import SetupAmendmentRow
from store.states import RunState
from tests.databases import is_waiting
from tests.postgresql_server import Server
from tests.waiting import until

WHY = {"reason": "the length was mistyped", "who": "bench"}
RIGHT = {"beam": {"length": 0.914}}


def stored(catalogue: Catalogue, state: RunState = RunState.RUNNING) -> int:
    """The run of an older version, which let a beam of another length pass."""
    sequence: dict[str, Any] = copy.deepcopy(built_in(BUILT_IN).model_dump(mode="json"))
    sequence["article"]["beam"]["length"] = 0.95
    setup = sequence["article"] | {"direct": {"file": "direct.csv", "preset_mm": 0.5}}
    with catalogue.writing() as session:
        run = start_run(
            session, kind="sequence", title="t", article="beam 3", setup=setup, sequence=sequence, state=state
        )
        if state is RunState.RUNNING:
            finish_run(session, run.id, RunState.FINISHED)
    return run.id


def test_a_run_is_of_the_amended_article_and_keeps_the_one_it_was_measured_with(catalogue: Catalogue) -> None:
    number = stored(catalogue)
    with catalogue.reading() as session:
        before = get_run(session, number)
    with pytest.raises(RequestError, match=rf"from 0 to 0\.95 m; make them agree; jointlab amend {number} corrects"):
        sequence_of(before)
    with catalogue.writing() as session:
        assert amend_article(session, number, RIGHT, **WHY).version == 2
        assert amend_article(session, number, {"beam": {"density": 7800.0}}, **WHY).version == 3
    with catalogue.reading() as session:
        after = get_run(session, number)
        assert list_runs(session) == [after]
        assert [(each.version, each.reason, each.who) for each in list_amendments(session, number)] == [
            (version, *WHY.values()) for version in (2, 3)
        ]
        assert [setup_of_version(session, number, version)["beam"]["length"] for version in (1, 2, 3)] == [
            0.95, 0.914, 0.914,
        ]  # fmt: skip
        with pytest.raises(NotFoundError, match="no version 4"):
            setup_of_version(session, number, 4)
    assert (before.setup_version, after.setup_version) == (1, 3)
    assert after.setup["direct"] == before.setup["direct"]
    assert (after.sequence, after.configuration_hash) == (before.sequence, before.configuration_hash)
    beam = sequence_of(after)
    assert beam is not None
    assert (beam.article.beam.length, beam.article.beam.density) == (0.914, 7800.0)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"beam": {"length": 0.96}}, "nodes run from 0.0 m to 0.914 m"),
        ({"beam": {"lenght": 0.914}}, "there is no key beam.lenght"),
        ({"beam": {"length": "0.914"}}, "beam.length: "),
        ({"beam": 3}, "beam: "),
        ({"beam": {"length": math.nan}}, "run 1: beam.length: is nan, which is no finite number"),
        ({"node_positions": [0.0, -math.inf]}, "run 1: node_positions.1: is -inf, which is no finite number"),
        (RIGHT | {"node_positions": [0.0, 0.5, 0.914]}, "joint II is at node 10; node_positions has 3"),
        (RIGHT | {"joints": []}, "joints: "),
    ],
)
def test_an_article_that_nothing_can_be_identified_on_is_refused(
    catalogue: Catalogue, changes: dict[str, Any], words: str
) -> None:
    number = stored(catalogue)
    with pytest.raises(JointlabError, match=words) as refused, catalogue.writing() as session:
        amend_article(session, number, changes, **WHY)
    assert str(refused.value).startswith(f"the amended article of run {number}: ")
    with catalogue.reading() as session:
        assert list_amendments(session, number) == []


def test_joints_that_were_measured_stay_in_the_article(catalogue: Catalogue) -> None:
    number = stored(catalogue)
    with catalogue.reading() as session:
        first, _ = get_run(session, number).setup["joints"]
    with pytest.raises(RequestError, match="no joint II in the article"), catalogue.writing() as session:
        amend_article(session, number, RIGHT | {"joints": [first]}, **WHY)


def test_the_same_values_and_a_run_that_has_not_begun_are_refused(catalogue: Catalogue) -> None:
    with pytest.raises(ConflictError, match="nothing differs from version 1"), catalogue.writing() as session:
        amend_article(session, stored(catalogue), {"beam": {"length": 0.95}}, **WHY)
    with pytest.raises(ConflictError, match="has not begun"), catalogue.writing() as session:
        amend_article(session, stored(catalogue, RunState.CREATED), RIGHT, **WHY)


def test_an_amendment_is_never_changed(catalogue: Catalogue) -> None:
    number = stored(catalogue)
    with catalogue.writing() as session:
        amend_article(session, number, RIGHT, **WHY)
    with pytest.raises(StoreError, match="never changed"), catalogue.writing() as session:
        session.query(SetupAmendmentRow).update({"reason": "another"})


@pytest.mark.parametrize("database_kind", ["postgresql"])  # SQLite has one writer at a time
def test_of_two_who_amend_at_the_same_time_both_corrections_are_kept(catalogue: Catalogue, postgresql: Server) -> None:
    number = stored(catalogue)

    def amend() -> int:
        with catalogue.writing() as session:
            return amend_article(session, number, {"beam": {"density": 7800.0}}, **WHY).version

    with ThreadPoolExecutor(1) as other:
        with catalogue.writing() as session:
            assert amend_article(session, number, RIGHT, **WHY).version == 2
            second = other.submit(amend)
            until(lambda: second.done() or is_waiting(postgresql))
        assert second.result() == 3
    with catalogue.reading() as session:
        beam = get_run(session, number).setup["beam"]
    assert (beam["length"], beam["density"]) == (0.914, 7800.0)
