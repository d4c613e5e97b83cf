"""What is seen while something is measured: pulse, spectrum and coherence at one sight, and the loop."""

import re
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import pairwise
from urllib.parse import urlencode

import pytest
from playwright.sync_api import Page, ViewportSize, expect

from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from simlab.ordinary import BenchConditions
from tests.api.page.technician import Service, Tab
from tests.waiting import until

LARGE, SMALL = ViewportSize(width=1280, height=800), ViewportSize(width=800, height=600)
CAPTIONS = ("Force of the last blow", "Spectrum", "Accelerance so far", "Coherence so far")
SWEEP_CAPTIONS = ("Stiffness k", "Loss factor", "Signals of the latest point", "Amplitude reached")
IN_SIGHT = """figure => {
    const box = figure.querySelector('.chart').getBoundingClientRect();
    const header = document.querySelector('.q-header').getBoundingClientRect();
    return scrollY === 0 && box.height > 100 && box.top >= header.bottom && box.bottom <= innerHeight;
}"""

TICKS = """async figure => {
    const { echarts } = await import("nicegui-echart");
    const model = echarts.getInstanceByDom(figure.querySelector('.chart')).getModel();
    const places = ({ axis }) => axis.getTicksCoords().map(({ coord }) => coord);
    return model.queryComponents({ mainType: "yAxis" }).map(places);
}"""
LABEL_HEIGHT = 10  # px, of a figure of 13 px


@pytest.fixture(scope="module")
def running_laboratory() -> Iterator[Laboratory]:
    """In place of the one that is ten times as fast, whose sweeps would end before they are looked at."""
    with Laboratory(3, 20.0, BenchConditions(double_hits=0.0)) as laboratory:
        yield laboratory


def strike(page: Page, bench: OperatorClient, blow: int, what: str = "clean") -> None:
    expect(page.locator("#prompt")).to_have_text(f"Strike 1y (blow {blow})")
    bench.do("strike", node=1, direction="y", what=what)


def are_in_sight(page: Page) -> None:
    """Wait until all charts of a blow are drawn within the window, the coherence under its accelerance."""
    for caption in CAPTIONS:
        figure = page.locator("figure", has_text=caption)
        expect(figure.locator("canvas").first).to_be_visible()
        page.wait_for_function(IN_SIGHT, arg=figure.element_handle())
    upper, lower = (page.locator("figure", has_text=caption).bounding_box() for caption in CAPTIONS[2:])
    assert upper is not None
    assert lower is not None
    assert upper["x"] == lower["x"]
    assert upper["y"] + upper["height"] <= lower["y"]


def labels_are_apart(page: Page, captions: Sequence[str]) -> bool:
    """Whether no label of a vertical axis lies on its neighbour, and each axis has two at least."""
    figures = [page.locator("figure", has_text=caption).element_handle() for caption in captions]
    places = [sorted(axis) for figure in figures for axis in page.evaluate(TICKS, figure)]
    return all(len(each) > 1 and min(b - a for a, b in pairwise(each)) >= LABEL_HEIGHT for each in places)


def test_pulse_spectrum_and_coherence_are_seen_without_scrolling_while_somebody_strikes(
    tab: Tab, bench: OperatorClient, rig: Service
) -> None:
    page = tab.page
    page.set_viewport_size(LARGE)
    wanted = {"parts": "hammer", "points": "1y", "blows": "4", "title": "One point"}
    tab.go(f"/page/measure?{urlencode(wanted)}").get_by_role("button", name="Start").click()
    expect(page.locator("#prompt")).to_have_text("Take the hammer to 1y")
    page.get_by_role("button", name="Done").click()
    strike(page, bench, 1)
    strike(page, bench, 2)
    expect(page.locator("#count")).to_contain_text("2 of 4 blows accepted")
    expect(
        page.locator("figcaption", has_text=re.compile(r"^Force of the last blow: 0\.\d{3}\u202fms$"))
    ).to_be_visible()
    reach = re.compile(r"^Spectrum: 20 dB down at \d\u202f\d{3}\u202fHz$")
    expect(page.locator("figcaption", has_text=reach)).to_be_visible()
    for size in (LARGE, SMALL):
        page.set_viewport_size(size)
        are_in_sight(page)
        until(partial(labels_are_apart, page, CAPTIONS))
        assert page.locator(".stop button").bounding_box() is not None
    strike(page, bench, 3, "double")  # at the smaller size, with the longest of the usual reasons
    expect(page.locator("#verdict")).to_contain_text("refused: double hit")
    are_in_sight(page)


def test_the_loop_of_the_latest_point_is_seen_in_a_sweep(tab: Tab, bench: OperatorClient) -> None:
    page = tab.page
    page.set_viewport_size(LARGE)
    wanted = {
        "parts": "sweep", "specimens": "I", "configurations": "shear", "amplitudes": "0.1", "frequencies": "5 200 0.1",
    }  # fmt: skip
    tab.go(f"/page/measure?{urlencode(wanted)}").get_by_role("button", name="Start").click()
    expect(page.locator("#prompt")).to_contain_text("Mount the cylinders")
    bench.do("mount", specimen="I", configuration="shear")
    page.get_by_role("button", name="Done").click()
    caption = page.locator(
        "figcaption", has_text=re.compile(r"^Force over displacement: \d+\.?\d*\u202f[mµ]J a cycle$")
    )
    expect(caption).to_be_visible()
    page.wait_for_function(IN_SIGHT, arg=page.locator("figure", has=caption).element_handle())
    for size in (LARGE, SMALL):
        page.set_viewport_size(size)
        until(partial(labels_are_apart, page, SWEEP_CAPTIONS))
