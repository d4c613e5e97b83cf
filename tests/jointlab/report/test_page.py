"""The report, with names that are no names and with half of the measurement."""

import json
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from jointlab.report.plots import as_svg, figure
from jointlab.report.section import NO_BREAK, ends, number, with_ends
from jointlab.report.typography import NO_BREAK_HYPHEN
from tests.api.conftest import Command

HOSTILE = '"><script src=http://elsewhere/x.js></script>$\\frac{'


class Elements(HTMLParser):
    """The names of all elements."""

    def __init__(self) -> None:
        super().__init__()
        self.names: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.names.add(tag)


def test_a_bundle_is_reported_without_a_database_and_its_names_are_text(
    jointlab: Command, bundle: Path, tmp_path: Path
) -> None:
    setup = json.loads((bundle / "setup.json").read_text(encoding="utf-8"))
    setup["title"] = HOSTILE
    setup["joints"][0]["name"] = HOSTILE
    (bundle / "setup.json").write_text(json.dumps(setup), encoding="utf-8")
    rows = [line.split(",") for line in (bundle / "direct.csv").read_text(encoding="utf-8").splitlines()]
    column = rows[0].index("specimen")
    quoted = '"' + HOSTILE.replace('"', '""') + '"'
    table = [[quoted if (at, cell) == (column, "I") else cell for at, cell in enumerate(row)] for row in rows]
    (bundle / "direct.csv").write_text("\n".join(map(",".join, table)) + "\n", encoding="utf-8")

    answer = jointlab("report", bundle, "-o", "[b]report.html")
    assert (answer.returncode, answer.stderr) == (0, "")
    assert answer.stdout == "[b]report.html written\n"
    page = Path("[b]report.html").read_text(encoding="utf-8")
    elements = Elements()
    elements.feed(page)
    assert "script" not in elements.names
    assert "svg" in elements.names
    for number_in_paper in (5, 6, 7, 8, 9, 11, 12, 13, 14):
        assert f"Fig. {number_in_paper}" in page
    assert "Identified against true" not in page
    assert 'aria-label="Stabilisation chart"' in page
    assert page.count("k of joint ") == 4  # of two joints by two methods
    assert '<td class="unknown">' in page
    assert "<small>only k11(" in page
    assert not (tmp_path / "jointlab.db").exists()
    assert page.count('<div class="panels" role="group" aria-label="Fig. 11, joint &quot;&gt;&lt;script') == 1
    assert 'content: "\\000022\\00003e\\00003cscript src' in page  # the footer of printed pages
    assert page.count('<td>laboratory</td><td class="unknown">not recorded') == 2  # of two lists
    assert "<h2>Instruments</h2>" not in page


def test_a_run_is_reported_and_its_results_stored(
    jointlab: Command, measured: int, query: Callable[[str], list[tuple[Any, ...]]]
) -> None:
    Path("logo.svg").write_text("<svg xmlns='http://www.w3.org/2000/svg'/>", encoding="utf-8")
    laboratory = '[laboratory]\nname = "Rubber & Co"\naddress = "Street 1\\nTown"\nlogo = "logo.svg"\n'
    Path("jointlab.toml").write_text(laboratory, encoding="utf-8")
    answer = jointlab("report", measured, "-o", "again.html")
    assert answer.returncode == 0, answer.stderr
    page = _plain(Path("again.html").read_text(encoding="utf-8"))
    front = page.partition('<nav aria-label="Contents">')[0]
    assert "<strong>Rubber &amp; Co</strong>\nStreet 1\nTown</p>" in front
    assert 'src="data:image/svg+xml;base64,PHN2ZyB4' in front
    ((low, high),) = query(
        "SELECT stiffness_low / 1e6, stiffness_high / 1e6 FROM v_joint_stiffness "
        "WHERE latest AND joint = 'I' AND element = 'k22' AND method = 'maximum likelihood on accelerances'"
    )
    assert f"{ends((low, high))}] MN/m" in _row(front, "I, 22")
    ((started, who),) = query("SELECT started_at, who FROM runs JOIN run_events ON run_id = runs.id LIMIT 1")
    assert started[:16] in _row(front, "measured")
    assert who in _row(front, "by")
    assert "<td>accelerometer SIM-A-01</td><td>2026-03-02</td>" in front
    assert "was not diagnosed" in front
    assert "not recorded" in _row(page, "relative humidity")
    assert "0.5 mm" in _row(page, "static preload, as a displacement")
    contents = re.findall(r'<a href="#(section-\d+)">', page)
    assert contents == re.findall(r'<section id="(section-\d+)">', page)
    assert len(contents) > 5
    assert query("SELECT count(*), sum(latest) FROM v_analyses WHERE kind = 'joint_matrices'") == [(4, 2)]
    worst = _table(page, "Joint I: reached amplitude").split("<td>shear</td>")[1].split("</tr>")[0]
    assert re.search(r"<td>0\.1</td><td>0\.\d+ … 0\.\d+</td>(<td>-?[\d.e-]+ ± [\d.e-]+</td>){3}", worst), worst


def _plain(page: str) -> str:
    """A page whose cells have no headings of their own, and whose spaces and hyphens all break."""
    cells = re.sub(r' data-head="[^"]*"><div>', ">", page).replace("</div></td>", "</td>")
    return cells.replace(NO_BREAK, " ").replace(NO_BREAK_HYPHEN, "-")


def _table(page: str, caption: str) -> str:
    """The table of a page whose caption begins so."""
    (found,) = [table for table in page.split("<table") if f"<caption>{caption}" in table]
    return found


def _row(page: str, first: str) -> str:
    """The rest of the only row with this cell."""
    (found,) = re.findall(rf"<td>{re.escape(first)}</td>(.*?)</tr>", page)
    return str(found)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0.00"),
        (1.2345, "1.23"),
        (123.45, "123"),
        (1234567.0, "1\u202f234\u202f567"),
        (12345678.0, "1.23e+07"),
        (-0.012345, "-0.0123"),
        (1.2e-5, "1.20e-05"),
        (float("nan"), "–"),
    ],
)
def test_numbers_are_written_as_people_read_them(value: float, text: str) -> None:
    assert number(value) == text


def test_an_interval_with_an_unknown_end_is_a_dash() -> None:
    assert ends((1.0, 2.0)) == "1.00 … 2.00"
    assert ends(np.array([np.nan, 2.0])) == "–"


def test_a_value_has_the_digits_of_its_interval_and_stays_inside() -> None:
    assert with_ends(1.2546, (1.25416, 1.25500)) == "1.25460 [1.25416\u00a0…\u00a01.25500]"
    assert with_ends(2.0, (np.nan, np.nan)) == "2.00 [–]"


def test_pictures_on_one_page_do_not_share_ids() -> None:
    def ids(label: str) -> set[str]:
        drawn, (axes,) = figure()
        axes.plot([0, 1], [0, 1])
        axes.semilogy([0, 1], [1, 100])
        svg = as_svg(drawn, label)
        found = re.findall(r'\bid="([^"]+)"', svg)
        assert len(set(found)) == len(found)
        assert svg.startswith(f'<svg role="img" aria-label="{label}"')
        return set(found)

    assert not ids("Fig. 1: one") & ids("Fig. 2: other")
