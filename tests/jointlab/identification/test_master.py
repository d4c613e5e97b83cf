"""The master curve of a specimen: which points are taken, what is left out, and the lag that is taken out."""

from datetime import UTC, datetime

import numpy as np
import pytest

from analysis.errors import AnalysisError
from jointlab.documents.master import Cause, MasterQuestion
from jointlab.errors import JointlabError
from jointlab.identification.master import every_run, offered_series, specimen_master, specimen_sweeps
from jointlab.identification.master_document import master_document
from jointlab.report.master import master_section
from jointlab.report.section import Notice
from store.catalogue import Catalogue
from store.measurements.runs import start_run
from store.measurements.sine_records import SineRecord, add_sine_record
from tests.master_sweeps import ARTICLE, SPECIMEN, UNKNOWN, store_sweeps

QUESTION = MasterQuestion(article=ARTICLE, specimen=SPECIMEN)


def question(**other: object) -> MasterQuestion:
    return MasterQuestion.model_validate(QUESTION.model_dump() | other)


def test_the_series_of_most_points_is_taken_and_every_other_point_is_said_to_be_left_out(catalogue: Catalogue) -> None:
    store_sweeps(catalogue, [5.0, 23.0, 38.0, None, 50.0])
    store_sweeps(catalogue, [5.0, 23.0], amplitude_pp_mm=0.1)
    found = specimen_sweeps(catalogue, question(runs=[1, 2, 3, 4, 6]))
    assert {each.series for each in found.swept} == {("angled", 0.01)}
    assert sorted({each.run for each in found.swept}) == [1, 2, 3]
    left = {each.cause: (each.series, each.runs, len(each.points)) for each in found.left_out if each.runs != [7]}
    assert left == {
        Cause.NO_TEMPERATURE: (("angled", 0.01), [4], 12),
        Cause.OTHER_RUN: (("angled", 0.01), [5], 12),
        Cause.OTHER_SERIES: (("angled", 0.1), [6], 12),
    }
    assert offered_series(catalogue, ARTICLE, SPECIMEN) == {
        ("angled", 0.01): [5.0, 23.0, 38.0, 50.0],
        ("angled", 0.1): [5.0, 23.0],
    }


def test_a_run_that_was_not_identified_is_named_where_temperatures_are_missing(catalogue: Catalogue) -> None:
    store_sweeps(catalogue, [23.0, 38.0])
    with catalogue.writing() as session:
        at = datetime(2026, 3, 4, tzinfo=UTC)
        run = start_run(session, kind="sweep", title="cold", article=ARTICLE, setup={}, started_at=at).id
        record = SineRecord(1, SPECIMEN, "angled", 0.01, None, 20.0, 0.0, None, None, None)
        add_sine_record(session, run, record)
    with pytest.raises(JointlabError, match=f"Run {run} is not identified: jointlab identify {run}"):
        specimen_sweeps(catalogue, QUESTION)
    found = master_document(specimen_master(catalogue, question(shift="arrhenius")))
    assert found.not_identified == [run]
    assert Notice(f"Not identified, and so not in the curve: run {run}.") in master_section(found).content


def test_points_at_the_reference_temperature_of_their_compound_are_refused_with_what_to_do(
    catalogue: Catalogue,
) -> None:
    """Their stiffness is not that of the temperature at which they were measured."""
    store_sweeps(catalogue, [5.0, 23.0], corrections=["frame_compliance"])
    store_sweeps(catalogue, [15.0, 30.0], corrections=["frame_compliance", "temperature_shift"])
    with pytest.raises(JointlabError, match=r"runs 3, 4.*jointlab identify 3 --without temperature_shift"):
        specimen_sweeps(catalogue, QUESTION)
    assert len(specimen_sweeps(catalogue, question(runs=[1, 2], shift="arrhenius")).swept) == 24


def test_points_of_one_temperature_do_not_lengthen_the_refusal(catalogue: Catalogue) -> None:
    store_sweeps(catalogue, [23.0])
    store_sweeps(catalogue, [23.5], amplitude_pp_mm=0.1)  # the same temperature, which helps nobody
    with pytest.raises(JointlabError, match="10 to 20 K colder") as refused:
        specimen_sweeps(catalogue, question(amplitude_pp_mm=0.01))
    assert "another series" not in str(refused.value)


def test_constants_that_are_given_have_no_error_and_a_band_of_no_width(catalogue: Catalogue) -> None:
    store_sweeps(catalogue, [5.0, 23.0])
    found = master_document(specimen_master(catalogue, question(wlf={"c1": 9.0, "c2": 100.0})))
    assert [(each.name, each.value, each.standard_error, each.ci95) for each in found.parameters] == [
        ("C1", 9.0, None, None),
        ("C2", 100.0, None, None),
    ]
    cold = found.sweeps[0]
    assert cold.shift_factor_ci95 == pytest.approx((cold.shift_factor, cold.shift_factor))
    assert cold.shift_factor == pytest.approx(10 ** (9 * 18 / (100 - 18)), rel=1e-6)


def test_the_lag_is_taken_out_of_the_points_and_temperature_out_of_their_stiffness(catalogue: Catalogue) -> None:
    store_sweeps(catalogue, [5.0, 23.0, 38.0])
    found = master_document(specimen_master(catalogue, QUESTION))
    for point in found.measured:
        lagging = np.tan(np.arctan(point.gamma_without_lag) + 2 * np.pi * point.frequency * found.lag.value)
        assert lagging == pytest.approx(point.gamma)
        kelvin = point.temperature_c + 273.15
        assert point.reduced_magnitude == pytest.approx(point.k * np.hypot(1, point.gamma) * 296.15 / kelvin)


def test_no_temperature_at_all_asks_for_a_thermometer(catalogue: Catalogue) -> None:
    store_sweeps(catalogue, [None, None])
    assert UNKNOWN not in offered_series(catalogue, ARTICLE, SPECIMEN)["angled", 0.01]
    with pytest.raises(JointlabError, match="no point has a temperature; connect a thermometer"):
        specimen_sweeps(catalogue, QUESTION)


def test_every_run_of_an_article_is_looked_at(catalogue: Catalogue) -> None:
    """A hundred newer sweeps hid the hammer run: a page of runs was taken for all of them."""
    with catalogue.writing() as session:
        numbers = [start_run(session, kind="sweep", title="t", article=ARTICLE, setup={}).id for _ in range(205)]
        start_run(session, kind="sweep", title="t", article="another", setup={})
    assert [run.id for run in every_run(catalogue, ARTICLE)] == numbers[::-1]


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"frequencies": [100.0], "temperature_c": -28.5, "wlf": {"c1": 17.4, "c2": 51.6}}, "which says nothing"),
        ({"wlf": {"c1": 1e5, "c2": 51.6}}, "decades"),
    ],
)
def test_constants_that_shift_beyond_all_frequencies_are_refused(
    catalogue: Catalogue, asked: dict[str, object], said: str
) -> None:
    store_sweeps(catalogue, [5.0, 23.0, 38.0])
    with pytest.raises(AnalysisError, match=said):
        specimen_master(catalogue, question(reference_c=23.0, **asked))
