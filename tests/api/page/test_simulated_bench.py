"""The page in front of an empty database and a simulated bench that strikes by itself."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import expect

from simlab.laboratory import Laboratory
from tests.api.conftest import configuration
from tests.api.page.technician import Service, Tab, serving


@pytest.fixture(scope="module")
def rig(running_laboratory: Laboratory, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service that has measured nothing, on a bench whose operator is a program."""
    folder = tmp_path_factory.mktemp("simulated")
    addresses = running_laboratory.addresses
    operator = f'simulated_operator = "{addresses.operator}"\n'
    (folder / "jointlab.toml").write_text(operator + configuration(addresses, folder), encoding="utf-8")
    with serving(folder) as service:
        yield service


def test_a_filter_is_spoken_of_only_where_there_is_one(tab: Tab) -> None:
    page = tab.go("/page/runs")
    expect(page.get_by_text("There is no run yet. Press Measure to make one")).to_be_visible()
    page = tab.go("/page/runs?state=failed")
    expect(page.get_by_text("No run fits. Take a filter away")).to_be_visible()
