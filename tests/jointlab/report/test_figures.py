"""Pictures of a report: panels, their legends and colours."""

import re

import numpy as np

from jointlab.report.curves import Panel, PlottedCurve
from jointlab.report.figures import direct_against_inverse, dynamic_stiffness
from jointlab.report.plots import BLUE, GREEN, MEASURED, ORANGE

CURVE = PlottedCurve(np.array([5.0, 100.0]), np.array([1e6, 2e6]), np.array([1e4, 1e4]))


def drawn(picture: str) -> dict[str, str]:
    """The SVG elements of a picture by their labels, in lower case as colours are."""
    return {label: svg.lower() for svg, label in re.findall(r'(<svg[^>]*aria-label="([^"]*)".*?</svg>)', picture, re.S)}


def test_a_method_and_an_amplitude_have_one_colour_in_all_panels() -> None:
    both = Panel("both", {0.01: CURVE, 0.1: CURVE}, {"likelihood": (1e6, 2e6), "paper": (1e6, 3e6)})
    less = Panel("less", {0.1: CURVE}, {"paper": (1e6, 3e6)})
    one, other = drawn(direct_against_inverse("Fig. 13", "k (MN/m)", [both, less], 1e6)).values()
    for colour in (ORANGE, GREEN, BLUE):
        assert colour.lower() in one
    assert GREEN.lower() in other
    assert BLUE.lower() in other
    assert ORANGE.lower() not in other
    for words in ("likelihood", "paper", "tester, 0.01 mm", "tester, 0.1 mm"):
        assert f"<!-- {words} -->" in one
    assert "<!-- likelihood -->" not in other


def test_a_configuration_that_was_not_measured_has_no_empty_panel_and_every_panel_its_legend() -> None:
    curves = {"shear": {0.1: CURVE}, "angled": {0.1: CURVE, 0.01: CURVE}}
    panels = drawn(dynamic_stiffness("I", curves, curves))
    assert [label.rpartition(": ")[2] for label in panels] == [
        f"{configuration}, {words}" for configuration in ("shear", "angled") for words in ("stiffness", "loss factor")
    ]
    for panel in panels.values():
        assert "<!-- 0.1 mm -->" in panel
        assert "<!-- frequency (hz) -->" in panel
    first, *_, last = panels.values()
    assert "<!-- 0.01 mm -->" not in first
    assert BLUE.lower() in first
    assert BLUE.lower() in last


def test_a_picture_is_as_wide_as_its_place_within_what_can_be_read() -> None:
    (svg,) = re.findall(r'<svg[^>]*style="([^"]*)"', direct_against_inverse("Fig. 14", "γ", [Panel("I", {}, {})]))
    assert re.fullmatch(r"width: 100%; min-width: \d+px; max-width: \d+px", svg)
    assert MEASURED != BLUE
