"""Pictures of the page for README and manual: a hammer session and a sweep on the simulated bench, then a campaign.

    python -m tests.bench.page_pictures FOLDER CAMPAIGN

CAMPAIGN is the folder that `jointlab demo` wrote. Pictures go to FOLDER.
"""

import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlencode

from playwright.sync_api import Browser, Page, ViewportSize, expect, sync_playwright

from jointlab.diagnosis.pipeline import diagnose_bundle
from jointlab.diagnosis.save import save_diagnosis
from simlab.case.bundle import write_case
from simlab.case.draw import CaseKind, draw_case
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from simlab.ordinary import BenchConditions
from store.catalogue import Catalogue
from tests.api.conftest import configuration
from tests.api.page.technician import Service, Tab, serving

SPEED = 20.0
SIZE = ViewportSize(width=1000, height=760)
TALL = ViewportSize(width=1000, height=1480)
TABLET = ViewportSize(width=800, height=1100)


def main(folder: Path, campaign: Path) -> None:
    """Take all pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    expect.set_options(timeout=60_000)
    program = next(found for name in ("chromium", "chromium-browser") if (found := shutil.which(name)))
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as scratch:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        _session(browser, folder, Path(scratch))
        _campaign(browser, folder, campaign, Path(scratch) / "campaign")
        browser.close()


def _session(browser: Browser, folder: Path, scratch: Path) -> None:
    """What is live: a hammer session with a refused blow, a sweep, an interlock."""
    with Laboratory(1, SPEED, BenchConditions(double_hits=0.0)) as laboratory:
        (scratch / "jointlab.toml").write_text(configuration(laboratory.addresses, scratch), encoding="utf-8")
        hand = OperatorClient(laboratory.addresses.operator)
        with serving(scratch) as service, _tab(browser, service, SIZE) as tab:
            page = tab.go("/page/")
            _take(page, folder, "log-in")
            page = tab.log_in()
            page.get_by_text("There are none.").wait_for()
            _take(page, folder, "dashboard-empty")
            _hammer(tab, folder, hand)
            _sweep(tab, folder, hand)
            laboratory.tester.emergency_stop()
            page = tab.go("/page/")
            page.get_by_role("button", name="I have removed the cause").wait_for()
            _take(page, folder, "interlock")
            laboratory.tester.release_emergency_stop()
        hand.close()


def _hammer(tab: Tab, folder: Path, hand: OperatorClient) -> None:
    wanted = {"parts": "hammer", "blows": "4", "title": "Beam 3 after new cylinders"}
    page = tab.go(f"/page/measure?{urlencode(wanted)}")
    page.get_by_role("button", name="Start").wait_for()
    _take(page, folder, "measure")
    page.get_by_role("button", name="Start").click()
    for point, kinds in (("1y", ("clean",) * 4), ("3y", ("clean", "clean", "double"))):
        expect(page.locator("#prompt")).to_have_text(f"Take the hammer to {point}")
        page.get_by_role("button", name="Done").click()
        for blow, kind in enumerate(kinds, start=1):
            expect(page.locator("#prompt")).to_have_text(f"Strike {point} (blow {blow})")
            hand.do("strike", node=int(point[0]), direction="y", what=kind)
    expect(page.locator("#verdict")).to_contain_text("refused")
    page.wait_for_timeout(1000)
    page.set_viewport_size(TABLET)
    _take(page, folder, "hammer-tablet")
    page.set_viewport_size(SIZE)
    _take(page, folder, "hammer", full=True)
    page.get_by_role("button", name="STOP").click()
    expect(page.locator("#prompt")).to_contain_text("is stopped")
    page.get_by_role("button", name="I have looked: reset STOP").click()
    expect(page.get_by_role("button", name="I have looked: reset STOP")).to_have_count(0)


def _sweep(tab: Tab, folder: Path, hand: OperatorClient) -> None:
    wanted = {"parts": "sweep", "configurations": "shear", "specimens": "I", "frequencies": "5 200 5"}
    page = tab.go(f"/page/measure?{urlencode(wanted)}")
    page.get_by_role("button", name="Start").click()
    expect(page.locator("#prompt")).to_contain_text("Mount")
    hand.do("mount", specimen="I", configuration="shear")
    page.get_by_role("button", name="Done").click()
    expect(page.get_by_role("img", name="Stiffness k")).to_be_visible()
    page.wait_for_function("() => /^[3-9]\\d of/.test(document.querySelector('#count')?.textContent ?? '')")
    page.keyboard.press("p")
    expect(page.locator("#prompt")).to_contain_text("Paused")
    page.wait_for_timeout(1000)
    _take(page, folder, "sweep", full=True)
    page.get_by_role("button", name="Resume").click()
    page.get_by_role("link", name="Dashboard").click()
    page.locator("#time-left").wait_for()
    _take(page, folder, "dashboard")


def _campaign(browser: Browser, folder: Path, campaign: Path, copy: Path) -> None:
    """What came of a whole campaign."""
    shutil.copytree(campaign, copy)
    (copy / "jointlab.toml").write_text("", encoding="utf-8")
    with Catalogue.open(f"sqlite:///{copy / 'jointlab.db'}") as catalogue:
        diagnosis = _diagnosis(catalogue, run_id=1)
    with serving(copy) as service, _tab(browser, service, SIZE) as tab:
        tab.log_in()
        for name, part in (
            ("modes", "Modes"),
            ("accelerances", "Accelerances"),
            ("joints", "Joints"),
            ("tester", "Tester"),
            ("comparison", "Direct against inverse"),
        ):
            page = tab.go(f"/page/results?{urlencode({'run': 1, 'part': part})}")
            page.get_by_text("Where is this from?").first.wait_for()
            page.set_viewport_size(SIZE if name == "modes" else TALL)
            page.wait_for_timeout(1500)
            _take(page, folder, name, full=name == "modes")
        page = tab.go(f"/page/gap?diagnosis={diagnosis}")
        page.set_viewport_size(TALL)
        page.wait_for_timeout(1500)
        _take(page, folder, "gap")
        page.get_by_role("link", name="Open the sequence for it").click()
        page.set_viewport_size(SIZE)
        page.locator("#steps").wait_for()
        _take(page, folder, "next-experiment")
        for name in ("runs", "laboratory"):
            page = tab.go(f"/page/{name}")
            page.wait_for_timeout(800)
            _take(page, folder, name)


def _diagnosis(catalogue: Catalogue, run_id: int) -> int:
    """That of a simulated bench with a mass at its joints, kept with a run; its number."""
    with tempfile.TemporaryDirectory() as bundle:
        write_case(draw_case(5, CaseKind.SINGLE, ["joint_mass"], size=0.6), Path(bundle))
        document = diagnose_bundle(Path(bundle)).document
    with catalogue.writing() as session:
        return save_diagnosis(session, run_id, document)


@contextmanager
def _tab(browser: Browser, service: Service, size: ViewportSize) -> Iterator[Tab]:
    context = browser.new_context(viewport=size)
    context.set_default_timeout(120_000)
    yield Tab(context.new_page(), service)
    context.close()


def _take(page: Page, folder: Path, name: str, *, full: bool = False) -> None:
    page.screenshot(path=folder / f"{name}.png", full_page=full)
    print(name, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
