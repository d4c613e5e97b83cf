"""A technician examines the rig on the page, and sees what is known of its instruments."""

from collections.abc import Callable
from dataclasses import replace

import pytest
from playwright.sync_api import expect

from api.page.instruments.channel_table import kind_words
from api.page.instruments.channels import bias_text, range_text
from jointlab.client import Client
from rig.checks.live import LiveLevel
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from simlab.tester_server import TesterFault
from store.catalogue import Catalogue
from store.service.keys import add_key
from store.states import Scope
from tests.api.page.axe import grave_faults
from tests.api.page.technician import Service, Tab
from tests.api.page.test_driving import LONG_SWEEP, asked, start
from tests.channels import CHARGE_HAMMER, HAMMER, LOAD_CELL

NEVER = "This rig was never examined."


def test_an_examination_is_begun_followed_and_signed_on_the_page(tab: Tab) -> None:
    page = tab.go("/page/measure")
    expect(page.get_by_text(NEVER)).to_be_visible()
    page.get_by_role("link", name="Examine the rig").click()
    expect(page.get_by_text(NEVER)).to_be_visible()
    row = page.get_by_role("row").filter(has_text="Acquisition")
    expect(row).to_contain_text("only an examination and a run ask it")
    page.get_by_role("checkbox", name="Trip watchdog and emergency stop").click()
    page.get_by_role("button", name="Examine, and sign as key 1").click()
    expect(page.locator("#rig-state")).to_have_text("being examined")
    expect(page.locator("#examining")).to_contain_text("with hydraulics on")
    expect(page.get_by_role("button", name="Examine, and sign as key 1")).to_be_disabled()
    expect(page.locator("#verdict")).to_have_text("Every check passed.")
    expect(page.get_by_text("signed by key 1 (technician)")).to_be_visible()
    expect(page.locator("#rig-state")).to_have_text("at rest")
    expect(page.get_by_text(NEVER)).to_be_hidden()
    expect(row).to_contain_text("NI 9234")
    expect(page.get_by_role("row").filter(has_text="Tester").first).to_contain_text("register map 2")
    assert not grave_faults(page)
    tab.go("/page/measure").get_by_role("button", name="Start").wait_for()
    expect(page.get_by_text(NEVER)).to_have_count(0)


def test_what_failed_says_what_to_do_and_stays_in_the_history(tab: Tab, laboratory: Laboratory) -> None:
    laboratory.daq.faults.set("hum", "cDAQ1Mod1/ai0")
    page = tab.go("/page/instruments")
    page.get_by_role("button", name="Examine, and sign as key 1").click()
    expect(page.locator("#verdict")).to_have_text("The rig is not in order.")
    expect(page.locator(".trouble").filter(has_text="hammer, mains hum")).to_contain_text("look for a ground loop")
    laboratory.daq.faults.clear()
    page.get_by_role("button", name="Examine, and sign as key 1").click()
    expect(page.locator("#verdict")).to_have_text("No check failed, some were not done.")
    undone = page.get_by_role("region", name="Not done")
    expect(undone).to_contain_text("tick “Trip watchdog and emergency stop, too” and examine again")
    expect(undone).not_to_contain_text("--trip")
    page.get_by_role("row").filter(has_text="the rig is not in order").get_by_role("link").first.click()
    expect(page.locator("#verdict")).to_have_text("The rig is not in order.")


def test_the_rig_is_not_examined_beside_a_run_and_says_why(tab: Tab, bench: OperatorClient) -> None:
    page = start(tab, LONG_SWEEP)
    asked(page, "Mount the cylinders of joint I in shear, and step back")
    page.get_by_role("link", name="Instruments", exact=True).click()
    expect(page.get_by_text("is in progress. Wait until it has ended, then try again.")).to_be_visible()
    expect(page.get_by_role("button", name="Examine, and sign as key 1")).to_be_disabled()


def test_a_mass_that_cannot_be_is_refused_in_words(tab: Tab) -> None:
    page = tab.go("/page/instruments")
    page.get_by_label("Where the sensors are").select_option("mass")
    page.get_by_label("Mass with the accelerometer on it, kg").fill("-1")
    page.get_by_role("button", name="Examine, and sign as key 1").click()
    expect(page.get_by_role("alert").filter(has_text="mass: is -1")).to_be_visible()


def test_a_tester_that_does_not_answer_is_told_beside_the_others(tab: Tab, laboratory: Laboratory) -> None:
    page = tab.go("/page/instruments")
    row = page.get_by_role("row").filter(has_text="Tester").first
    expect(row).to_contain_text("answers")
    laboratory.tester.faults.set(TesterFault.SILENT)
    expect(row).to_contain_text("does not answer")
    laboratory.tester.faults.clear()
    expect(row).not_to_contain_text("does not answer")


def test_a_key_that_may_not_drive_sees_examinations_and_begins_none(
    rig: Service, open_tab: Callable[[Service], Tab]
) -> None:
    with Catalogue.open(rig.database) as catalogue, catalogue.writing() as session:
        key = add_key(session, "reader", {Scope.READ})[1]
    visitor = open_tab(Service(rig.folder, rig.port, key))
    visitor.log_in()
    page = visitor.go("/page/instruments")
    expect(page.get_by_text("Only a key with the scope control:rig examines the rig.")).to_be_visible()
    expect(page.get_by_role("button", name="Examine")).to_have_count(0)


def test_a_channel_is_shown_live_with_its_overload_until_one_looks_no_more(tab: Tab, laboratory: Laboratory) -> None:
    page = tab.go("/page/instruments?part=Channels")
    expect(page.get_by_role("row").filter(has_text="cDAQ1Mod1/ai1")).to_contain_text("100 mV/g")
    page.get_by_role("button", name="Look at the channels").click()
    row = page.locator("#levels").get_by_role("row").filter(has_text="accelerometer")
    expect(row).to_contain_text("coupled off by the module")
    expect(row).to_contain_text("none")
    expect(page.get_by_role("img", name="Mean spectrum of the last 10 blocks").locator("canvas").first).to_be_visible()
    before = row.inner_text()
    expect(row).not_to_have_text(before, use_inner_text=True)  # it goes on
    laboratory.daq.faults.set("cable_open", "cDAQ1Mod1/ai1")
    expect(page.get_by_text("Overload: accelerometer")).to_be_visible()
    laboratory.daq.faults.clear()
    expect(row).to_contain_text("was overloaded")
    page.locator("select[name=channel]").select_option("force")
    expect(page.locator("#levels")).to_contain_text("displacement")
    page.get_by_role("button", name="Stop looking").click()
    expect(page.locator("#levels")).to_have_count(0)
    assert not grave_faults(page)


def test_a_live_channel_has_no_grave_fault(tab: Tab) -> None:
    page = tab.go("/page/instruments?part=Channels")
    page.get_by_role("button", name="Look at the channels").click()
    expect(page.locator("#levels")).to_be_visible()
    # nothing is done after it: a page that is examined is busy for seconds, and may be given up by the service
    assert not grave_faults(page)


def test_a_look_at_a_channel_ends_where_another_client_drives(tab: Tab, rig: Service) -> None:
    page = tab.go("/page/instruments?part=Channels")
    page.get_by_role("button", name="Look at the channels").click()
    expect(page.locator("#levels")).to_be_visible()
    with Client(rig.address, rig.key) as lab, lab.driving("another program", by_force=True):
        expect(page.get_by_role("alert").filter(has_text="another client has taken")).to_be_visible()
        expect(page.get_by_role("button", name="Look at the channels")).to_be_visible()
        expect(page.locator("#levels")).to_have_count(0)


LEVEL = LiveLevel("hammer", 0.0, 0.02, -0.1, 0.1, 11.0, True, -1800.0, 1800.0, overloaded=False)


@pytest.mark.parametrize(
    ("dc_coupled", "said"), [(True, "11.0\u202fV"), (False, "coupled off by the module"), (None, "does not say")]
)
def test_a_bias_voltage_is_told_where_the_input_lets_it_pass(dc_coupled: bool | None, said: str) -> None:
    assert said in bias_text(replace(LEVEL, dc_coupled=dc_coupled), HAMMER)


def test_a_bridge_has_a_supply_and_no_bias() -> None:
    assert bias_text(LEVEL, LOAD_CELL) == "bridge, fed with 5.00\u202fV"
    assert bias_text(LEVEL, CHARGE_HAMMER) == "no IEPE supply"


def test_a_range_beyond_that_of_the_input_is_told() -> None:
    assert "the range asked for is beyond it" in range_text(LEVEL, HAMMER)
    assert "beyond" not in range_text(LEVEL, replace(HAMMER, minimum=-1800, maximum=1800))


def test_a_kind_of_instrument_is_told_in_words() -> None:
    assert [kind_words(each) for each in ("force_iepe", "acceleration_charge", "thermometer")] == [
        "force, IEPE", "acceleration, charge", "thermometer",
    ]  # fmt: skip
