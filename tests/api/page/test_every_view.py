"""Whatever the view: nothing comes from outside, no script fails, and axe-core finds no serious fault."""

from collections.abc import Callable
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import Request, expect

from tests.api.page.axe import grave_faults
from tests.api.page.technician import Service, Tab

VIEWS = (
    "/page/",
    "/page/measure",
    "/page/measure?sequence=paper&as=text",
    "/page/measure?next={diagnosis}",
    "/page/hammer?run=1",
    "/page/sweep?run=1",
    "/page/runs?state=finished",
    "/page/runs?overlay=1",
    "/page/runs?article=steel+beam+on+two+joints+of+inclined+cylinders&master=I",
    "/page/results?run=1",
    "/page/results?run=1&part=Modes",
    "/page/results?run=1&part=Accelerances",
    "/page/results?run=1&part=Joints",
    "/page/results?run=1&part=Tester",
    "/page/results?run=1&part=Direct+against+inverse",
    "/page/results?run=1&part=Measured+how",
    "/page/gap",
    "/page/gap?diagnosis={diagnosis}",
    "/page/gap?investigation={reading}",
    "/page/gap?investigation={further_run}",
    "/page/measure?investigation={further_run}",
    "/page/instruments",
    "/page/instruments?part=Channels",
    "/page/laboratory",
    "/page/laboratory?part=Keys",
    "/page/laboratory?part=Audit+log",
    "/page/alarms",
    "/page/hall",
)
ALL_DRAWN = "() => [...document.querySelectorAll('.nicegui-echart')].every(chart => chart.querySelector('canvas, svg'))"


@pytest.mark.parametrize("path", VIEWS)
def test_a_view_needs_nothing_from_outside_and_has_no_grave_fault(
    path: str, diagnosis: int, waiting: dict[str, int], reader: Tab
) -> None:
    page = reader.go(path.format(diagnosis=diagnosis, **waiting))
    page.wait_for_function("() => window.socket?.connected && !document.body.classList.contains('dead')")
    for part in parse_qs(urlsplit(path).query).get("part", ()):
        if path.startswith("/page/results") and part != "Measured how":
            page.get_by_role("heading", name=part, exact=True).wait_for()  # its section has begun to be read
    expect(page.get_by_text("…", exact=True)).to_have_count(0)  # nothing is still being read
    page.wait_for_function(ALL_DRAWN)
    expect(page.locator('[role="alert"]:visible')).to_have_count(0)
    assert reader.hosts == {"127.0.0.1"}
    assert not reader.errors
    page.wait_for_function("() => document.documentElement.scrollWidth <= 800")  # the width of a tablet
    assert not grave_faults(page)


def test_the_form_to_log_in_has_no_grave_fault(campaign: Service, open_tab: Callable[[Service], Tab]) -> None:
    page = open_tab(campaign).go("/page/")
    assert not grave_faults(page)


@pytest.mark.parametrize(("path", "shown"), [("/docs", ".opblock"), ("/redoc", "h1")])
def test_documentation_is_complete_and_loads_nothing_from_outside(
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
