"""The first page of a report."""

from dataclasses import replace
from datetime import date

from analysis.comparison import Agreement
from jointlab.identification.pipeline import Identification
from jointlab.report.facts import facts_of
from jointlab.report.front import front_sections
from jointlab.report.laboratory import LaboratorySettings
from jointlab.report.run_record import read_run_record
from jointlab.report.section import Notice, Table
from jointlab.report.standards import BY_EXPERIMENT
from jointlab.runs.amendment import amend_article
from store.catalogue import Catalogue
from store.measurements.runs import list_run_events
from store.states import RunState
from tests.api.page.diagnosis import add_example_diagnosis

LABORATORY = LaboratorySettings(name="Laboratory")


def test_the_first_page_tells_what_is_overdue_what_differs_and_the_gap(
    measured_catalogue: Catalogue, identified: Identification
) -> None:
    add_example_diagnosis(measured_catalogue, run_id=1)
    record = read_run_record(measured_catalogue, 1)
    late = replace(record.channels[0].instrument, due_on=date(2020, 1, 1), certificate="C-7", uncertainty=0.015)
    record = replace(record, channels=(replace(record.channels[0], instrument=late), *record.channels[1:]))
    first, *others = identified.comparison
    found = replace(identified, comparison=(replace(first, verdict=Agreement.DIFFER), *others))
    facts = facts_of(found, LABORATORY, record)
    _, results, verdicts, instruments = front_sections(found, facts, record)

    notice, table = instruments.content
    assert isinstance(notice, Notice)
    assert "was valid until 2020-01-01, before the measurement" in notice.text
    assert isinstance(table, Table)
    assert table.rows[0][3:] == ("2020-01-01", "C-7", "1.5 %")
    (modules,) = [row[1] for row in table.rows if row[0] == "acquisition"]
    assert str(modules).count("NI 9") > 1
    said, differ, gap = verdicts.content
    assert str(said).startswith("Tester and hammer test disagree in 1 of")
    assert isinstance(differ, Table)
    assert [row[:2] for row in differ.rows] == [(first.joint, first.element)]
    assert "the gap falls from 12.3 % to 3.1 %" in str(gap)
    joints, cylinders = results.content[-2:]
    assert isinstance(joints, Table)
    assert len(joints.rows) == 6
    assert isinstance(cylinders, Table)
    assert len(cylinders.rows) == 12  # two joints, three configurations, the largest and the smallest amplitude
    named = {name for lists in BY_EXPERIMENT.values() for _, asked in lists for _, name in asked if name is not None}
    assert named - facts.keys() == {"description", "conditioning", "rig", "examination"}  # that this run has not
    assert "1.5 dB or less" in facts["linearity"]


def test_the_report_of_an_amended_run_says_so_and_by_names_who_measured_alone(
    measured_catalogue: Catalogue, identified: Identification
) -> None:
    before = facts_of(identified, LABORATORY, read_run_record(measured_catalogue, 1))
    assert "amended" not in before
    with measured_catalogue.writing() as session:
        for density, reason in ((7810.0, "weighed again"), (7820.0, "the balance was wrong")):
            amend_article(session, 1, {"beam": {"density": density}}, reason=reason, who="bob")
    record = read_run_record(measured_catalogue, 1)
    facts = facts_of(identified, LABORATORY, record)
    assert facts["amended"] == "version 3, amended: weighed again; the balance was wrong"
    shown = front_sections(identified, facts, record)[0].content[0]
    assert isinstance(shown, Table)
    assert ("set-up", facts["amended"]) in shown.rows
    with measured_catalogue.reading() as session:
        events = list_run_events(session, 1)
    assert [event.who for event in events if event.state is RunState.FINISHED] == [None]  # nobody asked for that end
    assert facts["operator"] == "; ".join(dict.fromkeys(event.who for event in events if event.who))
