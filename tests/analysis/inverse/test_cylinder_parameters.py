from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from analysis.errors import AnalysisError
from analysis.inverse.cylinder_parameters import CylinderPair, CylinderParameters
from analysis.inverse.joint_parameters import SymmetricTerms, matrices
from analysis.structure.joints import Cylinder, effective_stiffness

if TYPE_CHECKING:
    from tests.analysis.conftest import Bench

PAIRS = (
    CylinderPair("I", (-np.pi / 4, 3 * np.pi / 4), 0.006),
    CylinderPair("II", (np.pi / 4, -3 * np.pi / 4), 0.006),
)


@st.composite
def values(draw: st.DrawFn) -> NDArray[np.float64]:
    sizes = np.array([0.5e6, 2e6, 20.0, 300.0, 0.05e6, 0.2e6, 2.0, 30.0, 0.02, 0.02])
    shares = np.array(draw(st.lists(st.floats(-1, 1), min_size=20, max_size=20)))
    return np.asarray(shares * np.tile(sizes, 2))


@settings(deadline=None)
@given(values=values())
def test_terms_are_those_of_two_leaning_cylinders(values: NDArray[np.float64]) -> None:
    found = matrices(CylinderParameters(PAIRS, 0.01).upper(values))
    for z, pair, own in zip(found, PAIRS, values.reshape(2, 10), strict=True):
        cylinder = Cylinder(*(own[:4] + 1j * own[4:8]))
        angles = np.array(pair.inclinations) + own[8:]
        expected = sum(
            effective_stiffness(cylinder, theta, e) for theta, e in zip(angles, (-0.006, 0.006), strict=True)
        )
        np.testing.assert_allclose(z, expected, atol=1e-8)


@settings(max_examples=20, deadline=None)
@given(values=values())
def test_slopes_are_derivatives(values: NDArray[np.float64]) -> None:
    parameters = CylinderParameters(PAIRS, 0.01)
    slope = parameters.slope(values)
    for place in range(values.size):
        step = (1e-3 if place % 10 >= 8 else 1.0) * np.eye(values.size)[place]
        first, second = (
            (parameters.upper(values + n * step) - parameters.upper(values - n * step)) / (2 * n * np.max(step))
            for n in (1, 2)
        )
        expected = (4 * first - second) / 3
        np.testing.assert_allclose(slope[:, place], expected, rtol=1e-7, atol=1e-7 * np.max(np.abs(expected)) + 1e-9)


def test_the_start_gives_back_joints_made_of_cylinders(bench: Bench) -> None:
    parameters = CylinderParameters(PAIRS, 0.01)
    found = matrices(parameters.upper(parameters.start(bench.joints)))
    for z, joint in zip(found, bench.joints, strict=True):
        np.testing.assert_allclose(z, joint.dynamic_stiffness, atol=1e-8)


def test_terms_as_parameters_give_themselves_back(bench: Bench) -> None:
    parameters = SymmetricTerms(("I", "II"))
    terms = parameters.start(bench.joints)
    for z, joint in zip(matrices(parameters.upper(terms)), bench.joints, strict=True):
        np.testing.assert_allclose(z, joint.dynamic_stiffness, atol=1e-8)
    np.testing.assert_allclose(parameters.slope(terms) @ terms, parameters.upper(terms))
    assert parameters.labels[0] == "k11(I)"
    assert parameters.labels[-1] == "h33(II)"


def test_cylinders_of_other_joints_are_refused(bench: Bench) -> None:
    with pytest.raises(AnalysisError, match="joints II, I, matrices for I, II"):
        CylinderParameters(PAIRS[::-1]).start(bench.joints)
