"""An investigation by the buttons of the page: begun at a diagnosis, answered, stopped, and there after a restart."""

import re
from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Page, expect

from store.catalogue import Catalogue
from tests.api.page.diagnosis import add_example_diagnosis
from tests.api.page.technician import Service, Tab, serving
from tests.investigations import (
    DELAY,
    HALF_FORCE,
    NOTHING_MORE,
    READING,
    add_spent,
    add_waiting,
    import_as,
    small,
    small_further,
    struck_harder,
)

DELAY_LABEL = "Delay of the acceleration after the force (s)"
PATCH_LABEL = "Length of the beam that a joint holds (m)"


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service that drives no rig, with a small measurement as run 1."""
    folder = tmp_path_factory.mktemp("investigated")
    (folder / "jointlab.toml").write_text("", encoding="utf-8")
    with Catalogue.open(f"sqlite:///{folder / 'jointlab.db'}", folder / "jointlab-waveforms") as catalogue:
        import_as(catalogue, small(5, folder / "first"))
    with serving(folder) as service:
        yield service


@pytest.fixture
def page(measured: Service, open_tab: Callable[[Service], Tab]) -> Iterator[Page]:
    tab = open_tab(measured)
    yield tab.log_in()
    assert tab.hosts == {"127.0.0.1"}
    assert not tab.errors


def state_is(page: Page, words: str) -> None:
    expect(page.locator("#investigation")).to_have_text(words)


def test_a_cause_is_sought_from_a_diagnosis_to_a_certain_verdict(measured: Service, page: Page) -> None:
    with Catalogue.open(measured.database) as catalogue:
        diagnosis = add_example_diagnosis(catalogue, run_id=1)
    page.goto(f"{measured.address}/page/gap?diagnosis={diagnosis}")
    page.get_by_role("button", name="Find the cause by experiments").click()
    page.wait_for_url(re.compile("investigation="))
    state_is(page, "waits for you")
    expect(page.locator("#asked")).to_contain_text("expected to confirm delay between the channels")
    measured.stop()
    measured.start()
    page.reload()
    state_is(page, "waits for you")
    made = 1
    if page.get_by_label(PATCH_LABEL).count():  # hundredths of a bit decide which check is asked for first
        page.get_by_label(PATCH_LABEL).fill("0")
        page.get_by_role("button", name="Diagnose with these readings").click()
        expect(page.locator("#asked")).to_contain_text("Strike a known free mass", timeout=300_000)
        made = 2
    page.get_by_label(DELAY_LABEL).fill("twenty")
    page.get_by_role("button", name="Diagnose with these readings").click()
    expect(page.get_by_role("alert").filter(has_text="force is a number such as")).to_be_visible()
    page.get_by_label(DELAY_LABEL).fill(f"{DELAY:.1e}".replace(".", ","))
    page.get_by_role("button", name="Diagnose with these readings").click()
    state_is(page, "ended")
    expect(page.get_by_text(f"and {made * 10} min: the verdict is certain enough")).to_be_visible()
    steps = page.get_by_role("region", name="Steps").get_by_role("row")
    expect(steps.nth(made)).to_contain_text("delay of the acceleration after the force: 2.5e-05 s")
    expect(page.get_by_text("channel_delay")).to_have_count(0)  # ids are for data
    steps.nth(made + 1).get_by_role("link", name=re.compile("^diagnosis ")).click()
    expect(page.locator("#verdict")).to_have_text("explained")
    expect(page.get_by_role("region", name="Investigations of run 1")).to_contain_text("ended")


def test_a_further_run_answers_and_the_work_is_stopped_and_gone_on_with(measured: Service, page: Page) -> None:
    with Catalogue.open(measured.database, measured.waveforms) as catalogue:
        number = add_waiting(catalogue, 1, HALF_FORCE, READING, NOTHING_MORE).id
        further = import_as(catalogue, struck_harder(small_further(5, measured.folder / "further"), 1.36))
    page.goto(f"{measured.address}/page/results?run={further}")
    page.get_by_text("This run may be what").get_by_role("link", name=f"investigation {number}").click()
    page.get_by_role("link", name="Open the sequence for it").click()
    expect(
        page.get_by_text(f"Investigation {number} asks for this: strike again at half the peak force")
    ).to_be_visible()
    expect(page.locator("#steps li").first).to_contain_text("of about")
    page.go_back()
    expect(page.get_by_label("Measured by").get_by_role("option")).to_have_count(1)
    expect(page.get_by_label("Measured by")).to_contain_text(f"run {further}: ")
    page.get_by_role("button", name="Diagnose with this run").click()
    state_is(page, "diagnosing")
    expect(page.get_by_role("region", name="Steps").get_by_role("row").nth(1)).to_contain_text(f"data {further}")
    lacking = "Step 1, asked for: strike again at half the peak force; measured without: a peak force of about 50 N"
    expect(page.get_by_text(lacking)).to_be_visible()
    page.get_by_role("button", name="Stop the investigation").click()
    state_is(page, "stopped")
    page.get_by_role("button", name="Ask for another one").click()
    expect(page.get_by_role("alert").filter(has_text="write why the experiment cannot be made")).to_be_visible()
    page.get_by_role("button", name="Go on").click()
    state_is(page, "diagnosing")
    expect(page.get_by_text(re.compile("diagnosis, [0-9]+ of 100"))).to_be_visible()
    page.get_by_role("button", name="Stop the investigation").click()
    expect(page.get_by_text("these are asked for in turn: strike a known free mass (10 min).")).to_be_visible()
    page.get_by_label("Why it cannot be made").fill("the hammer is away")
    page.get_by_role("button", name="Ask for another one").click()
    expect(page.locator("#asked")).to_contain_text("Strike a known free mass")  # at once, without a diagnosis
    expect(page.get_by_role("region", name="Steps").get_by_role("row").nth(1)).to_contain_text("not made: the hammer")


def test_a_spent_budget_is_enlarged(measured: Service, page: Page) -> None:
    with Catalogue.open(measured.database) as catalogue:
        number = add_spent(catalogue, 1).id
    page.goto(f"{measured.address}/page/gap?investigation={number}")
    state_is(page, "ended")
    expect(page.get_by_text("the budget of minutes or experiments is spent")).to_be_visible()
    page.get_by_role("button", name="Go on with this budget").click()
    expect(page.get_by_role("alert").filter(has_text="with a larger one")).to_be_visible()
    page.get_by_label("Experiments in all").fill("2")
    page.get_by_role("button", name="Go on with this budget").click()
    state_is(page, "diagnosing")
    page.get_by_role("button", name="Stop the investigation").click()
    state_is(page, "stopped")
    page.goto(f"{measured.address}/page/gap?investigation=9999")
    expect(page.get_by_role("alert").filter(has_text="there is no investigation 9999")).to_be_visible()
