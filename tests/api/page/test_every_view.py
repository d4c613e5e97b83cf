"""Whatever the view: nothing comes from outside, no script fails, and axe-core finds no serious fault."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Request, expect

from tests.api.page.technician import Service, Tab

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


@pytest.mark.parametrize("path", VIEWS)
def test_a_view_needs_nothing_from_outside_and_has_no_grave_fault(path: str, diagnosis: int, reader: Tab) -> None:
    page = reader.go(path.format(diagnosis=diagnosis))
    page.wait_for_function("() => window.socket?.connected && !document.body.classList.contains('dead')")
    expect(page.get_by_text("…", exact=True)).to_have_count(0)  # nothing is still being read
    assert not page.locator('[role="alert"]:visible').all_inner_texts()
    assert reader.hosts == {"127.0.0.1"}
    assert not reader.errors
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


def test_the_form_to_log_in_has_no_grave_fault(campaign: Service, open_tab: Callable[[Service], Tab]) -> None:
    page = open_tab(campaign).go("/page/")
    if not AXE.is_file():
        pytest.skip("axe-core is not here: make test installs it where npm is, or can be had")
    page.add_script_tag(path=str(AXE))
    assert not [each["id"] for each in page.evaluate("() => axe.run()")["violations"] if each["impact"] in GRAVE]


@pytest.mark.parametrize(("path", "shown"), [("/docs", ".opblock"), ("/redoc", "h1")])
def test_documentation_is_whole_and_asks_nobody_outside(
    campaign: Service, open_tab: Callable[[Service], Tab], path: str, shown: str
) -> None:
    tab = open_tab(campaign)
    asked = list[Request]()
    tab.page.on("request", lambda request: asked.append(request))
    page = tab.go(path)
    page.locator(shown).first.wait_for()
    page.wait_for_timeout(1000)  # for what is fetched when all is shown
    sent = {urlsplit(each.url).hostname for each in asked if each.failure != "csp"}  # what policy keeps is never sent
    assert sent - {None} == {"127.0.0.1"}
