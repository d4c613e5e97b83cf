"""The hall on the page: each rig's own state, its STOP, and nothing of a machine that does not answer."""

import re
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import ViewportSize, expect

from api.page.views.hall import state_text
from jointlab.drive.phase import Phase
from jointlab.hall import ReportedState, Seen
from jointlab.settings import HallRig
from simlab.laboratory import Laboratory
from tests.api.conftest import configuration
from tests.api.page.axe import grave_faults
from tests.api.page.technician import Service, Tab, serving
from tests.drive_holder import end_drive_process
from tests.ports import free_port

PHONE = ViewportSize(width=390, height=844)
AT_REST = re.compile("^STOP at .*: the actuator is at rest.$")


def test_a_hall_without_a_rig_of_its_own_stops_the_others_also_without_a_socket(
    running_laboratory: Laboratory, tmp_path: Path, open_tab: Callable[[Service], Tab]
) -> None:
    port = free_port()
    given = configuration(running_laboratory.addresses, tmp_path).replace("stop_port = 0", f"stop_port = {port}")
    (tmp_path / "hall").mkdir()
    (tmp_path / "hall" / "jointlab.toml").write_text(
        f'[[hall]]\nrig = "rig"\nstop_address = "127.0.0.1"\nstop_port = {port}\n', encoding="utf-8"
    )
    (tmp_path / "jointlab.toml").write_text(given, encoding="utf-8")
    with serving(tmp_path), serving(tmp_path / "hall") as hall:
        tab = open_tab(hall)
        tab.log_in()
        page = tab.go("/page/hall")
        own = page.get_by_role("region", name="rig rig")
        expect(own.locator(".badge")).to_have_text("at rest")
        expect(page.locator(".stop")).to_have_count(0)
        page.evaluate("socket.io.reconnection(false); socket.disconnect()")
        expect(page.locator("#dead")).to_be_visible()
        expect(own.locator(".badge").locator("..").locator("..")).to_have_attribute("inert", "")
        own.get_by_role("button", name="STOP rig").click()
        expect(own.get_by_role("status")).to_have_text(AT_REST)
        assert not tab.errors


def test_nothing_is_told_of_a_machine_that_the_rig_does_not_drive(
    running_laboratory: Laboratory, tmp_path: Path, open_tab: Callable[[Service], Tab]
) -> None:
    port = free_port()
    given = configuration(running_laboratory.addresses, tmp_path).replace("stop_port = 0", f"stop_port = {port}")
    hall = f'[[hall]]\nrig = "rig"\nstop_address = "127.0.0.1"\nstop_port = {port}\n'
    without_tester = re.sub("tester_url = .*", "", given)
    (tmp_path / "jointlab.toml").write_text(without_tester + hall, encoding="utf-8")
    with serving(tmp_path) as service:
        tab = open_tab(service)
        tab.log_in()
        page = tab.go("/page/hall")
        own = page.get_by_role("region", name="rig rig")
        expect(page.locator("#rig-state")).to_have_text("not driven from here")
        expect(own.locator(".badge")).to_have_text("not driven from here")
        page.get_by_role("button", name="STOP: end the run", exact=True).click()
        expect(page.locator(".stop output")).to_have_text("Stopped. This rig drives no tester.")
        own.get_by_role("button", name="STOP rig").click()
        expect(own.get_by_role("status")).to_have_text(
            re.compile("^STOP at .*: STOP is in force; this rig drives no tester.$")
        )
        expect(page.locator("#stop-in-force")).to_contain_text("STOP is in force: no run begins.")
        assert "at rest" not in page.inner_text("body")
        assert not tab.errors


def test_a_rig_is_stopped_from_the_hall_and_unknown_when_it_does_not_answer(
    running_laboratory: Laboratory, tmp_path: Path, open_tab: Callable[[Service], Tab]
) -> None:
    port, nobody = free_port(), free_port()
    given = configuration(running_laboratory.addresses, tmp_path).replace("stop_port = 0", f"stop_port = {port}")
    hall = f'[[hall]]\nrig = "rig"\nstop_address = "127.0.0.1"\nstop_port = {port}\npage = "http://127.0.0.1:9/"\n'
    hall += f'[[hall]]\nrig = "B2"\nstop_address = "127.0.0.1"\nstop_port = {nobody}\n'
    (tmp_path / "jointlab.toml").write_text(given + hall, encoding="utf-8")
    with serving(tmp_path) as service:
        tab = open_tab(service)
        tab.log_in()
        page = tab.go("/page/hall")
        own, other = page.get_by_role("region", name="rig rig"), page.get_by_role("region", name="rig B2")
        expect(own.locator(".badge")).to_have_text("at rest")
        expect(other.locator(".badge")).to_contain_text("not reachable since the service began")
        assert not grave_faults(page)
        page.set_viewport_size(PHONE)
        page.wait_for_function(f"() => document.documentElement.scrollWidth <= {PHONE['width']}")
        own.get_by_role("button", name="STOP rig").click()
        expect(own.get_by_role("status")).to_contain_text(AT_REST)
        expect(own).to_contain_text("STOP is in force: STOP listener, from 127.0.0.1")
        other.get_by_role("button", name="STOP B2").click()
        expect(other.get_by_role("status")).to_contain_text("STOP FAILED")
        end_drive_process(tmp_path)
        expect(own.locator(".badge")).to_contain_text("not reachable since 20")
        assert not tab.errors


def test_an_interlock_is_named_in_words() -> None:
    state = ReportedState(
        rig="B2",
        phase=Phase.IDLE,
        run_id=None,
        activity="",
        reason=None,
        interlocks=("emergency_stop",),
        tester_silent=None,
        stop=None,
    )
    said = state_text(Seen(HallRig(rig="B2", stop_address="127.0.0.1", stop_port=9), state, "", None))
    assert "tripped: emergency stop" in said
