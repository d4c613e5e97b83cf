"""Chromium without a window, in front of a service on simulated instruments, and an operator at the bench."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, ViewportSize, expect, sync_playwright

from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from store.catalogue import Catalogue
from tests.api.conftest import configuration
from tests.api.page.diagnosis import add_example_diagnosis
from tests.api.page.technician import Service, Tab, serving
from tests.investigations import HALF_FORCE, READING, add_waiting
from tests.waiting import LONG

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
PATIENCE = 1000 * LONG  # ms
expect.set_options(timeout=PATIENCE)
SIZE = ViewportSize(width=1000, height=800)
TABLET = ViewportSize(width=800, height=1100)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Chromium, wherever this machine has it."""
    program = next((found for name in PROGRAMS if (found := shutil.which(name))), None)
    if program is None:
        pytest.skip(f"no Chromium here ({', '.join(PROGRAMS)}), and it could not be installed: see make test")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture
def open_tab(browser: Browser) -> Iterator[Callable[[Service], Tab]]:
    """Open a tab of a browser of its own, without any cookie."""
    contexts = []

    def open_one(service: Service) -> Tab:
        context = browser.new_context(viewport=SIZE, accept_downloads=True)
        context.set_default_timeout(PATIENCE)
        contexts.append(context)
        return Tab(context.new_page(), service)

    yield open_one
    for context in contexts:
        context.close()


@pytest.fixture(scope="module")
def rig(running_laboratory: Laboratory, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service on a simulated laboratory whose operator is the test itself."""
    folder = tmp_path_factory.mktemp("rig")
    (folder / "jointlab.toml").write_text(configuration(running_laboratory.addresses, folder), encoding="utf-8")
    with serving(folder) as service:
        yield service


@pytest.fixture
def bench(running_laboratory: Laboratory) -> Iterator[OperatorClient]:
    """The operator of the bench."""
    bench = OperatorClient(running_laboratory.addresses.operator)
    yield bench
    bench.close()


@pytest.fixture
def tab(rig: Service, open_tab: Callable[[Service], Tab]) -> Iterator[Tab]:
    """A tab that is logged in to the rig; whatever it left running is stopped afterwards, and it drives no more."""
    tab = open_tab(rig)
    tab.log_in()
    yield tab
    rig.leave()
    assert tab.hosts == {"127.0.0.1"}
    assert not tab.errors


@pytest.fixture(scope="session")
def demo_copy(demo: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what the demo measured and found, that tests may add to."""
    folder = tmp_path_factory.mktemp("campaign")
    shutil.copy(demo / "jointlab.db", folder)
    shutil.copytree(demo / "jointlab-waveforms", folder / "jointlab-waveforms")
    (folder / "jointlab.toml").write_text("", encoding="utf-8")
    return folder


@pytest.fixture(scope="session")
def campaign(demo_copy: Path) -> Iterator[Service]:
    """A service in front of a whole campaign, which it does not drive."""
    with serving(demo_copy) as service:
        yield service


@pytest.fixture(scope="session")
def reader(campaign: Service, browser: Browser) -> Iterator[Tab]:
    """One tab that is logged in to the campaign, on a tablet."""
    context = browser.new_context(viewport=TABLET, accept_downloads=True)
    context.set_default_timeout(PATIENCE)
    tab = Tab(context.new_page(), campaign)
    tab.log_in()
    yield tab
    context.close()


@pytest.fixture(scope="session")
def diagnosis(campaign: Service) -> int:
    """Number of a diagnosis of the campaign."""
    with Catalogue.open(campaign.database) as catalogue:
        return add_example_diagnosis(catalogue, run_id=1)


@pytest.fixture(scope="session")
def waiting(campaign: Service) -> dict[str, int]:
    """Numbers of two investigations of the campaign: one waits for a reading, one for a further run."""
    with Catalogue.open(campaign.database) as catalogue:
        asked = {"reading": READING, "further_run": HALF_FORCE}
        return {name: add_waiting(catalogue, 1, each).id for name, each in asked.items()}
