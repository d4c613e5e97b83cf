"""The amplitudes to which laws refer: readings at 0 Hz, of zero or of noise alone do not decide them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from analysis.frequency_response import Real
from analysis.gap.parameter import Parameter
from analysis.gap.structures.attached_effects import CubicPointSpring, FrictionSpring
from analysis.gap.structures.chain_effects import GainSlope
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.diagnosis import diagnose_curves
from analysis.gap.structures.effect import Acting, StructureEffect
from analysis.gap.structures.material_effects import CubicSpring, OfAmplitude, SmoothAmplitude
from analysis.gap.structures.modal_structure import ModalStructure
from analysis.gap.structures.modes import NormalModes
from analysis.gap.structures.single_degree import SingleDegree

STIFFNESS, LOSS = (2 * np.pi * 20) ** 2, 0.05
OSCILLATOR = SingleDegree(
    (
        Parameter("stiffness", "N/m", STIFFNESS, 0.02, True),
        Parameter("mass", "kg", 1.0, 0.02, True),
        Parameter("loss_factor", "1", LOSS, 0.3, True),
    )
)
CENTRES = {each.name: each.centre for each in OSCILLATOR.parameters}
FREQUENCY = np.concatenate([[0.0, 0.25, 1.0], np.linspace(10.0, 40.0, 40)])
"""Hz; at the first three, noise is larger than the response, and large as a displacement."""


def accelerations(acting: Sequence[Acting] = ()) -> list[Curve]:
    """Of the oscillator under three forces, with noise of 1 % of the resonance."""
    found, random = [], np.random.default_rng(3)
    for force in (1.0, 3.0, 9.0):
        conditions = {"frequency": FREQUENCY, "force": np.full(FREQUENCY.size, force)}
        blank = Curve("acceleration", f"{force:g} N", np.ones(FREQUENCY.size, dtype=complex), np.ones(43), conditions)
        exact = OSCILLATOR.predict(CENTRES, acting, blank)
        deviation = np.full(43, 0.003 * float(np.max(np.abs(exact))))
        noise = deviation * (random.standard_normal(43) + 1j * random.standard_normal(43))
        found.append(replace(blank, values=exact + noise, deviation=deviation))
    return found


def first(curve: Curve, count: int) -> Curve:
    """A curve without its first values."""
    conditions = {name: own[count:] for name, own in curve.conditions.items()}
    return replace(curve, values=curve.values[count:], deviation=curve.deviation[count:], conditions=conditions)


def scales(effects: Sequence[StructureEffect]) -> list[Real]:
    """Knots, or largest amplitudes, of all laws of amplitude."""
    return [
        np.asarray(each.knots if isinstance(each, SmoothAmplitude) else each.largest)
        for each in effects
        if isinstance(each, (OfAmplitude, SmoothAmplitude, CubicPointSpring, FrictionSpring))
    ]


@pytest.mark.filterwarnings("error")
def test_lines_at_or_near_0_hz_do_not_decide_the_scale_of_laws_of_amplitude() -> None:
    with_them = accelerations()
    found, expected = (scales(OSCILLATOR.effects(each)) for each in (with_them, [first(own, 3) for own in with_them]))
    assert len(found) == 5
    for own, plain in zip(found, expected, strict=True):
        np.testing.assert_array_equal(own, plain)


@pytest.mark.filterwarnings("error")
def test_one_reading_of_zero_takes_away_no_law_of_amplitude() -> None:
    blank = accelerations()[0]
    values = np.where(FREQUENCY < 40, blank.values, 0)
    assert len(scales(OSCILLATOR.effects([replace(blank, observable="displacement", values=values)]))) == 5


@pytest.mark.filterwarnings("error")
def test_where_no_reading_stands_out_ordinary_ones_give_the_scale() -> None:
    loud = [replace(first(each, 3), deviation=np.abs(first(each, 3).values)) for each in accelerations()]
    angular = 2 * np.pi * FREQUENCY[3:]
    every = np.concatenate([np.abs(each.values) / angular**2 for each in loud])
    (largest,) = {each.largest for each in OSCILLATOR.effects(loud) if isinstance(each, OfAmplitude)}
    assert 0.1 * np.max(every) < largest < np.max(every)


def test_laws_of_amplitude_without_any_displacement_are_told_as_not_tried() -> None:
    still = [replace(each, values=np.zeros(43, dtype=complex), deviation=np.full(43, 1.0)) for each in accelerations()]
    found = diagnose_curves(OSCILLATOR, still, without=frozenset({"viscous_damping", "time_delay", "gain_slope"}))
    told = {each.effect: each.reason for each in found.failures}
    assert set(told) == {
        "cubic_stiffness (Duffing)",
        "amplitude_dependence (power of amplitude)",
        "amplitude_dependence (between two plateaus)",
        "coulomb_friction (Jenkins element)",
    }
    assert all("no displacement other than zero was measured" in each for each in told.values())


def test_a_cubic_spring_is_named_from_accelerations_that_begin_at_0_hz() -> None:
    curves = accelerations([Acting(CubicSpring(0.01), {"share": 0.05})])
    tried = [each for each in OSCILLATOR.effects(curves) if each.id in ("cubic_stiffness", "gain_slope", "time_delay")]
    found = diagnose_curves(OSCILLATOR, curves, tried)
    assert found.effects == ("cubic_stiffness",)
    assert not found.failures


@pytest.mark.filterwarnings("error")
def test_lines_at_or_near_0_hz_do_not_decide_the_scale_of_a_cubic_spring_on_a_structure() -> None:
    stiffness = 9e5 * np.array([[2.0, -1.0], [-1.0, 1.0]])
    model = ModalStructure(NormalModes.of_matrices(np.eye(2), stiffness, ("a", "b"), 2))
    frequency, random = np.concatenate([[0.0, 0.25], np.linspace(50.0, 300.0, 60)]), np.random.default_rng(1)
    conditions = {"frequency": frequency, "force": np.full(62, 2.0)}
    blank = Curve("accelerance(b,b)", "a", np.ones(62, dtype=complex), np.ones(62), conditions)
    exact = model.predict({"loss_factor": 0.02}, (), blank)
    deviation = np.full(62, 0.003 * float(np.max(np.abs(exact))))
    whole = replace(blank, values=exact + deviation * random.standard_normal(62), deviation=deviation)
    found, expected = (scales(model.effects([each])) for each in (whole, first(whole, 2)))
    assert len(found) == 4
    assert found == expected


def test_a_slope_of_the_gain_leaves_a_line_at_0_hz_as_it_is() -> None:
    values = np.ones(3, dtype=complex)
    curve = Curve("displacement", "a", values, np.ones(3), {"frequency": np.array([0.0, 10.0, 1000.0])})
    with np.errstate(all="raise"):
        found = GainSlope().reading({"per_decade": 0.1}, values, curve)
    np.testing.assert_allclose(found, [1.0, 0.9, 1.1])
