"""What axe-core, which finds faults that keep people from using a page, says of one."""

import sys
from pathlib import Path

import pytest
from playwright.sync_api import Page

AXE = Path(sys.prefix) / "axe/node_modules/axe-core/axe.min.js"
GRAVE = ("serious", "critical")


def grave_faults(page: Page) -> list[str]:
    """Serious and critical faults of what is shown now, with the elements that have them."""
    if not AXE.is_file():
        pytest.skip("axe-core is not here: make test installs it where npm is, or can be had")
    if not page.evaluate("() => 'axe' in window"):
        page.add_script_tag(path=str(AXE))
    found = page.evaluate("() => axe.run()")
    assert len(found["passes"]) > 5  # it did look
    return [
        f"{each['id']} ({each['impact']}): {node['html'][:160]}"
        for each in found["violations"]
        if each["impact"] in GRAVE
        for node in each["nodes"]
    ]
