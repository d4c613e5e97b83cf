"""The hall on the page: each rig's own state, its STOP, and nothing of a machine that does not answer."""

from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import expect

from simlab.laboratory import Laboratory
from tests.api.conftest import configuration
from tests.api.page.axe import grave_faults
from tests.api.page.technician import Service, Tab, serving
from tests.drive_holder import end_drive_process
from tests.ports import free_port


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
        own.get_by_role("button", name="STOP rig").click()
        expect(own.get_by_role("status")).to_contain_text("Brought to rest at")
        expect(own).to_contain_text("STOP is in force: STOP listener, from 127.0.0.1")
        other.get_by_role("button", name="STOP B2").click()
        expect(other.get_by_role("status")).to_contain_text("STOP FAILED")
        end_drive_process(tmp_path)
        expect(own.locator(".badge")).to_contain_text("not reachable since 20")
        assert not tab.errors
