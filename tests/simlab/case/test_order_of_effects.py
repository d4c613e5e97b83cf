"""Several effects on one thing: what comes of them is physics, not the order in which they were drawn."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from simlab.beam import Real
from simlab.case.campaign import CONFIGURATIONS, ROWS, Points
from simlab.case.draw import EFFECTS, Case, CaseKind, draw_case
from simlab.case.effects import SimulatedEffect
from simlab.case.random_case import draw_random_case
from simlab.case.simulate import as_tested, direct_stiffness, specimen_stiffness
from simlab.coupling import Complex
from simlab.stand import BuiltCase, Stand

LINES: Real = np.array([30.0, 80.0, 270.0, 610.0, 880.0])
STRUCK = (ROWS[0], ROWS[4], ROWS[7])
PLAIN = draw_case(3, CaseKind.NONE)


def catalogued(name: str) -> SimulatedEffect:
    return draw_case(3, CaseKind.SINGLE, [name], 0.8).effects[0]


def drawn(name: str) -> SimulatedEffect:
    return draw_random_case(3, CaseKind.SINGLE, [name]).effects[0]


def built_with(*effects: SimulatedEffect) -> BuiltCase:
    return BuiltCase.of(replace(PLAIN, effects=effects))


def readings(case: Case) -> tuple[Complex, Complex]:
    built = BuiltCase.of(case)
    return Stand(built, LINES).read(0, STRUCK)[0], direct_stiffness(built)


def joints(*effects: SimulatedEffect) -> Complex:
    return Stand(built_with(*effects), LINES).support_stiffness(0, 0.5, 100.0)


@pytest.mark.parametrize("one", [catalogued, drawn])
def test_two_effects_are_the_same_in_whatever_order_they_were_drawn(one: type) -> None:
    apart = []
    known = {name: one(name) for name in EFFECTS}
    for first, second in combinations(EFFECTS, 2):
        both = [readings(replace(PLAIN, effects=(known[a], known[b]))) for a, b in ((first, second), (second, first))]
        if not all(np.allclose(here, there, rtol=1e-9) for here, there in zip(*both, strict=True)):
            apart.append(f"{first} and {second}")
    assert apart == []


@pytest.mark.parametrize("beside", ["contact_patch", "foundation_compliance"])
def test_a_mass_at_a_joint_moves_with_the_beam(beside: str) -> None:
    """Neither spread over the patch nor carried by the foundation: -w^2 m beside whatever holds the beam."""
    mass, other = catalogued("joint_mass"), catalogued(beside)
    inertia = np.diag([mass.number("m_I")] * 2 + [0.0] + [mass.number("m_II")] * 2 + [0.0])
    expected = joints(other) - (2 * np.pi * LINES[:, None, None]) ** 2 * inertia
    np.testing.assert_allclose(joints(mass, other), expected, rtol=1e-12, atol=1e-6)


@pytest.mark.parametrize("state", ["temperature_shift", "preload_stiffening", "conditioning_drift"])
def test_dry_friction_beside_the_rubber_knows_nothing_of_its_state(state: str) -> None:
    friction = catalogued("coulomb_friction")
    friction = replace(friction, law="coulomb", values=dict(friction.values) | {"F_c": 0.5})
    points = Points.alike(0, CONFIGURATIONS.index("compression"), 0.1, LINES, 23.0, order=0.7)
    with_both, without, plain, alone = (
        specimen_stiffness(built_with(*effects), points)
        for effects in ((friction, catalogued(state)), (catalogued(state),), (), (friction,))
    )
    np.testing.assert_allclose(with_both - without, alone - plain, rtol=1e-9)


def test_a_delay_is_that_of_all_that_the_accelerometer_sees() -> None:
    delay, bending = catalogued("channel_delay"), catalogued("out_of_plane_bending")
    delay = replace(delay, law="delay")
    seen = Stand(built_with(bending), LINES).read(0, STRUCK)[0]
    both = Stand(built_with(delay, bending), LINES).read(0, STRUCK)[0]
    np.testing.assert_allclose(both, seen * np.exp(-2j * np.pi * LINES * delay.number("tau")), rtol=1e-9)


@pytest.mark.parametrize("one", [catalogued, drawn])
def test_a_specimen_sees_what_the_frame_leaves_of_the_motion(one: type) -> None:
    """The force through both is one: k(x_s) x_s = K x, with x_s = x - c K x."""
    softening, frame = one("amplitude_dependence"), one("frame_compliance")
    points = Points.alike(0, CONFIGURATIONS.index("compression"), 0.1, LINES[:3], 23.0)
    found = direct_stiffness(replace(built_with(softening, frame), campaign=replace(PLAIN.campaign, points=points)))
    found = found / PLAIN.campaign.tester_gain
    own = 2e6 + 0j
    compliance = 1.0 / as_tested(built_with(frame), np.full(3, own), points) * PLAIN.campaign.tester_gain - 1.0 / own
    left = np.abs(1.0 - compliance * found)
    assert np.all(left < 0.8)
    seen = specimen_stiffness(built_with(softening), points, left)
    np.testing.assert_allclose(found, seen / (1.0 + compliance * seen), rtol=1e-4)


@pytest.mark.parametrize("within", ["frame_compliance", "fixture_inertia"])
def test_a_lag_is_that_of_all_that_the_tester_shows(within: str) -> None:
    lag, other = replace(catalogued("transducer_lag"), law="delay"), catalogued(within)
    points = Points.alike(0, 0, 0.1, LINES[:3], 23.0)
    own: Complex = np.full(3, 2e6 + 2e5j)
    turned = np.exp(2j * np.pi * points.frequency * lag.number("tau"))
    expected = as_tested(built_with(other), own, points) * turned
    np.testing.assert_allclose(as_tested(built_with(lag, other), own, points), expected, rtol=1e-12)
