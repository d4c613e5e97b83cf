"""The page on a phone and on a tablet: nothing beside the screen, nothing below a finger, and no text under another."""

import re
from collections.abc import Iterator
from itertools import pairwise
from urllib.parse import urlencode

import pytest
from playwright.sync_api import Browser, FloatRect, Locator, ViewportSize, expect

from api.page.charts.axes import axis
from simlab.operator_server import OperatorClient
from tests.api.page.axe import grave_faults
from tests.api.page.conftest import PATIENCE
from tests.api.page.technician import Service, Tab

PHONE = ViewportSize(width=390, height=844)
TABLET = ViewportSize(width=768, height=1024)
DESKTOP = ViewportSize(width=1440, height=900)
FINGER = 44  # px
VIEWS = (
    "/page/",
    "/page/measure?investigation={further_run}",
    "/page/measure?sequence=paper&as=text",
    "/page/runs",
    "/page/results?run=1&part=Joints",
    "/page/results?run=1&part=Direct+against+inverse",
    "/page/results?run=1&part=Measured+how",
    "/page/gap?diagnosis={diagnosis}",
    "/page/gap?investigation={reading}",
    "/page/laboratory?part=Keys",
    "/page/alarms",
)
TOO_SMALL = f"""() => [...document.querySelectorAll('button, .act, nav a, td > a:only-child, summary, .q-checkbox')]
    .filter(each => each.offsetParent && each.getBoundingClientRect().height < {FINGER})
    .map(each => each.outerHTML.slice(0, 120))"""
TOO_WIDE = """() => [...document.querySelectorAll('.scroll')]
    .filter(each => each.scrollWidth > each.clientWidth + 1).map(each => each.getAttribute('aria-label'))"""

BOTTOMS = """() => {
    document.body.classList.add('dead');
    const place = name => document.querySelector(name).getBoundingClientRect();
    return { answer: place('.stop output').bottom, dead: place('#dead').top };
}"""


@pytest.fixture(scope="module")
def phone(campaign: Service, browser: Browser) -> Iterator[Tab]:
    """A tab that is logged in to the campaign, on a phone."""
    context = browser.new_context(viewport=PHONE)
    context.set_default_timeout(PATIENCE)
    tab = Tab(context.new_page(), campaign)
    tab.log_in()
    yield tab
    context.close()


def box(place: Locator) -> FloatRect:
    found = place.bounding_box()
    assert found is not None
    return found


def are_apart(one: FloatRect, other: FloatRect) -> bool:
    return (
        one["x"] + one["width"] <= other["x"]
        or other["x"] + other["width"] <= one["x"]
        or one["y"] + one["height"] <= other["y"]
        or other["y"] + other["height"] <= one["y"]
    )


@pytest.mark.parametrize("path", VIEWS)
def test_a_view_fits_a_phone_and_a_finger(path: str, diagnosis: int, waiting: dict[str, int], phone: Tab) -> None:
    page = phone.go(path.format(diagnosis=diagnosis, **waiting))
    page.wait_for_function("() => window.socket?.connected")
    expect(page.get_by_text("…", exact=True)).to_have_count(0)
    page.locator("nav a").first.wait_for()
    page.wait_for_function(f"() => document.documentElement.scrollWidth <= {PHONE['width']}")
    assert not page.evaluate(TOO_WIDE)
    assert not page.evaluate(TOO_SMALL)
    assert box(page.locator(".q-header"))["height"] < PHONE["height"] / 5
    assert not grave_faults(page)


def test_the_link_of_the_present_view_is_in_sight(phone: Tab) -> None:
    page = phone.go("/page/hall")
    expect(page.locator("nav [aria-current]")).to_be_in_viewport(ratio=1)
    phone.go("/page/")
    expect(page.locator("nav [aria-current]")).to_be_in_viewport(ratio=1)


def test_each_cell_of_a_long_row_stands_beside_its_heading_on_a_phone_alone(phone: Tab) -> None:
    page = phone.go("/page/runs")
    cells = page.get_by_role("region", name="Runs, newest first").get_by_role("row").nth(1).get_by_role("cell")
    places = [box(cells.nth(index)) for index in range(3)]
    assert all(upper["y"] + upper["height"] <= lower["y"] + 1 for upper, lower in pairwise(places))
    title = cells.nth(2)
    assert title.evaluate("cell => getComputedStyle(cell, '::before').content") == '"title"'
    page.set_viewport_size(DESKTOP)
    assert box(cells.nth(0))["y"] == box(title)["y"]
    assert title.evaluate("cell => getComputedStyle(cell, '::before').content") == "none"
    page.set_viewport_size(PHONE)


@pytest.mark.parametrize("size", [PHONE, ViewportSize(width=800, height=600), DESKTOP])
def test_the_headline_comes_before_results_and_these_before_what_may_be_done_with_them(
    size: ViewportSize, phone: Tab
) -> None:
    page = phone.page
    page.set_viewport_size(size)
    phone.go("/page/results?run=1&part=Joints")
    places = [
        page.get_by_role("heading", name="In short"),
        page.get_by_role("heading", name="Joints", exact=True),
        page.get_by_role("button", name="Identify"),
    ]
    places[1].wait_for()
    short, found, act = (box(each)["y"] for each in places)
    assert short < found < act
    assert short < size["height"] / 2
    expect(page.get_by_role("region", name="Joint I; tester")).to_be_hidden()  # where a part is asked for
    page.set_viewport_size(PHONE)


def test_a_new_key_can_be_read_on_a_phone(phone: Tab) -> None:
    page = phone.go("/page/laboratory?part=Keys")
    page.get_by_label("Name of the person or program").fill("a visitor with a phone")
    page.get_by_role("button", name="Make the key").click()
    shown = page.locator("#secret")
    shown.evaluate("secret => { secret.textContent = 'x'.repeat(secret.textContent.length); }")  # no hyphen to break at
    secret = box(shown)
    assert secret["x"] + secret["width"] <= PHONE["width"]


def test_charts_of_blows_stand_two_by_two_and_below_each_other_on_a_phone(phone: Tab) -> None:
    page = phone.go("/page/hammer?run=1")
    charts = page.locator(".live-charts figure")
    expect(charts).to_have_count(4)
    charts.last.wait_for()
    for size, columns in ((DESKTOP, 2), (ViewportSize(width=1280, height=800), 2), (TABLET, 2), (PHONE, 1)):
        page.set_viewport_size(size)
        assert len({round(box(each)["x"]) for each in charts.all()}) == columns


def test_neighbouring_ticks_of_a_narrow_axis_differ(phone: Tab) -> None:
    page = phone.go("/page/")
    formatter = axis("k (MN/m)")["axisLabel"][":formatter"]
    assert page.evaluate(f"[1.23144, 1.231445, 0.1 + 0.2].map({formatter})") == ["1.23144", "1.231445", "0.3"]


@pytest.mark.parametrize("size", [PHONE, TABLET])
def test_the_answer_to_stop_lies_on_no_link(size: ViewportSize, tab: Tab) -> None:
    page = tab.go("/page/")
    page.set_viewport_size(size)
    page.locator(".stop button").click()
    answer = page.locator(".stop output")
    expect(answer).to_have_text("Stopped. The actuator is at rest.")
    assert are_apart(box(answer), box(page.locator(".q-header")))
    beside = page.evaluate(BOTTOMS)  # at once: a living page takes the mark away again
    assert beside["answer"] <= beside["dead"]


def test_an_empty_view_has_no_empty_charts_and_says_what_to_do(tab: Tab) -> None:
    for path, text in (("hammer", "No hammer session yet"), ("sweep", "No sweep yet")):
        page = tab.go(f"/page/{path}")
        expect(page.get_by_text(text)).to_be_visible()
        expect(page.locator("figure:visible")).to_have_count(0)


@pytest.mark.parametrize("size", [DESKTOP, ViewportSize(width=800, height=600)])
def test_fields_that_stand_beside_each_other_are_level(size: ViewportSize, tab: Tab) -> None:
    page = tab.page
    page.set_viewport_size(size)
    tab.go("/page/measure")
    fields = page.locator(".cards > .q-field")
    fields.last.wait_for()
    left = [each for each in map(box, fields.all()) if each["y"] < box(fields.first)["y"] + FINGER]
    assert len(left) > 1
    assert len({round(each["y"]) for each in left}) == 1


def test_a_table_of_many_columns_fits_a_small_screen(tab: Tab) -> None:
    page = tab.page
    page.set_viewport_size(ViewportSize(width=800, height=600))
    tab.go("/page/instruments?part=Channels").get_by_text("cDAQ1Mod1/ai1").wait_for()
    assert not page.evaluate(TOO_WIDE)


def test_limits_have_their_units(tab: Tab) -> None:
    page = tab.go("/page/laboratory")
    limits = page.get_by_role("region", name="Limits of the tester")
    expect(limits).to_contain_text("at most 0.300\u202fmm")
    expect(limits).to_contain_text("1.00\u202fHz to 250\u202fHz")
    for row in limits.get_by_role("row").all()[1:]:
        assert re.search(r"\d\u202f\S", row.inner_text())


def test_the_next_point_is_in_sight_and_large_enough_to_read_on_a_phone(tab: Tab) -> None:
    page = tab.page
    page.set_viewport_size(PHONE)
    wanted = {"parts": "hammer", "points": "11y", "blows": "2"}
    tab.go(f"/page/measure?{urlencode(wanted)}").get_by_role("button", name="Start").click()
    expect(page.locator("#prompt")).to_have_text("Take the hammer to 11y")
    point = page.locator('[data-next="true"]')
    expect(point).to_be_in_viewport(ratio=1)
    assert box(point.locator("text").last)["height"] >= 12  # px


def test_what_the_rig_does_begins_as_a_sentence_and_its_badge_stays_beside_stop(
    tab: Tab, bench: OperatorClient
) -> None:
    page = tab.page
    page.set_viewport_size(PHONE)
    wanted = {"parts": "sweep", "specimens": "I", "configurations": "shear", "frequencies": "5 200 0.1"}
    tab.go(f"/page/measure?{urlencode(wanted)}").get_by_role("button", name="Start").click()
    expect(page.locator("#prompt")).to_contain_text("Mount the cylinders")
    bench.do("mount", specimen="I", configuration="shear")
    page.get_by_role("button", name="Done").click()
    expect(page.locator("#prompt")).to_have_text("Measuring the cylinders of joint I in shear …")
    assert box(page.locator("#rig-state"))["y"] < box(page.locator(".stop button"))["y"] + FINGER
