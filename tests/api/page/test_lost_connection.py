"""A service that dies, and one that comes back: the page never shows what may not be so."""

from collections.abc import Callable, Iterator
from urllib.parse import urlencode

import pytest
from playwright.sync_api import Page, expect

from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from tests.api.conftest import configuration
from tests.api.page.technician import Service, Tab, serving

WATCH = """
const look = () => {
  const seen = JSON.parse(sessionStorage.getItem("seen"));
  const text = (what) => document.querySelector(what)?.textContent ?? "";
  if (seen && document.querySelector("#rig-state") && !document.body.classList.contains("dead")) {
    seen.push({ state: text("#rig-state"), prompt: text("#prompt") });
    sessionStorage.setItem("seen", JSON.stringify(seen));
  }
  requestAnimationFrame(look);
};
requestAnimationFrame(look);
"""
"""Notes what a page shows in every picture of it that is not marked as dead, once "seen" is there to note it in."""
BUSY = """
async (button) => {
  window.lost = 0;
  window.socket.on("disconnect", () => window.lost++);
  for (let time = 0; time < 3; time++) {
    await new Promise((resume) => setTimeout(resume, 100));
    const end = Date.now() + 4000;
    while (Date.now() < end);
  }
  button.click();
}
"""
"""Keeps a page busy for 4 s, three times so that a service that asks seldom asks it, and presses a button then."""
WANTED = {"parts": "hammer", "points": "1y 3y", "blows": "2", "title": "Cut off"}


@pytest.fixture
def service(laboratory: Laboratory, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    folder = tmp_path_factory.mktemp("lost")
    (folder / "jointlab.toml").write_text(configuration(laboratory.addresses, folder), encoding="utf-8")
    with serving(folder) as service:
        yield service


def struck_once(tab: Tab, bench: OperatorClient) -> Page:
    """The view of a hammer session that waits for its second blow."""
    page = tab.go(f"/page/measure?{urlencode(WANTED)}")
    page.get_by_role("button", name="Start").click()
    page.get_by_role("button", name="Done").click()
    expect(page.locator("#prompt")).to_have_text("Strike 1y (blow 1)")
    bench.do("strike", node=1, direction="y", what="clean")
    expect(page.locator("#count")).to_contain_text("1 of 4 blows accepted")
    return page


def test_a_dead_socket_leaves_only_stop_and_a_restart_shows_the_true_state(
    service: Service, bench: OperatorClient, open_tab: Callable[[Service], Tab]
) -> None:
    tab = open_tab(service)
    tab.log_in()
    page = struck_once(tab, bench)

    service.kill()
    expect(page.locator("#dead")).to_be_visible()
    expect(page.locator("main")).to_have_attribute("inert", "")
    expect(page.get_by_role("navigation", name="views")).to_have_attribute("inert", "")
    page.get_by_role("button", name="STOP").click()
    expect(page.locator(".stop output")).to_have_text(
        "Stopped. The actuator is at rest."
    )  # by the drive process itself

    service.start()
    expect(page.locator("#dead")).to_be_hidden()
    expect(page.locator("#count")).to_contain_text("1 of 4 blows accepted")
    expect(page.locator("#rig-state")).to_have_text("at rest")
    expect(page.locator("#prompt")).to_contain_text("Run 1 is stopped")
    expect(page.locator("#stop-in-force")).to_contain_text(
        "STOP is in force: nothing moves. STOP listener, from 127.0.0.1"
    )
    for view in ("/page/", "/page/runs"):
        expect(tab.go(view).get_by_role("cell", name="stopped", exact=True)).to_be_visible()
    page = tab.go("/page/hammer?run=1")
    page.get_by_role("button", name="reset STOP").click()
    page.get_by_role("button", name="Resume run 1").click()
    expect(page.locator("#prompt")).to_have_text("Take the hammer to 1y")
    expect(page.locator("#count")).to_contain_text("1 of 4 blows accepted")
    page.get_by_role("button", name="STOP").click()
    expect(page.locator("#prompt")).to_contain_text("Run 1 is stopped")


def test_a_page_that_is_connected_again_shows_the_present_state_at_once(
    service: Service, bench: OperatorClient, open_tab: Callable[[Service], Tab]
) -> None:
    """Without a reload the page finds the service, which was started again, by itself."""
    tab = open_tab(service)
    tab.log_in()
    tab.page.add_init_script(WATCH)
    page = struck_once(tab, bench)

    service.kill()
    expect(page.locator("#dead")).to_be_visible()
    page.evaluate("sessionStorage.setItem('seen', '[]')")
    service.start()
    expect(page.locator("#dead")).to_be_hidden()
    expect(page.locator("#prompt")).to_have_text("Strike 1y (blow 2)")  # the run has outlived the service
    expect(page.locator("#rig-state")).to_have_text("running")
    expect(page.locator("#count")).to_contain_text("1 of 4 blows accepted")
    shown = [dict(each) for each in page.evaluate("JSON.parse(sessionStorage.getItem('seen'))")]
    assert shown, "nothing was seen of the page that came back"
    assert {each["state"] for each in shown} == {"running"}, shown
    assert {each["prompt"] for each in shown} <= {"", "Strike 1y (blow 2)"}, shown


def test_a_page_that_was_busy_for_four_seconds_keeps_its_connection_and_the_next_press(
    service: Service, open_tab: Callable[[Service], Tab]
) -> None:
    tab = open_tab(service)
    tab.log_in()
    page = tab.go(f"/page/measure?{urlencode(WANTED)}")
    page.get_by_role("button", name="Start").click()
    expect(page.locator("#prompt")).to_have_text("Take the hammer to 1y")
    page.get_by_role("button", name="Done").evaluate(BUSY)
    expect(page.locator("#prompt")).to_have_text("Strike 1y (blow 1)")
    assert page.evaluate("window.lost") == 0  # nothing is kept over a reload
    page.get_by_role("button", name="STOP").click()
    expect(page.locator("#prompt")).to_contain_text("Run 1 is stopped")
