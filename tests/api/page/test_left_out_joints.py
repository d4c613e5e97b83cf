"""The page tells why the newest identification of a run has no joints, in place of older ones."""

from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import expect

from store.catalogue import Catalogue
from tests.api.page.technician import Service, Tab, serving
from tests.jointlab.identification.left_out import REASON, identified_then_left_out


def test_the_reason_takes_the_place_of_joints_and_modes(
    catalogue: Catalogue, tmp_path: Path, open_tab: Callable[[Service], Tab]
) -> None:
    (tmp_path / "jointlab.toml").write_text("", encoding="utf-8")
    run, _ = identified_then_left_out(catalogue, tmp_path / "bundle")
    with serving(tmp_path, database=f"sqlite:///{tmp_path / 'lab.db'}") as service:
        tab = open_tab(service)
        tab.log_in()
        for part in ("Modes", "Joints", "Direct against inverse"):
            page = tab.go(f"/page/results?run={run}&part={part}")
            expect(page.get_by_text(f"No joints from the hammer: {REASON}.")).to_be_visible()
            expect(page.get_by_role("region", name="k of joint")).to_have_count(0)
        page = tab.go(f"/page/results?run={run}&part=Accelerances")
        expect(page.get_by_text("Set 1, 10 blows a point")).to_be_visible()
