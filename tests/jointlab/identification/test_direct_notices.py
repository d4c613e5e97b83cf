"""What speaks against the tester's points is said by `identify` and `stiffness` alike, before any number."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from analysis.inverse.apparent_stiffness import Refusal, RefusedBand
from jointlab.identification.direct import UnphysicalPart, direct_of
from jointlab.identification.direct_notices import direct_notices, unphysical_text
from jointlab.identification.law import laws_of, stiffness_at
from jointlab.identification.law_document import stiffness_document
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.pipeline import identify
from jointlab.identification.sine_points import IdentifiedSinePoint
from jointlab.report.section import Notice, Table, Unknown
from jointlab.report.stiffness import stiffness_section
from jointlab.report.summary import summary_sections
from tests.jointlab.identification.layouts import LAYOUTS, article_of
from tests.jointlab.identification.tester import ERROR, sine_points

Change = Callable[[IdentifiedSinePoint], IdentifiedSinePoint]


def on_tester(change: Change = lambda point: point) -> MeasuredArticle:
    """A tester whose points scatter as they state, with a mistake in the table."""
    rng = np.random.default_rng(1)
    points = [_times(point, 1 + ERROR * complex(*rng.standard_normal(2))) for point in sine_points("I")]
    return MeasuredArticle("tester", article_of(LAYOUTS["nine nodes"]), (), tuple(map(change, points)), raw=False)


def _times(point: IdentifiedSinePoint, factor: complex) -> IdentifiedSinePoint:
    result = point.result
    covariance = abs(factor) ** 2 * result.covariance
    return replace(
        point, result=replace(result, complex_stiffness=factor * result.complex_stiffness, covariance=covariance)
    )


def shear_in_kilonewton(point: IdentifiedSinePoint) -> IdentifiedSinePoint:
    return _times(point, 1e-3) if point.configuration == "shear" else point


def one_cylinder_in_shear(point: IdentifiedSinePoint) -> IdentifiedSinePoint:
    return _times(point, 0.5) if point.configuration == "shear" else point


def exchanged(point: IdentifiedSinePoint) -> IdentifiedSinePoint:
    other = {"compression": "shear", "shear": "compression"}
    return replace(point, configuration=other.get(point.configuration, point.configuration))


def distorted(point: IdentifiedSinePoint) -> IdentifiedSinePoint:
    return replace(point, result=replace(point.result, thd_force=0.4))


def understated(point: IdentifiedSinePoint) -> IdentifiedSinePoint:
    return replace(point, result=replace(point.result, covariance=point.result.covariance / 36))


def wrong_point(point: IdentifiedSinePoint) -> IdentifiedSinePoint:
    wrong = (point.configuration, point.amplitude_pp_mm, point.frequency) == ("compression", 0.01, 100.0)
    return _times(point, 1.5) if wrong else point


@pytest.mark.parametrize(
    ("change", "said", "is_contradicted"),
    [
        (shear_in_kilonewton, "compression, shear and angled contradict each other", True),
        (one_cylinder_in_shear, "compression, shear and angled contradict each other", True),
        (exchanged, "softer in compression than in shear", True),
        (distorted, "the first harmonic does not describe 30 of 30 points, the first because total harmonic", False),
        (understated, "times as much as the stated errors", False),
        (wrong_point, "the compression point at 0.01 mm, 100 Hz contradicts the other configurations", False),
    ],
)
def test_each_mistake_is_said_before_the_table_and_marks_intervals(
    change: Change, said: str, is_contradicted: bool
) -> None:
    measurement = on_tester(change)
    found = stiffness_at(laws_of(measurement), 0.05e-3, 80.0)
    section = stiffness_section(found)
    (table,) = (number for number, item in enumerate(section.content) if isinstance(item, Table))
    before = [item.text for item in section.content[:table] if isinstance(item, Notice)]
    assert any(said in text for text in before), before
    (specimen,) = stiffness_document(found, None).specimens
    assert list(specimen.notices) == list(direct_notices("I", direct_of(measurement)["I"]))
    assert specimen.contradicted is is_contradicted
    shown = section.content[table]
    assert isinstance(shown, Table)
    assert all(isinstance(row[3], Unknown) is is_contradicted for row in shown.rows)
    in_summary = [
        item.text
        for part in summary_sections(identify(measurement))
        for item in part.content
        if isinstance(item, Notice)
    ]
    assert set(before) <= set(in_summary)


def test_a_right_table_has_no_notice() -> None:
    assert direct_notices("I", direct_of(on_tester())["I"]) == ()


@pytest.mark.parametrize(
    ("refusal", "value", "words"),
    [
        (Refusal.STORAGE, -2e5, "the storage stiffness at 80 Hz is -2e+05: a joint pushes back"),
        (Refusal.LOSS, -3e4, "the loss stiffness at 80 Hz is -3e+04: a joint feeds no energy"),
        (Refusal.RISE, 2.5, "about 80 Hz the stiffness rises as f^2.5: a joint rises as f at most"),
        (Refusal.FALL, -4.0, "about 80 Hz the stiffness falls as f^-4: inertia takes off more than half of it"),
        (Refusal.NARROW, 4, "4 lines: too narrow to be distinguished from chance"),
    ],
)
def test_a_part_is_told_with_its_place_and_its_reason(refusal: Refusal, value: float, words: str) -> None:
    part = UnphysicalPart("shear", 0.05, RefusedBand(60.0, 95.0, refusal, 80.0, value))
    assert unphysical_text(part).startswith(f"shear, 0.05 mm, 60 to 95 Hz: {words}")
