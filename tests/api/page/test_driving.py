"""A technician drives the rig from the page, as a person would, by what the page shows."""

import re
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from urllib.parse import urlencode

import pytest
from playwright.sync_api import Page, expect

from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from simlab.ordinary import BenchConditions
from simlab.tester_server import TesterFault
from tests.api.page.axe import grave_faults
from tests.api.page.technician import Service, Tab

HAMMER = {"parts": "hammer", "points": "1y 3y", "blows": "2", "title": "Two points"}
SWEEP = {
    "parts": "sweep",
    "specimens": "I",
    "configurations": "shear",
    "amplitudes": "0,1 0,01",
    "frequencies": "40 80 40",
    "title": "Short sweep",
}
UNDER_PRESSURE = "Paused, nothing is armed. The hydraulics are on: the actuator holds its position under pressure."
TRIPPED = "The emergency stop has tripped: somebody pressed it, or the program tripped it."
LONG_SWEEP = SWEEP | {"frequencies": "5 200 0.1"}
SPEED = 20.0
"""Of the bench: a long sweep takes longer than any test, however slowly a busy machine shows the page."""


@pytest.fixture(scope="module")
def running_laboratory() -> Iterator[Laboratory]:
    """In place of the one that is ten times as fast."""
    with Laboratory(3, SPEED, BenchConditions(double_hits=0.0)) as laboratory:
        yield laboratory


def start(tab: Tab, wanted: dict[str, str]) -> Page:
    """Start what the address asks for."""
    page = tab.go(f"/page/measure?{urlencode(wanted)}")
    page.get_by_role("button", name="Start").click()
    return page


def asked(page: Page, text: str) -> None:
    """Wait until the technician is asked for this."""
    expect(page.locator("#prompt")).to_have_text(text)


def go_to(page: Page, point: str) -> None:
    """Take the hammer to a point, and say so."""
    asked(page, f"Take the hammer to {point}")
    page.get_by_role("button", name="Done").click()
    asked(page, f"Strike {point} (blow 1)")


def mount(page: Page, bench: OperatorClient) -> None:
    """Put the cylinders in as asked, and say so."""
    asked(page, "Mount the cylinders of joint I in shear, and step back")
    bench.do("mount", specimen="I", configuration="shear")
    page.get_by_role("button", name="Done").click()


def test_a_wrong_key_is_refused_with_a_reason_and_a_right_one_opens_the_page(
    rig: Service, open_tab: Callable[[Service], Tab]
) -> None:
    tab = open_tab(rig)
    page = tab.go("/page/runs?state=stopped")
    page.get_by_label("Key").fill("jl_wrong")
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_role("alert")).to_contain_text("this key is not known here")
    page.get_by_label("Key").fill(rig.key)
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_role("heading", name="Runs", exact=True)).to_be_visible()
    assert page.url.endswith("/page/runs?state=stopped")
    assert tab.hosts == {"127.0.0.1"}


def test_stop_is_there_before_the_login(rig: Service, open_tab: Callable[[Service], Tab]) -> None:
    page = open_tab(rig).go("/page/")
    page.get_by_role("button", name="STOP").click()
    expect(page.locator(".stop output")).to_have_text("Stopped. The actuator is at rest.")
    rig.leave()


def test_a_hammer_session_highlights_the_next_point_and_refuses_a_double_hit(tab: Tab, bench: OperatorClient) -> None:
    page = start(tab, HAMMER)
    go_to(page, "1y")
    expect(page.locator('[data-next="true"]')).to_have_attribute("data-point", "1y")
    bench.do("strike", node=1, direction="y", what="double")
    expect(page.locator("#verdict")).to_contain_text("refused: double hit")
    expect(page.locator("#count")).to_contain_text("0 of 4 blows accepted")
    for blow, point, count in ((2, "1y", 1), (3, "1y", 2), (1, "3y", 3), (2, "3y", 4)):
        if blow == 1:
            go_to(page, point)
        asked(page, f"Strike {point} (blow {blow})")
        expect(page.locator('[data-next="true"]')).to_have_attribute("data-point", point)
        bench.do("strike", node=int(point[0]), direction="y", what="clean")
        expect(page.locator("#count")).to_contain_text(f"{count} of 4 blows accepted")
    expect(page.locator("#verdict")).to_contain_text("accepted")
    expect(page.locator("#prompt")).to_contain_text("is finished")
    expect(page.get_by_role("img", name="Coherence so far").locator("canvas").first).to_be_visible()


def test_a_sweep_is_held_and_continued_and_shows_k_and_gamma(tab: Tab, bench: OperatorClient) -> None:
    page = start(tab, LONG_SWEEP)
    mount(page, bench)
    expect(page.locator("#latest")).to_contain_text("asked; k =")
    page.get_by_role("button", name="Pause").click()
    asked(page, UNDER_PRESSURE)
    expect(page.locator("#rig-state")).to_have_text("paused")
    page.reload()  # the count may lag behind the rig by a refresh
    asked(page, UNDER_PRESSURE)
    held = page.locator("#count").inner_text()
    page.reload()
    asked(page, UNDER_PRESSURE)
    expect(page.locator("#count")).to_have_text(held)
    page.get_by_role("button", name="Resume").click()
    expect(page.locator("#count")).not_to_have_text(held)
    expect(page.locator("#count")).to_contain_text("left")
    page.get_by_role("button", name="STOP").click()
    expect(page.locator(".stop output")).to_have_text("Stopped. The actuator is at rest.")
    expect(page.locator("#prompt")).to_contain_text("is stopped")


def test_a_sweep_is_paused_before_the_database_is_asked_to_note_it(
    tab: Tab, rig: Service, bench: OperatorClient, laboratory: Laboratory
) -> None:
    page = start(tab, LONG_SWEEP)
    mount(page, bench)
    expect(page.locator("#latest")).to_contain_text("asked; k =")
    with closing(sqlite3.connect(rig.folder / "jointlab.db")) as other:
        other.execute("BEGIN IMMEDIATE")
        page.get_by_role("button", name="Pause").click()
        asked(page, UNDER_PRESSURE)
        assert laboratory.tester.actuator.steady_pp() == 0.0
        other.rollback()
    expect(page.get_by_role("alert").filter(has_text="database")).to_have_count(0)
    entries = tab.get("/api/audit?action=pause%20run").json()["items"]
    assert entries[0]["outcome"] == "done"


def test_rest_is_told_as_long_as_the_actuator_rests_and_no_longer(tab: Tab, bench: OperatorClient) -> None:
    page = start(tab, LONG_SWEEP)
    mount(page, bench)
    told = page.locator(".stop output")
    page.get_by_role("button", name="STOP").click()
    expect(told).to_have_text("Stopped. The actuator is at rest.")
    page.get_by_role("button", name="reset STOP").click()
    expect(page.locator("#stop-in-force")).to_have_count(0)
    expect(told).to_have_text("Stopped. The actuator is at rest.")
    page.get_by_role("button", name="Resume run").click()
    expect(page.locator("#rig-state")).to_have_text("running")
    expect(told).to_be_empty()
    page.get_by_role("button", name="STOP").click()
    expect(page.locator("#rig-state")).to_have_text("at rest")


def test_a_stop_that_is_not_confirmed_is_red_and_sends_to_the_machine(tab: Tab) -> None:
    page = tab.go("/page/")
    page.route("**/stop", lambda route: route.fulfill(status=503, json={"detail": "no reply when asked to write"}))
    page.get_by_role("button", name="STOP").click()
    told = page.locator(".stop output")
    expect(told).to_have_text("STOP FAILED: the actuator may still move. Press the red button on the machine.")
    expect(told).to_have_css("border-color", "rgb(176, 0, 32)")


def test_a_sweep_is_measured_to_its_end_and_diagnosed_by_a_button(tab: Tab, bench: OperatorClient) -> None:
    page = start(tab, SWEEP)
    mount(page, bench)
    expect(page.locator("#count")).to_have_text("4 of 4 sine points")
    expect(page.locator("#latest")).to_contain_text(re.compile(r"80.0\sHz, 0.0\d+\smm reached of 0.0100\smm asked"))
    expect(page.locator("#prompt")).to_contain_text("is finished")
    page.get_by_role("link", name="Results of run").click()
    expect(page.get_by_role("heading", name="Tester", exact=True)).to_be_visible()  # what the run may have results of
    page.get_by_role("link", name="Modes", exact=True).click()
    expect(page.get_by_text("This run has no hammer session")).to_be_visible()
    diagnose = page.get_by_role("button", name="Diagnose the gap")
    diagnose.click()
    page.get_by_role("button", name="Cancel job").wait_for()
    diagnose.click()
    expect(page.get_by_role("alert").filter(has_text="does that already")).to_be_visible()
    page.get_by_role("button", name="Cancel job").click()
    expect(page.get_by_role("button", name="Cancel job")).to_be_hidden()
    expect(page.get_by_role("region", name="Jobs").get_by_role("row").nth(1)).to_contain_text("cancelled")
    diagnose.click()
    jobs = page.get_by_role("region", name="Jobs")
    expect(jobs.get_by_role("row").nth(1)).to_contain_text("diagnose")
    jobs.get_by_role("link", name="Open the diagnosis").click()
    expect(page.locator("#verdict")).to_have_text(re.compile("explained|nothing beyond noise"))  # by four noisy sines


def struck_twice(tab: Tab, bench: OperatorClient) -> Page:
    """A session that has two blows at 1y and has gone on to 3y."""
    page = start(tab, HAMMER)
    go_to(page, "1y")
    for blow in (1, 2):
        asked(page, f"Strike 1y (blow {blow})")
        bench.do("strike", node=1, direction="y", what="clean")
    go_to(page, "3y")
    return page


def test_a_running_hammer_session_has_no_grave_fault(tab: Tab, bench: OperatorClient) -> None:
    page = start(tab, HAMMER)
    asked(page, "Take the hammer to 1y")
    assert not grave_faults(page)
    go_to(page, "1y")
    bench.do("strike", node=1, direction="y", what="double")
    expect(page.locator("#verdict")).to_contain_text("refused")
    assert not grave_faults(page)
    bench.do("strike", node=1, direction="y", what="clean")
    expect(page.locator("#count")).to_contain_text("1 of 4 blows accepted")
    assert not grave_faults(page)
    page.get_by_role("link", name="Dashboard").click()
    expect(page.get_by_role("link", name="Hammer session")).to_be_visible()
    assert not grave_faults(page)


def test_a_running_and_a_held_sweep_and_a_trip_have_no_grave_fault(
    tab: Tab, bench: OperatorClient, laboratory: Laboratory
) -> None:
    page = start(tab, LONG_SWEEP)
    mount(page, bench)
    expect(page.locator("#latest")).to_contain_text("asked; k =")
    assert not grave_faults(page)
    page.get_by_role("button", name="Pause").click()
    asked(page, UNDER_PRESSURE)
    assert not grave_faults(page)
    page.get_by_role("button", name="Resume").click()
    expect(page.locator("#rig-state")).to_have_text("running")
    laboratory.tester.emergency_stop()
    expect(page.locator("#rig-state")).to_have_text("tripped: emergency stop")
    assert not grave_faults(page)
    page.get_by_role("link", name="Dashboard").click()
    expect(page.get_by_role("button", name="I have removed the cause")).to_be_visible()
    assert not grave_faults(page)


def test_a_run_is_held_while_it_waits_for_a_mounting(tab: Tab, laboratory: Laboratory) -> None:
    page = start(tab, LONG_SWEEP)
    asked(page, "Mount the cylinders of joint I in shear, and step back")
    page.get_by_role("button", name="Pause").click()
    asked(page, "Paused, nothing is armed. The hydraulics are off.")
    expect(page.locator("#rig-state")).to_have_text("paused")
    expect(page.get_by_text("Still to be done after that: mount the cylinders of joint I in shear")).to_be_visible()
    expect(page.get_by_role("button", name="Done")).to_be_hidden()
    page.get_by_role("button", name="Resume").click()
    asked(page, "Mount the cylinders of joint I in shear, and step back")
    expect(page.locator("#rig-state")).to_have_text("running")
    expect(page.get_by_role("button", name="Done")).to_be_visible()


def test_a_stopped_session_is_resumed_at_the_point_where_it_was(tab: Tab, bench: OperatorClient) -> None:
    page = struck_twice(tab, bench)
    page.keyboard.press("Escape")
    expect(page.locator("#prompt")).to_contain_text("is stopped")
    page.get_by_role("button", name="Resume run").click()
    expect(page.get_by_role("alert")).to_contain_text("STOP is in force")
    page.get_by_role("button", name="reset STOP").click()
    expect(page.locator("#stop-in-force")).to_be_hidden()
    page.get_by_role("button", name="Resume run").click()
    go_to(page, "3y")
    expect(page.locator("#count")).to_contain_text("2 of 4 blows accepted")


def test_a_point_is_repeated_within_its_session(tab: Tab, bench: OperatorClient) -> None:
    page = struck_twice(tab, bench)
    expect(page.locator("#count")).to_contain_text("2 of 4 blows accepted")
    page.get_by_label("Point to repeat").select_option("1y")
    page.get_by_role("button", name="Repeat this point").click()
    expect(page.locator("#count")).to_contain_text("0 of 4 blows accepted")
    expect(page.locator('[data-next="true"]')).to_have_attribute("data-point", "3y")  # first what was begun
    for blow in (1, 2):
        asked(page, f"Strike 3y (blow {blow})")
        bench.do("strike", node=3, direction="y", what="clean")
    asked(page, "Take the hammer to 1y")
    expect(page.locator('[data-next="true"]')).to_have_attribute("data-point", "1y")
    page.get_by_role("button", name="Done").click()
    for blow in (3, 4):
        asked(page, f"Strike 1y (blow {blow})")
        bench.do("strike", node=1, direction="y", what="clean")
    expect(page.locator("#prompt")).to_contain_text("is finished")
    expect(page.locator("#count")).to_contain_text("4 of 4 blows accepted")
    taken_back = page.get_by_role("region", name="Blows at 1y").get_by_role("row").filter(has_text="withdrawn")
    expect(taken_back).to_have_count(2)
    page.get_by_role("button", name="Repeat this point").click()  # of a finished run: a run of its own
    expect(page.get_by_label("Points to strike")).to_have_value("3y")


def test_manual_work_is_prompted_and_waited_for(tab: Tab, bench: OperatorClient) -> None:
    """The sequence of a diagnosis, kept under a name, begins with a prompt."""
    document = tab.get("/api/sequences/paper").json()["sequence"]
    hammer = document["steps"][0] | {"points": ["1y"], "blows": 2}
    document["steps"] = [{"step": "prompt", "text": "Turn the accelerometer"}, hammer]
    tab.put("/api/sequences/turned", document)
    page = tab.go("/page/measure?sequence=turned")
    expect(page.locator("#steps li").first).to_have_text("by hand: Turn the accelerometer")
    page.get_by_role("button", name="Start").click()
    asked(page, "Turn the accelerometer")
    page.get_by_role("button", name="Done").click()
    go_to(page, "1y")


def test_a_tripped_interlock_is_explained_and_reset(tab: Tab, bench: OperatorClient, laboratory: Laboratory) -> None:
    page = start(tab, LONG_SWEEP)
    mount(page, bench)
    expect(page.locator("#latest")).to_be_visible()
    laboratory.tester.emergency_stop()
    expect(page.locator("#rig-state")).to_have_text("tripped: emergency stop")
    asked(page, f"{TRIPPED} Remove the cause, then reset.")
    expect(page.locator("#ended")).to_contain_text("has failed: the tester was stopped by emergency stop")
    expect(page.get_by_role("button", name="I have removed the cause")).to_be_visible()
    page.set_viewport_size({"width": 390, "height": 844})
    badge, stop = (page.locator(place).bounding_box() for place in ("#rig-state", ".stop button"))
    assert badge is not None
    assert stop is not None
    assert badge["x"] + badge["width"] <= stop["x"]
    page.get_by_role("link", name="Dashboard").click()
    expect(page.get_by_text(TRIPPED)).to_be_visible()
    page.get_by_role("button", name="I have removed the cause").click()
    expect(page.get_by_role("alert").filter(has_text="cause still present")).to_be_visible()  # it is still pressed
    laboratory.tester.release_emergency_stop()
    page.get_by_role("button", name="I have removed the cause").click()
    expect(page.locator("#rig-state")).to_have_text("at rest")
    expect(page.get_by_text("No interlock has stopped the actuator.")).to_be_visible()


def test_a_trip_while_somebody_mounts_is_explained_and_reset_when_the_run_has_ended(
    tab: Tab, bench: OperatorClient, laboratory: Laboratory
) -> None:
    page = start(tab, LONG_SWEEP)
    asked(page, "Mount the cylinders of joint I in shear, and step back")
    expect(page.locator("#rig-state + span")).to_have_text("waiting for the operator")
    laboratory.tester.emergency_stop()
    expect(page.locator("#rig-state")).to_have_text("tripped: emergency stop")
    expect(page.get_by_text(f"{TRIPPED} Remove the cause.")).to_be_visible()
    mount(page, bench)
    expect(page.locator("#ended")).to_contain_text("has failed: the tester was stopped by emergency stop")
    laboratory.tester.release_emergency_stop()
    page.get_by_role("button", name="I have removed the cause").click()
    page.get_by_role("button", name="Resume run").click()
    asked(page, "Mount the cylinders of joint I in shear, and step back")


def test_a_trip_while_nothing_runs_is_shown_with_the_reset_beside_it(tab: Tab, laboratory: Laboratory) -> None:
    page = tab.go("/page/")
    expect(page.get_by_text("No interlock has stopped the actuator.")).to_be_visible()
    laboratory.tester.emergency_stop()
    expect(page.get_by_text(TRIPPED)).to_be_visible()
    expect(page.locator("#rig-state")).to_have_text("tripped: emergency stop")
    laboratory.tester.release_emergency_stop()
    page.get_by_role("button", name="I have removed the cause").click()
    expect(page.get_by_text("No interlock has stopped the actuator.")).to_be_visible()


def test_a_tester_that_does_not_answer_is_shown_while_nothing_runs(tab: Tab, laboratory: Laboratory) -> None:
    page = tab.go("/page/")
    laboratory.tester.faults.set(TesterFault.SILENT)
    expect(page.locator("#silent")).to_contain_text("The tester does not answer. Look at its power and its line")
    expect(page.locator("#rig-state")).to_have_text("the tester does not answer")
    laboratory.tester.faults.clear()
    expect(page.get_by_text("No interlock has stopped the actuator.")).to_be_visible()
    expect(page.locator("#rig-state")).to_have_text("at rest")


def test_a_form_that_cannot_be_measured_is_refused_on_the_page(tab: Tab) -> None:
    page = start(tab, HAMMER | {"points": "1y 99y"})
    expect(page.get_by_role("alert").filter(has_text="no node for 99y")).to_be_visible()
    page = start(tab, SWEEP | {"amplitudes": "a lot"})
    expect(page.get_by_role("alert").filter(has_text="is not a list of numbers")).to_be_visible()
    page = tab.go(f"/page/measure?{urlencode(SWEEP | {'amplitudes': '5'})}")  # before Start, too, in the field's unit
    expect(page.get_by_text("amplitude 5 mm is outside the rig's limits of 0 to 0.3 mm")).to_be_visible()
    page = start(tab, SWEEP | {"amplitudes": "5"})
    expect(page.get_by_role("alert").filter(has_text="outside the rig's limits")).to_be_visible()


def test_a_key_is_revoked_when_that_is_confirmed_and_the_last_that_manages_keys_never(tab: Tab) -> None:
    page = tab.go("/page/laboratory")
    page.get_by_role("link", name="Keys").click()
    before = page.get_by_role("button", name="Revoke key 1", exact=True).element_handle()
    assert before is not None
    page.get_by_label("Name of the person or program").fill("a visitor")
    page.get_by_role("button", name="Make the key").click()
    number = page.get_by_role("row").filter(has_text="a visitor").first.get_by_role("cell").first.inner_text()
    page.get_by_role("button", name=f"Revoke key {number}", exact=True).click()
    assert before.evaluate("(element) => element.isConnected")  # a press on one that is replaced would be lost
    page.get_by_role("button", name=f"Keep key {number}").click()
    page.get_by_role("button", name=f"Revoke key {number}", exact=True).click()
    page.get_by_role("button", name=f"Yes, key {number} (a visitor) opens nothing any more").click()
    expect(page.get_by_role("button", name=f"Revoke key {number}", exact=True)).to_be_hidden()
    page.get_by_role("button", name="Revoke key 1", exact=True).click()
    page.get_by_role("button", name="Yes, key 1 (technician) opens nothing any more").click()
    expect(page.get_by_role("alert").filter(has_text="the last one that manages keys")).to_be_visible()


def test_two_people_do_not_drive_at_once(
    tab: Tab, bench: OperatorClient, rig: Service, open_tab: Callable[[Service], Tab]
) -> None:
    page = start(tab, HAMMER)
    go_to(page, "1y")
    page.get_by_role("link", name="Laboratory").click()
    page.get_by_role("link", name="Keys").click()
    page.get_by_label("Name of the person or program").fill("another technician")
    page.get_by_role("checkbox", name="control:rig").click()
    expect(page.get_by_role("checkbox", name="control:rig")).to_be_checked()
    page.get_by_role("button", name="Make the key").click()
    other = open_tab(Service(rig.folder, rig.port, page.locator("#secret").inner_text()))
    their = other.log_in()
    their.get_by_role("link", name="Hammer session").click()
    asked(their, "Strike 1y (blow 1)")
    their.get_by_role("button", name="Pause").click()
    expect(their.get_by_role("alert").filter(has_text="drives the rig")).to_be_visible()
    expect(their.get_by_role("button", name="Drive from here")).to_be_hidden()


def test_two_tabs_of_one_technician_do_not_drive_at_once_and_the_second_takes_over(
    tab: Tab, bench: OperatorClient
) -> None:
    first = start(tab, HAMMER)
    go_to(first, "1y")
    second = tab.beside()
    page = second.go("/page/hammer")
    asked(page, "Strike 1y (blow 1)")
    page.get_by_role("button", name="Pause").click()
    expect(page.get_by_role("alert").filter(has_text="it uses your key")).to_be_visible()
    page.get_by_role("button", name="Drive from here").click()
    expect(page.get_by_role("button", name="Drive from here")).to_be_hidden()
    page.get_by_role("button", name="Pause").click()
    asked(page, "Paused, nothing is armed. The run does not drive the actuator here.")
    first.get_by_role("button", name="Resume").click()
    expect(first.get_by_role("alert").filter(has_text="it uses your key")).to_be_visible()
    second.go("/page/sweep")  # another view of the tab that drives
    second.go("/page/hammer").get_by_role("button", name="Resume").click()
    asked(page, "Strike 1y (blow 1)")
