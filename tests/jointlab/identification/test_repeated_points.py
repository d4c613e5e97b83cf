"""A sine point that was measured twice, as to check that nothing has drifted, does not stop an identification."""

from dataclasses import replace

import pytest

from analysis.inverse.apparent_stiffness import Refusal
from jointlab.identification.direct import Direct, direct_of
from jointlab.identification.direct_notices import unphysical_text
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.sine_points import IdentifiedSinePoint
from tests.jointlab.identification.layouts import LAYOUTS, measured
from tests.jointlab.identification.tester import sine_points

POINTS = sine_points("I")
BARE = replace(measured(LAYOUTS["nine nodes"]), sets=())


def direct(points: tuple[IdentifiedSinePoint, ...]) -> Direct:
    measurement: MeasuredArticle = replace(BARE, points=points)
    return direct_of(measurement)["I"]


def again(*places: int, turned: bool = False) -> tuple[IdentifiedSinePoint, ...]:
    """The points, and those at `places` once more at the end; with a loss below zero, if asked."""
    repeated = []
    for number, place in enumerate(places, start=len(POINTS) + 1):
        point = replace(POINTS[place], order_number=number)
        value = point.result.complex_stiffness
        result = replace(point.result, complex_stiffness=value.conjugate() if turned else value)
        repeated.append(replace(point, result=result))
    return (*POINTS, *repeated)


@pytest.mark.parametrize("places", [(0,), (0, 0), (0, 7, 12), tuple(range(len(POINTS)))])
def test_repeated_points_change_no_term(places: tuple[int, ...]) -> None:
    once, twice = direct(POINTS), direct(again(*places))
    assert twice.unphysical == once.unphysical == ()
    for amplitude, terms in once.joint.items():
        found = {term.k22.frequency: term.k22.complex_stiffness for term in twice.joint[amplitude]}
        for term in terms:
            assert found[term.k22.frequency] == pytest.approx(term.k22.complex_stiffness, rel=1e-6)


def test_a_repeated_point_that_cannot_be_a_stiffness_is_told() -> None:
    said = [part for part in direct(again(2, turned=True)).unphysical if part.band.refusal is Refusal.LOSS]
    (text,) = map(unphysical_text, said)
    assert text.startswith("compression, 0.01 mm, 100 to 100 Hz: the loss stiffness at 100 Hz is -")
    assert text.endswith(": a joint feeds no energy")
