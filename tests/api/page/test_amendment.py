"""Amending the article of a run on the page: what is wrong is said at its field, and a new version is listed."""

from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Page, expect

from jointlab.sequences import BUILT_IN, built_in
from store.catalogue import Catalogue
from store.measurements.runs import finish_run, get_run, start_run
from store.service.audit import list_audit_entries
from store.states import RunState
from tests.api.page.technician import Service, Tab, serving


def amend(page: Page, values: str, reason: str) -> None:
    page.get_by_label("Values of the article").fill(values)
    page.get_by_label("Reason").fill(reason)
    page.get_by_role("button", name="Amend").click()


def test_what_is_wrong_is_said_at_its_field_and_a_new_version_is_listed(
    tmp_path: Path, open_tab: Callable[[Service], Tab]
) -> None:
    (tmp_path / "jointlab.toml").write_text("", encoding="utf-8")
    with serving(tmp_path) as service, Catalogue.open(service.database, service.waveforms) as catalogue:
        with catalogue.writing() as session:
            setup = built_in(BUILT_IN).article.model_dump(mode="json")
            run = start_run(session, kind="import", title="t", article="beam 3", setup=setup)
            finish_run(session, run.id, RunState.FINISHED)
        tab = open_tab(service)
        tab.log_in()
        page = tab.go("/page/results?run=1&part=Measured how")
        values = page.locator(".q-field", has=page.get_by_label("Values of the article")).get_by_role("alert")
        reason = page.locator(".q-field", has=page.get_by_label("Reason")).get_by_role("alert")
        for given, why, told, at in (
            ("beam.length", "weighed", "there is no = in it", values),
            ("beam.lenght=0.9", "weighed", "there is no key beam.lenght", values),
            ("beam.length=2.0", "weighed", "make them agree", values),
            ("", "weighed", "write key=value", values),
            ("beam.density=7810", " ", "say in one line what was wrong", reason),
        ):
            amend(page, given, why)
            expect(at).to_contain_text(told)
            expect(values if at is reason else reason).to_have_count(0)
        expect(page.get_by_role("region", name="Amendments")).to_have_count(0)
        amend(page, "beam.density=7810\naccelerometer.mass=0.002", "weighed again")
        row = page.get_by_role("region", name="Amendments of the setup").get_by_role("row").nth(1)
        expect(row).to_contain_text("weighed again")
        expect(page.get_by_label("Values of the article")).to_have_value("")
        with catalogue.reading() as session:
            amended = get_run(session, run.id)
            (noted,) = [e for e in list_audit_entries(session) if e.action == "amend setup" and e.outcome == "done"]
        assert amended.setup_version == 2
        assert (amended.setup["beam"]["density"], amended.setup["accelerometer"]["mass"]) == (7810, 0.002)
        changes = {"beam": {"density": 7810}, "accelerometer": {"mass": 0.002}}
        assert (noted.who, noted.details) == ("key 1 (technician)", {"article": changes, "reason": "weighed again"})
        assert not tab.errors
