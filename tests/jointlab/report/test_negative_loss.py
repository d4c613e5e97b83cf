"""A loss factor below zero is told wherever the terminal shows what the tester's points say."""

from collections.abc import Iterable
from dataclasses import replace

import pytest

from jointlab.identification.law import laws_of, stiffness_at
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.pipeline import identify
from jointlab.identification.sine_points import IdentifiedSinePoint
from jointlab.report.section import Item, Notice
from jointlab.report.stiffness import stiffness_section
from jointlab.report.summary import summary_sections
from tests.jointlab.identification.layouts import LAYOUTS, measured
from tests.jointlab.identification.tester import sine_points


def of_tester(*, turned: bool, share: float = 1.0) -> MeasuredArticle:
    """Sine points alone; with force and displacement exchanged, or the other time dependence, h is below zero."""
    points = [_turned(each, share) if turned else each for each in sine_points("I", "II")]
    return replace(measured(LAYOUTS["nine nodes"]), sets=(), points=tuple(points))


def _turned(point: IdentifiedSinePoint, share: float) -> IdentifiedSinePoint:
    result = point.result
    return replace(point, result=replace(result, complex_stiffness=complex(result.stiffness, -share * result.damping)))


def notices(content: Iterable[Item]) -> list[str]:
    return [each.text for each in content if isinstance(each, Notice)]


@pytest.mark.parametrize("turned", [True, False])
def test_the_summary_says_that_no_specimen_feeds_energy(turned: bool) -> None:
    sections = {each.title: each.content for each in summary_sections(identify(of_tester(turned=turned)))}
    said = [text for text in notices(sections["Direct method"]) if "feeds no energy" in text]
    assert bool(said) is turned
    assert all(text.startswith("Not a specimen's stiffness: joint ") for text in said)


@pytest.mark.parametrize("turned", [True, False])
def test_the_law_says_which_loss_factors_are_none(turned: bool) -> None:
    """Each point alone may be zero; all together are not."""
    found = stiffness_at(laws_of(of_tester(turned=turned, share=0.07)), 0.1e-3, 50.0)
    said = [text for text in notices(stiffness_section(found).content) if "below zero" in text]
    assert [text.split(":")[0] for text in said] == (["joint I", "joint II"] if turned else [])
    assert all("sign of the phase" in text for text in said)
