"""The one-page report of a diagnosis."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from analysis.gap.evidence.verdict import Status
from analysis.gap.findings.effects_found import Remainder
from jointlab.report.gap import write_gap_report
from jointlab.report.section import NO_BREAK
from tests.api.page.diagnosis import row, series
from tests.jointlab.diagnosis.conftest import CURVE, FOLLOWS_AMPLITUDE

Make = Callable[..., dict[str, Any]]


def _text(path: Path) -> str:
    """A page whose spaces all break."""
    return path.read_text(encoding="utf-8").replace(NO_BREAK, " ")


def test_the_page_shows_maps_bars_parameters_and_ranking(document: Make, tmp_path: Path) -> None:
    write_gap_report(document() | {"title": "a <bench>"}, tmp_path / "gap.html")
    page = _text(tmp_path / "gap.html")
    assert "a &lt;bench&gt;: the gap between simulation and measurement" in page
    assert 'aria-label="Map: beam rig, 100 N"' in page
    assert 'aria-label="Gap before and after"' in page
    for text in (
        "the gap falls from 12.3 % to 3.1 %",
        "0.018 … 0.022",
        "93.0 %",
        "one of three axes",
        "shows where",
        "1x",
    ):
        assert text in page, text
    assert "Intervals are 90 %." in page
    assert not re.search(r"@import|<script|<link|<iframe|http-equiv", page)
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(set(ids)) == len(ids)


def test_faults_of_the_measurement_come_before_any_physics(document: Make, tmp_path: Path) -> None:
    write_gap_report(document(faults=("row 5y has the wrong polarity",)), tmp_path / "gap.html")
    page = _text(tmp_path / "gap.html")
    assert page.index("row 5y has the wrong polarity") < page.index("Explained: add")


def test_an_unknown_gap_names_nothing_and_still_has_its_map(document: Make, tmp_path: Path) -> None:
    write_gap_report(document(status=Status.UNKNOWN, effects=(), confounded=()), tmp_path / "gap.html")
    page = _text(tmp_path / "gap.html")
    assert "Parameters of the effects" not in page
    assert "cannot tell apart" not in page
    assert 'aria-label="Map: beam rig, 100 N"' in page


def test_what_would_take_up_the_rest_is_drawn(document: Make, tmp_path: Path) -> None:
    write_gap_report(document(remainder=Remainder(9.0, 40.0, True, (), curve=CURVE)), tmp_path / "gap.html")
    page = _text(tmp_path / "gap.html")
    assert 'aria-label="Dynamic stiffness at 0.056 m (joint I), across the beam, over frequency"' in page


def test_the_law_of_the_joints_is_drawn_and_said(document: Make, tmp_path: Path) -> None:
    write_gap_report(document(included=(FOLLOWS_AMPLITUDE,)), tmp_path / "gap.html")
    page = _text(tmp_path / "gap.html")
    title = "The law as found: stiffness and loss that follow amplitude"
    assert f'aria-label="{title}"' in page
    drawn = page[page.index(f'aria-label="{title}"') :].partition("</svg>")[0]
    for label in ("amplitude (µm)", "k over that at 1.0 µm", "loss factor", "in compression", "in shear"):
        assert f"<!-- {label} -->" in drawn, label
    assert "joint stiffness falls by 20 % (90 %: 18 to 22) in compression" in page
    write_gap_report(document(), tmp_path / "none.html")
    assert "The law as found" not in _text(tmp_path / "none.html")


def test_the_rows_with_the_largest_gap_are_drawn_measured_before_and_after(document: Make, tmp_path: Path) -> None:
    one, other, tester = row("3y", 12.0, 3.0), row("1x", 11.0, 2.9), series()
    write_gap_report(document() | {"curves": [one, other, tester]}, tmp_path / "both.html")
    both = _text(tmp_path / "both.html")
    assert 'aria-label="Measured, before and after: beam rig, blow at 3y, set 1"' in both
    assert "Elastomer tester, I, shear, 0.1 mm: 4.0 % to 1.0 %" in both  # the first of each rig
    assert "blow at 1x, set 1:" not in both
    write_gap_report(document() | {"curves": [one, other]}, tmp_path / "beam.html")
    assert "blow at 1x, set 1: 11.0 % to 2.9 %" in _text(tmp_path / "beam.html")
