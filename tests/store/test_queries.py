"""The query cookbook: every query runs on both databases and finds something; the documented columns are there."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import stdtrit
from sqlalchemy import inspect, text

from store.catalogue import Catalogue
from store.exchange.bundle_exchange import import_bundle
from store.measurements.runs import start_run
from store.models.base import Base
from store.results.analyses import NO_RESULT, add_analysis, latest_analysis
from store.results.dynamic_stiffness import add_dynamic_stiffness
from store.results.modes import add_modes
from store.states import AnalysisKind, RunState

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = (DOCS / "queries.md").read_text(encoding="utf-8")
QUERIES = re.findall(r"```sql\n(.*?);\n```", PAGE, flags=re.DOTALL)
VIEWS = dict(re.findall(r"### (v_\w+)\n(.*?)\n\n", PAGE, flags=re.DOTALL))


@pytest.fixture
def laboratory(catalogue: Catalogue, filled: int, bundle: Path) -> Catalogue:
    """A catalogue with runs measured here, an imported one, and everything analysed."""
    import_bundle(catalogue, bundle)
    return catalogue


def test_the_page_has_its_queries() -> None:
    assert len(QUERIES) == PAGE.count("```sql") >= 12


@pytest.mark.parametrize(
    ("question", "asked"),
    [
        ("The stiffness of a specimen at 10 Hz and 0.05 mm over time", ["frequency = 10", "amplitude_pp_mm = 0.05"]),
        ("Which blows were refused in one week", ["NOT accepted", "struck_at >=", "struck_at <"]),
        ("k22 of a joint against temperature", ["element = 'k22'", "ORDER BY temperature_c"]),
        ("Which calibrations were in force for a run", ["run_id = 1", "calibrated_on"]),
        ("On which runs do the two experiments disagree", ["verdict = 'differ'", "run_id"]),
    ],
)
def test_the_usual_questions_are_answered_by_one_short_select(question: str, asked: list[str]) -> None:
    query = PAGE.split(question)[1].split("```")[1]
    assert query.count("SELECT") == 1
    assert len(query.strip().splitlines()) <= 8
    assert all(words in query for words in asked)


def test_every_query_of_the_cookbook_finds_something(laboratory: Catalogue) -> None:
    with laboratory.reading() as session:
        for query in QUERIES:
            assert session.execute(text(query)).all(), query


@pytest.mark.parametrize("database_kind", ["sqlite"])
@pytest.mark.parametrize("query", [query for query in QUERIES if "article = 'beam 3'" in query or "LIMIT" in query])
def test_a_query_for_an_article_or_a_list_begins_with_an_index(catalogue: Catalogue, query: str) -> None:
    with catalogue.reading() as session:
        plan = [row[-1] for row in session.execute(text(f"EXPLAIN QUERY PLAN {query}"))]
    # A list ends at its limit; comparisons are few, and begin at their table.
    scanned = [line for line in plan if line.startswith("SCAN") and line != "SCAN comparisons"]
    assert not scanned or ("LIMIT" in query and "USE TEMP B-TREE FOR ORDER BY" not in plan), plan


def test_the_page_names_every_column_of_every_view_in_its_order(catalogue: Catalogue) -> None:
    with catalogue.reading() as session:
        inspector = inspect(session.connection())
        for view in inspector.get_view_names():
            columns = [column["name"] for column in inspector.get_columns(view)]
            assert re.findall(r"`(\w+)`", VIEWS[view]) == columns, view


def test_the_schema_page_names_every_table() -> None:
    page = (DOCS / "schema.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| (\w+) \|", page, flags=re.MULTILINE)) - {"table"} == set(Base.metadata.tables)


def test_latest_is_the_newest_of_its_kind_and_method_on_its_run(
    laboratory: Catalogue, filled: int, samples: SimpleNamespace
) -> None:
    with laboratory.writing() as session:
        again = add_analysis(session, kind="modes", method="LSCF", settings={}, runs=[filled])
        add_modes(session, again, samples.modes())
        other = add_analysis(session, kind="modes", method="peak picking", settings={}, runs=[filled])
        add_modes(session, other, samples.modes())
    with laboratory.reading() as session:
        latest = session.scalars(text("SELECT DISTINCT analysis_id FROM v_modes WHERE latest ORDER BY analysis_id"))
        assert latest.all() == [again, other]
        assert len(session.execute(text("SELECT * FROM v_modes")).all()) == 6


def test_intervals_of_the_direct_method_are_students(
    laboratory: Catalogue, filled: int, samples: SimpleNamespace
) -> None:
    """An imported point, whose standard error is stated, has no degrees of freedom."""
    freedom = [None, 1.0, 1.5, 2.0, 3.0, 4.7, 7.0, 21.0, 1e4]
    points = [
        replace(samples.dynamic_stiffness()[0], order_number=order, degrees_of_freedom=each)
        for order, each in enumerate(freedom, start=1)
    ]
    with laboratory.writing() as session:
        analysis = add_analysis(session, kind="dynamic_stiffness", method="m", settings={}, runs=[filled])
        add_dynamic_stiffness(session, analysis, points)
    errors = {"stiffness": 700.0, "damping": 600.0, "loss_factor": 0.001, "loop_energy": 2e-6}
    expected = np.array([stdtrit(each or np.inf, 0.975) for each in freedom])
    with laboratory.reading() as session:
        for name, error in errors.items():
            query = f"SELECT {name} - {name}_low, {name}_high - {name} FROM v_dynamic_stiffness "
            rows = session.execute(text(f"{query} WHERE analysis_id = {analysis} ORDER BY order_number")).all()
            np.testing.assert_allclose(np.array(rows).T, [error * expected] * 2, rtol=1e-3)


def test_a_run_counts_its_blows_and_records(laboratory: Catalogue) -> None:
    query = "SELECT kind, blows_accepted, blows_refused, sine_records FROM v_runs ORDER BY run_id"
    with laboratory.reading() as session:
        rows = [tuple(row) for row in session.execute(text(query))]
    assert rows == [("hammer", 4, 2, 0), ("sweep", 0, 0, 1), ("import", 4, 0, 0)]


def test_a_run_that_has_not_begun_has_no_start(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        for state in (RunState.CREATED, RunState.RUNNING):
            start_run(session, kind="sequence", title="t", article="beam 3", setup={}, state=state)
    with catalogue.reading() as session:
        rows = session.execute(text("SELECT state, started_at IS NULL FROM v_runs ORDER BY run_id")).all()
    assert [(state, bool(none)) for state, none in rows] == [("created", True), ("running", False)]


def test_a_comparison_of_two_runs_shows_once(laboratory: Catalogue) -> None:
    with laboratory.reading() as session:
        rows = session.execute(text("SELECT element, verdict, latest FROM v_comparison ORDER BY element")).all()
    assert [(row.element, row.verdict, bool(row.latest)) for row in rows] == [
        ("gamma22", "differ", True), ("k11", "not comparable", True), ("k22", "agree", True)
    ]  # fmt: skip


@pytest.mark.parametrize("kind", [AnalysisKind.JOINT_MATRICES, AnalysisKind.DYNAMIC_STIFFNESS])
def test_a_comparison_is_not_the_latest_where_what_it_compares_was_computed_again(
    laboratory: Catalogue, filled: int, kind: AnalysisKind
) -> None:
    run = filled if kind is AnalysisKind.JOINT_MATRICES else filled + 1
    query = text("SELECT DISTINCT latest FROM v_comparison")
    with laboratory.writing() as session:
        method = latest_analysis(session, run, kind).method
        add_analysis(session, kind=kind, method="another", settings={}, runs=[run])
        assert session.scalars(query).all() == [True]
        add_analysis(session, kind=kind, method=method, settings={NO_RESULT: "no mode"}, runs=[run])
        assert session.scalars(query).all() == [False]
