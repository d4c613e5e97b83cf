"""Alarms on the page: every view says that one stands, until somebody acknowledges it."""

from collections.abc import Callable

from playwright.sync_api import expect

from jointlab.client import Client
from tests.api.page.axe import grave_faults
from tests.api.page.technician import Service, Tab


def test_every_view_says_that_an_alarm_stands_until_it_is_acknowledged(
    campaign: Service, open_tab: Callable[[Service], Tab]
) -> None:
    tab = open_tab(campaign)
    page = tab.log_in()
    banner = page.locator("#alarms-standing")
    expect(banner).to_have_count(0)
    with Client(campaign.address, campaign.key) as lab:
        alarm = lab.test_alarms()
        expect(banner).to_contain_text("An alarm is active: this is a test")  # without that the view is opened again
        second = lab.test_alarms()
        lab.acknowledge_alarm(second.id)
    tab.go("/page/runs")
    assert not grave_faults(page)
    banner.get_by_role("link", name="See it").click()
    page.get_by_role("heading", name="Alarms").wait_for()
    expect(page.get_by_text("Nobody was notified by a message.")).to_be_visible()
    assert not grave_faults(page)
    page.get_by_label("Note: what you have seen or done").fill("<b>it works</b>")
    page.get_by_role("button", name=f"Acknowledge alarm {alarm.id}").click()
    expect(page.get_by_text("No alarm is active.")).to_be_visible()
    expect(banner).to_have_count(0)
    expect(page.get_by_role("row").filter(has_text="<b>it works</b>")).to_be_visible()
    assert not grave_faults(page)
    assert not tab.errors
