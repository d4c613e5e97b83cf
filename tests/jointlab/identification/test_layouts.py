"""Benches that are laid out in another way than the paper's are identified, and no reason is false."""

import json
from dataclasses import replace
from functools import cache
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.structure.agreement import frac
from jointlab.identification.document import identification_document
from jointlab.identification.inverse import LIKELIHOOD, PAPER, inverse_of
from jointlab.identification.options import Options
from jointlab.identification.pipeline import Identification, identify
from jointlab.identification.read import newest_joints, read_inverse
from jointlab.identification.run import identify_and_save, recompute
from jointlab.identification.save import save_identification
from jointlab.report.identification import write_report
from jointlab.report.summary import summary_sections
from store.catalogue import Catalogue
from store.exchange.bundle_exchange import import_bundle
from store.measurements.runs import get_run
from tests.jointlab.identification.layouts import (
    CYLINDERS,
    FURTHER,
    LAYOUTS,
    article_of,
    exact,
    joints_of,
    measured,
    write_bundle,
)


@cache
def identified(name: str) -> Identification:
    return identify(measured({**LAYOUTS, **FURTHER}[name]))


def holds(found: Identification, most: float = 0.05) -> None:
    """All checks passed, and k12 and k22 of each joint within 1.5 times their intervals, these narrower than `most`."""
    assert found.inverse is not None
    assert found.inverse.fit.passed, [check.finding for check in found.inverse.fit.all_checks if not check.passed]
    for true in joints_of(found.measurement.article):
        joint = found.inverse.likelihood.joints[true.name]
        for at in ((1, 1), (0, 1)):
            (low, high), k = joint.k_ci95[at], true.dynamic_stiffness[at].real
            assert low - 0.25 * (high - low) < k < high + 0.25 * (high - low), (true.name, at)
            assert high - low < most * abs(k), (true.name, at)


@pytest.mark.parametrize("name", LAYOUTS)
def test_a_layout_that_is_not_the_papers_is_identified(name: str) -> None:
    found = identified(name)
    holds(found)
    document = json.loads(json.dumps(identification_document(found)))
    assert set(document["inverse"]) == {*list(CYLINDERS)[: len(LAYOUTS[name].joints)], "weak_directions"}
    assert (document["inverse_paper"] is None) == bool(document["inverse_paper_left_out"])


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("three joints", "1y, 3y, 4y, 5y, 7y, 8y, 9y, 11y, 1x, 11x do not determine the motion of joints at nodes"),
        ("five rows", "2 joints need 6 shape components or more, of which 1y, 3y, 6y, 11y, 11x were measured"),
    ],
)
def test_the_papers_method_is_left_out_with_the_reason(name: str, said: str, tmp_path: Path) -> None:
    found = identified(name)
    holds(found)
    assert found.inverse is not None
    assert said in found.inverse.paper_left_out
    (left_out,) = [each for each in summary_sections(found)[1].content if isinstance(each, str)]
    assert left_out == f"{found.inverse.paper_left_out}."
    write_report(found, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert said in page
    assert "Fig. 5" not in page
    assert "Fig. 7" in page


def test_the_prediction_is_that_of_the_fitted_bench_and_not_of_the_drawing(
    catalogue: Catalogue, tmp_path: Path
) -> None:
    layout = LAYOUTS["no driving point"]
    drawn = article_of(layout)
    places = [place + off for place, off in zip(drawn.node_positions, cycle((0.0, 0.001, -0.0015)), strict=False)]
    beam = drawn.beam.model_copy(update={"youngs_modulus": 1.008 * drawn.beam.youngs_modulus, "density": 7830.0})
    true = drawn.model_copy(update={"beam": beam, "node_positions": (*places[:-1], drawn.beam.length)})
    number = import_bundle(catalogue, write_bundle(layout, tmp_path / "bundle", true))
    found = identify_and_save(catalogue, number)
    holds(found)
    assert found.inverse is not None
    struck = found.measurement.sets[0]
    best = frac(struck.accelerance, exact(true, joints_of(true), list(struck.inputs)))  # noise is left of it
    np.testing.assert_allclose(found.inverse.agreement["maximum likelihood"], best, atol=2e-4)
    assert max(abs(pair.frequency_error) for pair in found.inverse.likelihood.errors) < 2e-4
    with catalogue.reading() as session:
        stored = read_inverse(catalogue, get_run(session, number)).predicted["maximum likelihood"].accelerance
    np.testing.assert_allclose(stored, found.inverse.likelihood.responses.accelerance, rtol=1e-9)


def test_joints_of_the_tester_are_a_start_where_the_papers_method_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """No search over the drawing is made then."""
    monkeypatch.setattr("jointlab.identification.inverse.coarse_joints", lambda *_: pytest.fail("a search was made"))
    measurement = measured(FURTHER["five rows"])
    softer = [
        replace(joint, dynamic_stiffness=0.85 * joint.dynamic_stiffness) for joint in joints_of(measurement.article)
    ]
    found = inverse_of(measurement, in_tester=softer)
    assert found.paper is None
    assert found.fit.passed


def test_terms_are_not_held_about_a_method_that_is_left_out() -> None:
    with pytest.raises(AnalysisError, match=r"about those of the paper's method.*left out.*strike more points"):
        identify(measured(FURTHER["five rows"]), Options(regularise=0.3))


def test_an_imported_run_is_stored_and_read_without_the_papers_method(catalogue: Catalogue, tmp_path: Path) -> None:
    number = import_bundle(catalogue, write_bundle(FURTHER["five rows"], tmp_path / "bundle"))
    found = identify_and_save(catalogue, number)
    holds(found)
    with catalogue.reading() as session:
        run = get_run(session, number)
    stored = read_inverse(catalogue, run)
    assert list(stored.predicted) == ["maximum likelihood"]
    assert stored.regressions == {}
    assert "strike more points" in stored.paper_left_out
    assert recompute(catalogue, number)[1].startswith("It is that of analysis")


def test_joints_of_the_papers_method_from_before_are_not_shown_beside_newer_ones(
    catalogue: Catalogue, tmp_path: Path
) -> None:
    number = import_bundle(catalogue, write_bundle(LAYOUTS["nine nodes"], tmp_path / "bundle"))
    found = identify_and_save(catalogue, number)
    with catalogue.reading() as session:
        run = get_run(session, number)
    assert list(newest_joints(catalogue, run)) == [LIKELIHOOD, PAPER]
    assert found.inverse is not None
    without = replace(found.inverse, paper=None, paper_left_out="The paper's method is left out: blows were taken back")
    with catalogue.writing() as session:
        save_identification(session, number, replace(found, inverse=without))
    assert list(newest_joints(catalogue, run)) == [LIKELIHOOD]
    assert "taken back" in read_inverse(catalogue, run).paper_left_out
