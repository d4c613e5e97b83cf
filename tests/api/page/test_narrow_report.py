"""The report of a run on a phone, a tablet and a desktop: all of it within the screen, and large enough to read."""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, ViewportSize

from jointlab.identification.pipeline import Identification
from jointlab.report.identification import write_report
from tests.api.page.test_narrow import DESKTOP, FINGER, PHONE, TABLET, box

MOVING = """() => [...document.querySelectorAll('.scroll, .picture, .panels > div')]
    .filter(each => each.scrollWidth > each.clientWidth + 1).map(each => each.innerText.slice(0, 60))"""
SCALES = """() => [...document.querySelectorAll('figure svg')]
    .map(each => each.getBoundingClientRect().width / each.viewBox.baseVal.width)"""
SMALLEST = 1.0  # px a point: the smallest letters of a chart are those of its legend, 9 points
LARGEST = 1.8


@pytest.fixture(scope="module")
def page(identified: Identification, browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    path = Path(tmp_path_factory.mktemp("report"), "report.html")
    write_report(identified, path)
    context = browser.new_context(viewport=PHONE)
    opened = context.new_page()
    opened.goto(path.as_uri())
    yield opened
    context.close()


@pytest.mark.parametrize("size", [PHONE, TABLET, DESKTOP])
def test_nothing_of_a_report_lies_beside_the_screen(size: ViewportSize, page: Page) -> None:
    page.set_viewport_size(size)
    assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
    assert page.evaluate(MOVING) == []


@pytest.mark.parametrize("size", [PHONE, TABLET, DESKTOP])
def test_a_picture_of_a_report_can_be_read(size: ViewportSize, page: Page) -> None:
    page.set_viewport_size(size)
    scales = page.evaluate(SCALES)
    assert min(scales) >= SMALLEST
    assert max(scales) <= LARGEST


def test_cells_of_a_long_row_stand_beside_their_headings_on_a_phone_alone(page: Page) -> None:
    page.set_viewport_size(PHONE)
    cells = page.get_by_role("table", name="Joints by the hammer test").locator("tbody tr").first.locator("td")
    places = [box(each) for each in cells.all()]
    assert len(places) == 4
    assert all(upper["y"] + upper["height"] <= lower["y"] + 1 for upper, lower in pairwise(places))
    heading = "cell => getComputedStyle(cell, '::before').content"
    assert cells.nth(1).evaluate(heading) == '"k"'
    page.set_viewport_size(DESKTOP)
    assert len({box(each)["y"] for each in cells.all()}) == 1
    assert cells.nth(1).evaluate(heading) == "none"


def test_links_of_the_contents_are_as_high_as_a_finger(page: Page) -> None:
    page.set_viewport_size(PHONE)
    assert min(box(link)["height"] for link in page.locator("nav a").all()) >= FINGER
