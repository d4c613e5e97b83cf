"""Runs over each other, from the boxes in the list of runs to their curves; and the list by specimen."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, ViewportSize, expect

from jointlab.identification.pipeline import Identification
from jointlab.identification.save import save_identification
from store.catalogue import Catalogue
from store.measurements.runs import get_run, start_run
from tests.api.page.axe import grave_faults
from tests.api.page.conftest import PATIENCE
from tests.api.page.technician import Service, Tab, serving

SIZES = ((1280, 800), (800, 600), (390, 844))


@pytest.fixture(scope="module")
def three_runs(
    demo: Path, identified: Identification, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Service, int, int]]:
    """The demo's run, another one of the same article with the same results, and one without any."""
    folder = tmp_path_factory.mktemp("three-runs")
    shutil.copy(demo / "jointlab.db", folder)
    (folder / "jointlab.toml").write_text("", encoding="utf-8")
    with Catalogue.open(f"sqlite:///{folder / 'jointlab.db'}") as catalogue, catalogue.writing() as session:
        first = get_run(session, 1)
        same = start_run(session, kind="import", title="again", article=first.article, setup=first.setup)
        save_identification(session, same.id, identified)
        empty = start_run(session, kind="import", title="not identified", article="another beam", setup=first.setup)
    with serving(folder) as service:
        yield service, same.id, empty.id


@pytest.fixture(scope="module")
def tab(three_runs: tuple[Service, int, int], browser: Browser) -> Iterator[Tab]:
    context = browser.new_context()
    context.set_default_timeout(PATIENCE)
    tab = Tab(context.new_page(), three_runs[0])
    tab.log_in()
    yield tab
    context.close()
    assert not tab.errors


def tick(page: Page, *runs: int) -> None:
    for run in runs:
        page.get_by_role("checkbox", name=f"overlay run {run}", exact=True).check()
    page.get_by_role("button", name="Overlay the ticked runs").click()


def test_ticked_runs_are_overlaid_with_a_curve_each(tab: Tab, three_runs: tuple[Service, int, int]) -> None:
    _, same, _ = three_runs
    page = tab.go("/page/runs")
    tick(page, 1, same)
    assert re.search(rf"overlay={same}&overlay=1|overlay=1&overlay={same}", page.url)
    for caption in (
        "k, joint I in shear, 0.01 mm", "γ, joint II in the angled configuration", "Accelerance: 3y → 3y",
        "Phase: 3y → 3y", "95 % intervals of each run",
    ):  # fmt: skip
        expect(page.get_by_role("img", name=caption).locator("canvas").first).to_be_visible()
    terms = page.get_by_role("region", name="95 % intervals; k in MN/m").get_by_role("row")
    one, other = terms.filter(has_text="k22 I").first.get_by_role("cell").all_inner_texts()[1:]
    assert one == other  # the same results were stored twice
    page.get_by_label("Tester at (mm p-p)").select_option("0.1")
    page.locator('select[name="row"]').select_option("1y → 3y")
    page.get_by_role("button", name="Show").click()
    for caption in ("k, joint I in shear, 0.1 mm", "Accelerance: 1y → 3y"):
        expect(page.get_by_role("img", name=caption).locator("canvas").first).to_be_visible()
    assert page.url.count("overlay=") == 2
    assert "another beam" not in page.content()


def test_what_runs_do_not_have_in_common_is_said_in_place_of_empty_charts(
    tab: Tab, three_runs: tuple[Service, int, int]
) -> None:
    page = tab.go("/page/runs")
    tick(page, 1, three_runs[2])
    for words in ("sine points of one joint", "an accelerance in common", "a joint's term in common"):
        expect(page.get_by_text(words)).to_be_visible()
    expect(page.get_by_role("cell", name="none yet")).to_be_visible()
    expect(page.locator("figure:visible")).to_have_count(0)
    page.go_back()
    page.get_by_role("button", name="Overlay the ticked runs").wait_for()
    tab.go("/page/runs?overlay=1")
    expect(page.get_by_text("Tick 2 to 12 runs")).to_be_visible()
    tab.go("/page/runs?overlay=1&overlay=99")
    expect(page.get_by_text("there is no run 99")).to_be_visible()


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_an_overlay_and_the_headline_fit_each_screen(
    tab: Tab, three_runs: tuple[Service, int, int], width: int, height: int
) -> None:
    page = tab.page
    page.set_viewport_size(ViewportSize(width=width, height=height))
    for path, name in ((f"/page/runs?overlay=1&overlay={three_runs[1]}", "overlay"), ("/page/results?run=1", "card")):
        tab.go(path)
        shown = page.get_by_role("region", name="Joint I;") if name == "card" else page.get_by_role("img", name="k, jo")
        shown.first.wait_for()
        page.wait_for_function(f"() => document.documentElement.scrollWidth <= {width}")
        cut = "() => [...document.querySelectorAll('.compact .scroll')].filter(e => e.scrollWidth > e.clientWidth + 1)"
        assert page.evaluate(f"({cut})().length") == 0
        assert not grave_faults(page)


def test_runs_are_listed_by_specimen_and_each_specimen_leads_to_its_runs(
    tab: Tab, three_runs: tuple[Service, int, int]
) -> None:
    page = tab.go("/page/runs")
    runs = page.get_by_role("region", name="Runs, newest first")
    expect(runs.get_by_role("row")).to_have_count(4)
    page.get_by_label("Joint (specimen)").fill("II")
    page.get_by_role("button", name="Show").click()
    expect(runs.get_by_role("row")).to_have_count(3)
    assert "specimen=II" in page.url
    page.get_by_label("Joint (specimen)").fill("IX")
    page.get_by_role("button", name="Show").click()
    expect(page.get_by_text("No run fits.")).to_be_visible()
    page.get_by_role("region", name="The cylinders of each joint").get_by_role("link", name="I", exact=True).click()
    expect(page.get_by_label("Joint (specimen)")).to_have_value("I")
    expect(runs.get_by_role("row")).to_have_count(3)


def test_a_run_that_was_not_identified_says_what_to_press(tab: Tab, three_runs: tuple[Service, int, int]) -> None:
    page = tab.go(f"/page/results?run={three_runs[2]}")
    expect(page.get_by_text("nothing of this run was identified")).to_be_visible()
    page.get_by_role("link", name="actions").click()
    expect(page.get_by_role("button", name="Identify")).to_be_in_viewport()
