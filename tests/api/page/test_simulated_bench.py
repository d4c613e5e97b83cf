"""The page in front of an empty database and a simulated bench that strikes by itself."""

from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import expect

from simlab.laboratory import Laboratory
from tests.api.conftest import configuration
from tests.api.page.technician import Service, Tab, serving

HURRIED = """
const plain = window.setTimeout;
const isOfPage = () => !new Error().stack.includes("_nicegui");
window.setTimeout = (done, after, ...given) => plain(done, isOfPage() ? (after ?? 0) / 1000 : after, ...given);
"""
"""Clocks of the page's own script that go off once run a thousand times as fast: 1.5 s are 25 min."""


@pytest.fixture(scope="module")
def rig(running_laboratory: Laboratory, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service that has measured nothing, on a bench whose operator is a program."""
    folder = tmp_path_factory.mktemp("simulated")
    addresses = running_laboratory.addresses
    operator = f'simulated_operator = "{addresses.operator}"\n'
    (folder / "jointlab.toml").write_text(operator + configuration(addresses, folder), encoding="utf-8")
    with serving(folder) as service:
        yield service


def test_a_simulated_bench_strikes_by_itself_unless_the_tick_is_taken_away(tab: Tab) -> None:
    page = tab.go("/page/measure")
    choice = page.get_by_role("checkbox", name="Let the simulated bench strike and mount by itself")
    expect(choice).to_be_visible()
    expect(choice).to_be_checked()


def test_a_filter_is_spoken_of_only_where_there_is_one(tab: Tab) -> None:
    page = tab.go("/page/runs")
    expect(page.get_by_text("There is no run yet. Press Measure to make one")).to_be_visible()
    page = tab.go("/page/runs?state=failed")
    expect(page.get_by_text("No run fits. Take a filter away")).to_be_visible()


def test_that_a_stop_has_failed_is_told_until_the_next_press_and_no_clock_ends_it(
    rig: Service, open_tab: Callable[[Service], Tab]
) -> None:
    tab = open_tab(rig)
    tab.page.add_init_script(HURRIED)
    tab.log_in()
    page = tab.go("/page/")
    page.route("**/stop", lambda route: route.fulfill(status=503, json={"detail": "no reply when asked to write"}))
    page.get_by_role("button", name="STOP").click()
    told = page.locator(".stop output")
    failed = "STOP FAILED: the actuator may still move. Press the red button on the machine."
    expect(told).to_have_text(failed)
    page.wait_for_timeout(1500)
    expect(told).to_have_text(failed)
    expect(told).to_have_css("border-color", "rgb(176, 0, 32)")
    page.unroute("**/stop")
    page.get_by_role("button", name="STOP").click()
    expect(told).to_have_text("Stopped. The actuator is at rest.")
    rig.leave()
