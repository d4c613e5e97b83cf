"""Master curves on the page: asked for from the list of specimens, computed as a job, drawn and kept."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, ViewportSize, expect

from store.catalogue import Catalogue
from tests.api.page.axe import grave_faults
from tests.api.page.conftest import PATIENCE
from tests.api.page.technician import Service, Tab, serving
from tests.master_sweeps import store_sweeps

SIZES = ((1280, 800), (800, 600), (390, 844))
CURVES = "Master curves of this specimen"
ADDRESS = "/page/runs?article=beam+3&master=I"


@pytest.fixture(scope="module")
def sweeps(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """Sweeps of one specimen at three temperatures, and one at another amplitude."""
    folder = tmp_path_factory.mktemp("sweeps")
    (folder / "jointlab.toml").write_text("", encoding="utf-8")
    with Catalogue.open(f"sqlite:///{folder / 'jointlab.db'}") as catalogue:
        store_sweeps(catalogue, [5.0, 23.0, 38.0])
        store_sweeps(catalogue, [50.0], amplitude_pp_mm=0.1)
    with serving(folder) as service:
        yield service


@pytest.fixture(scope="module")
def tab(sweeps: Service, browser: Browser) -> Iterator[Tab]:
    context = browser.new_context()
    context.set_default_timeout(PATIENCE)
    tab = Tab(context.new_page(), sweeps)
    tab.log_in()
    yield tab
    context.close()
    assert not tab.errors


@pytest.fixture(scope="module")
def computed(tab: Tab) -> Page:
    """The view of the specimen, after its first master curve was computed there."""
    page = tab.go("/page/runs")
    page.get_by_role("link", name="master curve").click()
    expect(page.get_by_text("There is no master curve of this specimen yet.")).to_be_visible()
    page.get_by_label("Frequencies to predict at").fill("400 1000")
    page.get_by_role("button", name="Compute the master curve").click()
    page.get_by_role("region", name=CURVES).wait_for()
    return page


def test_a_master_curve_is_computed_and_drawn_with_its_shift_and_what_it_says(computed: Page) -> None:
    for caption in (
        "|k|, I in the angled configuration, 0.01 mm: curve with 95 % band",
        "γ, I in the angled configuration",
        "Shift factors over",
    ):
        expect(computed.get_by_role("img", name=caption).locator("canvas").first).to_be_visible()
    expect(computed.get_by_text("Shift by WLF: C1 = ")).to_contain_text("standard error")
    expect(computed.get_by_text("12 points in the angled configuration, 0.1 mm peak to peak (run 4)")).to_be_visible()
    predictions = computed.get_by_role("region", name="By the curve").get_by_role("row")
    expect(predictions).to_have_count(3)
    expect(computed.get_by_role("region", name="Sweeps").get_by_role("row")).to_have_count(4)
    computed.get_by_text("Where is this from?").click()
    expect(computed.get_by_text("time-temperature superposition")).to_be_visible()


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_a_master_curve_fits_each_screen(tab: Tab, computed: Page, width: int, height: int) -> None:
    computed.set_viewport_size(ViewportSize(width=width, height=height))
    page = tab.go(ADDRESS)
    page.get_by_role("img", name="Shift factors").locator("canvas").first.wait_for()
    page.wait_for_function(f"() => document.documentElement.scrollWidth <= {width}")
    assert not grave_faults(page)


def test_what_gives_no_curve_is_said_at_once_and_another_shift_gives_one(tab: Tab, computed: Page) -> None:
    page = tab.go(ADDRESS)
    curves = page.get_by_role("region", name=CURVES).get_by_role("row")
    curves.last.wait_for()
    before = curves.count()
    page.get_by_label("Configuration, amplitude").select_option("angled, 0.1 mm: 50.0 °C")
    page.get_by_role("button", name="Compute the master curve").click()
    expect(page.get_by_text("Measure the same specimen again 10 to 20 K colder")).to_be_visible()
    page.get_by_label("Temperature (°C)").fill("warm")
    page.get_by_role("button", name="Compute the master curve").click()
    expect(page.get_by_text("'warm' is not a list of numbers; separate numbers by spaces")).to_be_visible()
    page.get_by_label("Configuration, amplitude").select_option("angled, 0.01 mm: 5.0, 23.0, 38.0 °C")
    page.get_by_label("Temperature (°C)").fill("20,5")
    page.locator('select[name="shift"]').select_option("Arrhenius")
    page.get_by_role("button", name="Compute the master curve").click()
    expect(curves).to_have_count(before + 1)
    expect(page.get_by_text("Shift by Arrhenius: E = ")).to_be_visible()
    expect(page.get_by_role("region", name="By the curve").get_by_role("row").nth(1)).to_contain_text("20.5")
    curves.last.get_by_role("link").click()
    expect(page.get_by_text("Shift by WLF: C1 = ")).to_be_visible()


def test_a_fit_that_fails_is_told_with_its_reason(tab: Tab, computed: Page) -> None:
    page = tab.go(ADDRESS)
    page.get_by_label("Frequencies to predict at").fill("0.001")
    page.get_by_label("Temperature (°C)").fill("80")
    page.get_by_role("button", name="Compute the master curve").click()
    expect(page.get_by_text("decades outside of the measured")).to_be_visible()


def test_a_specimen_or_a_curve_that_is_not_there_is_said(tab: Tab, computed: Page) -> None:
    page = tab.go("/page/runs?article=beam+3&master=IX")
    expect(page.get_by_text("No sine points of this specimen are identified yet")).to_be_visible()
    page = tab.go(f"{ADDRESS}&curve=99")
    expect(page.get_by_text("there is no master curve 99")).to_be_visible()
