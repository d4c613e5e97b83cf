"""An engineer changes the channel table on the page: it is written to the file, and nobody believes it is in force."""

import re
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from api.page.instruments.channel_form import _fit
from api.page.instruments.channel_table import Tables, in_force
from jointlab.client import Client
from jointlab.report.section import Unknown
from store.catalogue import Catalogue
from store.service.audit import list_audit_entries
from store.service.keys import add_key
from store.states import Scope
from tests.api.page.axe import grave_faults
from tests.api.page.technician import Service, Tab
from tests.channels import ACCELEROMETER, DISPLACEMENT, HAMMER

CHANNELS = "/page/instruments?part=Channels"


@pytest.fixture
def file(rig: Service) -> Iterator[Path]:
    """The configuration file of the service; it is as before after the test, and nothing is beside it."""
    path = rig.folder / "jointlab.toml"
    before = path.read_bytes()
    yield path
    path.write_bytes(before)
    for kept in rig.folder.glob("jointlab.toml.before-*"):
        kept.unlink()


def written(file: Path) -> dict[str, dict[str, Any]]:
    return {row["name"]: row for row in tomllib.loads(file.read_text("utf-8"))["channels"]}


def edit(tab: Tab, name: str) -> Page:
    """Open the form of a channel by its link in the table."""
    page = tab.go(CHANNELS)
    page.get_by_role("link", name=f"Edit {name}").click()
    expect(page.get_by_role("heading", name=f"Channel {name}")).to_be_visible()
    return page


def write(page: Page) -> None:
    page.get_by_role("button", name="Write to jointlab.toml").click()


def test_a_sensitivity_is_written_to_the_file_and_marked_as_not_in_force(tab: Tab, file: Path, rig: Service) -> None:
    before = file.read_text("utf-8")
    page = tab.go(CHANNELS)
    expect(page.get_by_role("region", name="Channels of jointlab.toml, all in force")).to_be_visible()
    expect(page.locator("#not-in-force")).to_have_count(0)
    page = edit(tab, "accelerometer")
    expect(page.get_by_label("Lowest value")).to_have_value("-480 m/s^2")
    expect(page.get_by_label("IEPE supply")).to_have_value("2")
    expect(page.get_by_label("Supply of the bridge")).to_be_hidden()
    assert not grave_faults(page)
    page.get_by_label("Sensitivity, such as").fill("98.7 mV/g")
    page.get_by_label("Valid until").fill("2027-03-02")
    write(page)
    expect(page.locator("#written")).to_contain_text(
        "in force when the drive process and the service are started again"
    )
    expect(page.get_by_text("Its range fits its input")).to_be_visible()
    after = file.read_text("utf-8")
    assert written(file)["accelerometer"]["sensitivity"] == "98.7 mV/g"
    changed = set(after.splitlines()) ^ set(before.splitlines())
    assert {line.partition(" = ")[0] for line in changed} == {"sensitivity", "due_on"}
    (kept,) = rig.folder.glob("jointlab.toml.before-*")
    assert kept.read_text("utf-8") == before

    page.get_by_role("link", name="Back to the channels").click()
    expect(page.locator("#not-in-force")).to_contain_text("Runs are measured with the former values")
    row = page.get_by_role("region", name="Channels of jointlab.toml").get_by_role("row").filter(has_text="Mod1/ai1")
    expect(row).to_contain_text("98.7 mV/g")
    expect(row).to_contain_text("measured with another sensitivity, last valid day")
    page.get_by_text("Channels in force now").click()
    now = page.get_by_role("region", name="Channels in force").get_by_role("row").filter(has_text="Mod1/ai1")
    expect(now.last).to_contain_text("100 mV/g")
    assert not grave_faults(page)
    with Catalogue.open(rig.database) as catalogue:
        entry = catalogue.read(list_audit_entries, action="change channel", limit=1)[0]
    assert (entry.who, entry.target, entry.outcome) == ("key 1 (technician)", "channel accelerometer", "done")
    assert entry.details["before"]["sensitivity"] == pytest.approx(10.2e-3)
    assert entry.details["after"]["sensitivity"] == "98.7 mV/g"


def test_a_wrong_value_is_told_at_its_field_and_nothing_is_written(tab: Tab, file: Path) -> None:
    before = file.read_bytes()
    page = edit(tab, "displacement")
    expect(page.get_by_label("Highest value")).to_have_value("5 mm")
    expect(page.get_by_label("IEPE supply")).to_be_hidden()
    page.get_by_label("Highest value").fill("-6 mm")
    page.get_by_label("Noise at rest").fill("0.00003")
    write(page)
    expect(page.get_by_text("write it with its unit, such as -5 mm")).to_be_visible()
    page.get_by_label("Noise at rest").fill("0.00003 mm")
    write(page)
    expect(page.get_by_text("has to be more than the lowest value, -5 mm")).to_be_visible()
    page.get_by_label("Highest value").fill("5 mm")
    write(page)
    expect(page.get_by_role("alert").filter(has_text="nothing was changed")).to_be_visible()
    assert file.read_bytes() == before


def test_a_range_that_the_input_does_not_take_is_written_only_where_a_person_wants_it(tab: Tab, file: Path) -> None:
    before = file.read_bytes()
    page = edit(tab, "displacement")
    page.get_by_label("Highest value").fill("6 mm")
    write(page)
    refused = page.get_by_role("alert").filter(has_text="The acquisition device refuses it")
    expect(refused).to_contain_text("AI.Max")
    assert file.read_bytes() == before
    page.get_by_role("checkbox", name="Write it all the same").click()
    page.get_by_label("Highest value").fill("7 mm")
    write(page)
    expect(page.get_by_role("checkbox", name="Write it all the same")).not_to_be_checked()  # that was for 6 mm
    page.get_by_role("checkbox", name="Write it all the same").click()
    write(page)
    expect(page.locator("#written")).to_be_visible()
    assert written(file)["displacement"]["maximum"] == 0.007


def test_a_channel_is_added_with_its_bridge_and_removed_when_it_was_asked_for_twice(tab: Tab, file: Path) -> None:
    before = file.read_text("utf-8")
    page = tab.go(CHANNELS)
    page.get_by_role("link", name="Add a channel").click()
    page.get_by_label("Name, such as").fill("load_cell")
    page.get_by_label("Input, such as").fill("cDAQ1Mod3/ai0")
    page.locator("select[name=kind]").select_option("force_bridge")
    page.get_by_label("Sensitivity, such as").fill("0.4 mV/V/kN")
    page.get_by_label("Lowest value").fill("-5 kN")
    page.get_by_label("Highest value").fill("5 kN")
    write(page)
    expect(page.get_by_text("is missing")).to_be_visible()
    page.get_by_label("Supply of the bridge").fill("5")
    write(page)
    expect(page.get_by_text("Its range fits its input, which takes -62.5")).to_be_visible()
    assert written(file)["load_cell"] == {
        "name": "load_cell", "physical": "cDAQ1Mod3/ai0", "kind": "force_bridge", "unit": "N", "minimum": -5000.0,
        "sensitivity": "0.4 mV/V/kN", "maximum": 5000.0, "bridge": {"excitation": 5.0},
    }  # fmt: skip
    page = tab.go(CHANNELS)
    expect(page.get_by_role("row").filter(has_text="load_cell")).to_contain_text("it is new")
    page = edit(tab, "load_cell")
    page.get_by_role("button", name="Remove this channel").click()
    page.get_by_role("button", name="Keep it").click()
    page.get_by_role("button", name="Remove this channel").click()
    page.get_by_role("button", name="Yes, remove it").click()
    expect(page.locator("#written")).to_contain_text("load_cell is removed from jointlab.toml")
    assert file.read_text("utf-8") == before
    page = edit(tab, "hammer")
    page.get_by_role("button", name="Remove this channel").click()
    page.get_by_role("button", name="Yes, remove it").click()
    expect(page.locator("#written")).to_be_visible()
    page = tab.go(CHANNELS)
    expect(page.get_by_role("row").filter(has_text="it is not in jointlab.toml any more")).to_contain_text("hammer")


def test_a_file_that_was_changed_meanwhile_is_not_written_over(tab: Tab, file: Path) -> None:
    page = edit(tab, "hammer")
    by_hand = file.read_text("utf-8") + "# by hand\n"
    file.write_text(by_hand, encoding="utf-8")
    page.get_by_label("Certificate").fill("K-18")
    write(page)
    expect(page.get_by_role("alert").filter(has_text="has been changed since it was read")).to_be_visible()
    assert file.read_text("utf-8") == by_hand


def test_a_file_that_is_not_valid_is_told_and_what_is_in_force_is_shown(tab: Tab, file: Path) -> None:
    file.write_text(file.read_text("utf-8").replace('"force_iepe"', '"force"'), encoding="utf-8")
    page = tab.go(CHANNELS)
    expect(page.get_by_role("alert").filter(has_text="channels.0.kind")).to_be_visible()
    expect(page.get_by_role("region", name="Channels in force")).to_contain_text("cDAQ1Mod1/ai1")
    expect(page.get_by_role("link", name=re.compile("^Edit"))).to_have_count(0)


def test_the_range_is_not_checked_while_another_client_drives_and_that_is_told(
    tab: Tab, file: Path, rig: Service
) -> None:
    page = edit(tab, "hammer")
    page.get_by_label("Certificate").fill("K-18")
    with Client(rig.address, rig.key) as lab, lab.driving("another program", by_force=True):
        write(page)
        expect(page.locator("#written")).to_be_visible()
        expect(page.get_by_text("Its range was not checked")).to_contain_text("another program")
    assert written(file)["hammer"]["certificate"] == "K-18"


def test_a_change_is_in_force_when_service_and_drive_process_were_started_again(
    tab: Tab, file: Path, rig: Service
) -> None:
    before = file.read_bytes()
    page = edit(tab, "accelerometer")
    page.get_by_label("Sensitivity, such as").fill("98.7 mV/g")
    write(page)
    expect(page.locator("#written")).to_be_visible()
    rig.stop()
    rig.start()  # with its drive process
    expect(page.get_by_label("Sensitivity, such as")).to_have_value("98.7 mV/g")  # the page has loaded itself again
    page.get_by_role("link", name="Back to the channels").click()
    row = page.get_by_role("row").filter(has_text="cDAQ1Mod1/ai1")
    expect(row).to_contain_text("98.7 mV/g")
    expect(page.get_by_role("region", name="all in force")).to_be_visible()
    expect(page.locator("#not-in-force")).to_have_count(0)
    file.write_bytes(before)
    rig.stop()
    rig.start()


def test_a_key_without_the_scope_has_no_way_to_change_a_channel(
    rig: Service, open_tab: Callable[[Service], Tab], file: Path
) -> None:
    with Catalogue.open(rig.database) as catalogue, catalogue.writing() as session:
        key = add_key(session, "operator", {Scope.READ, Scope.CONTROL})[1]
    visitor = open_tab(Service(rig.folder, rig.port, key))
    visitor.log_in()
    page = visitor.go(CHANNELS)
    expect(page.get_by_text("Only a key with the scope engineer changes the table.")).to_be_visible()
    expect(page.get_by_role("region", name="all in force")).to_contain_text("cDAQ1Mod1/ai1")
    expect(page.get_by_role("link", name=re.compile("^(Edit|Add)"))).to_have_count(0)
    page = visitor.go(f"{CHANNELS}&channel=hammer")
    expect(page.get_by_text("Only a key with the scope engineer changes the table.")).to_be_visible()
    expect(page.get_by_role("button", name="Write to jointlab.toml")).to_have_count(0)


def test_a_file_that_cannot_be_replaced_is_told_in_place_of_the_form(tab: Tab, file: Path) -> None:
    moved = file.rename(file.with_name("away.toml"))
    page = tab.go(f"{CHANNELS}&channel=hammer")
    expect(page.get_by_role("alert").filter(has_text="does not exist; write it first")).to_be_visible()
    expect(page.get_by_role("button", name="Write to")).to_have_count(0)
    page = tab.go(CHANNELS)
    expect(page.get_by_role("alert").filter(has_text="cannot be read: No such file")).to_be_visible()
    expect(page.get_by_role("region", name="Channels in force")).to_contain_text("cDAQ1Mod1/ai1")
    moved.rename(file)


def test_a_channel_that_is_not_there_is_told(tab: Tab) -> None:
    page = tab.go(f"{CHANNELS}&channel=brake")
    expect(page.get_by_role("alert").filter(has_text="has no channel brake any more")).to_be_visible()


def test_what_is_in_force_is_told_by_each_process() -> None:
    new = replace(HAMMER, sensitivity=2.3e-3, certificate="K-18")
    others = (ACCELEROMETER, DISPLACEMENT)
    every = (HAMMER, *others)
    assert in_force(HAMMER, Tables(every, every, every)) == "yes"
    assert Tables(every, every[::-1], every).are_one
    started_again = Tables((new, *others), every, (new, *others))
    assert not started_again.are_one
    assert in_force(new, started_again) == Unknown("no", "the drive process has another sensitivity, certificate")
    assert in_force(new, Tables((new,), (new,), others)) == Unknown("no", "the service does not know it")
    assert in_force(new, Tables((new,), (), ())) == Unknown("no", "it is new")


def test_a_range_beyond_that_of_the_input_does_not_fit() -> None:
    assert _fit(HAMMER, -2000.0, 2000.0).fits
    found = _fit(DISPLACEMENT, -4e-3, 5e-3)
    assert (found.fits, "takes -4.00\u202fmm … 5.00\u202fmm only" in found.text) == (False, True)
