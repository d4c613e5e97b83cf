"""Whatever the view: nothing comes from outside, no script fails, and axe-core finds no serious fault."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, ViewportSize, expect

from store.catalogue import Catalogue
from tests.api.page.diagnosis import add_example_diagnosis
from tests.api.page.technician import Service, Tab, serving

AXE = Path(sys.prefix) / "axe/node_modules/axe-core/axe.min.js"
VIEWS = (
    "/page/",
    "/page/measure",
    "/page/measure?next={diagnosis}",
    "/page/hammer?run=1",
    "/page/sweep?run=1",
    "/page/runs?state=finished",
    "/page/results?run=1&part=Modes",
    "/page/results?run=1&part=Accelerances",
    "/page/results?run=1&part=Joints",
    "/page/results?run=1&part=Tester",
    "/page/results?run=1&part=Direct+against+inverse",
    "/page/results?run=1&part=Measured+how",
    "/page/gap",
    "/page/gap?diagnosis={diagnosis}",
    "/page/laboratory",
    "/page/laboratory?part=Keys",
    "/page/laboratory?part=Audit+log",
)
GRAVE = ("serious", "critical")


@pytest.fixture(scope="module")
def campaign(demo_copy: Path) -> Iterator[tuple[Service, int]]:
    """A service in front of a whole campaign and a diagnosis of it."""
    with serving(demo_copy) as service:
        with Catalogue.open(service.database) as catalogue:
            diagnosis = add_example_diagnosis(catalogue, run_id=1)
        yield service, diagnosis


@pytest.fixture(scope="module")
def tab(campaign: tuple[Service, int], browser: Browser) -> Iterator[Tab]:
    """One tab that looks at all views, on a tablet."""
    context = browser.new_context(viewport=ViewportSize(width=800, height=1100))
    context.set_default_timeout(60_000)
    tab = Tab(context.new_page(), campaign[0])
    tab.log_in()
    yield tab
    context.close()


@pytest.mark.parametrize("path", VIEWS)
def test_a_view_needs_nothing_from_outside_and_has_no_grave_fault(
    path: str, campaign: tuple[Service, int], tab: Tab
) -> None:
    page = tab.go(path.format(diagnosis=campaign[1]))
    page.wait_for_function("() => window.socket?.connected && !document.body.classList.contains('dead')")
    expect(page.get_by_text("…", exact=True)).to_have_count(0)  # nothing is still being read
    assert not page.locator('[role="alert"]:visible').all_inner_texts()
    assert tab.hosts == {"127.0.0.1"}
    assert not tab.errors
    if not AXE.is_file():
        pytest.skip("axe-core is not here: make test installs it where npm is, or can be had")
    page.add_script_tag(path=str(AXE))
    found = page.evaluate("() => axe.run()")
    assert len(found["passes"]) > 10  # it did look
    width = page.evaluate("() => document.documentElement.scrollWidth")
    assert width <= 800  # nothing is beyond the edge of a tablet
    grave = [
        f"{each['id']} ({each['impact']}): {node['html'][:160]}"
        for each in found["violations"]
        if each["impact"] in GRAVE
        for node in each["nodes"]
    ]
    assert not grave


def test_the_form_to_log_in_has_no_grave_fault(
    campaign: tuple[Service, int], open_tab: Callable[[Service], Tab]
) -> None:
    page = open_tab(campaign[0]).go("/page/")
    if not AXE.is_file():
        pytest.skip("axe-core is not here: make test installs it where npm is, or can be had")
    page.add_script_tag(path=str(AXE))
    assert not [each["id"] for each in page.evaluate("() => axe.run()")["violations"] if each["impact"] in GRAVE]
