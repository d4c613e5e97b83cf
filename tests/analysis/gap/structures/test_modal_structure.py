"""A structure from its modes, against its matrices with the same things attached."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.gap.structures.attached_effects import (
    Absorber,
    AtPlace,
    CubicPointSpring,
    FrictionSpring,
    PointDashpot,
    PointMass,
    PointSpring,
    SofterPart,
)
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.diagnosis import diagnose_curves
from analysis.gap.structures.effect import Acting
from analysis.gap.structures.modal_structure import ModalStructure
from analysis.gap.structures.modes import Attached, NormalModes

COUNT, MASS, STIFF, LOSS = 6, 2.0, 1e6, 0.02
DOFS = tuple(f"{n}x" for n in range(1, COUNT + 1))
FREQUENCY = np.linspace(20.0, 300.0, 200)


def chain() -> tuple[Real, Real]:
    """M and K of six masses in a row, the first spring to the ground."""
    K = STIFF * (2 * np.eye(COUNT) - np.eye(COUNT, k=1) - np.eye(COUNT, k=-1))
    K[-1, -1] = STIFF
    return MASS * np.eye(COUNT), K


def structure(**more: Real) -> ModalStructure:
    return ModalStructure(NormalModes.of_matrices(*chain(), DOFS, COUNT, more))


def curve(observable: str) -> Curve:
    size = FREQUENCY.size
    return Curve(observable, "a", np.ones(size, dtype=complex), np.ones(size), {"frequency": FREQUENCY})


def receptance(Z: Complex) -> Complex:
    """(lines,) of 6x over 2x, from what is added to the dynamic stiffness (lines, 6, 6)."""
    M, K = chain()
    angular = 2 * np.pi * FREQUENCY
    whole = K * (1 + 1j * LOSS) - (angular**2)[:, None, None] * M + Z
    return np.asarray(np.linalg.inv(whole)[:, 5, 1])


@pytest.mark.parametrize(
    ("effect", "given", "added"),
    [
        (PointMass("3x"), {"mass": 0.7}, lambda s: 0.7 * s**2),
        (PointSpring("6x"), {"stiffness": 3e5}, lambda s: 3e5 + 0 * s),
        (PointDashpot("1x"), {"damping": 40.0}, lambda s: 40.0 * s),
        (
            Absorber("3x", highest=200.0),
            {"mass": 0.3, "tuned": 80.0, "loss": 0.1},
            lambda s: 1 / (1 / (0.3 * s**2) + 1 / (0.3 * (2 * np.pi * 80) ** 2 * (1 + 0.1j))),
        ),
    ],
)
def test_what_is_attached_acts_as_in_the_matrices(
    effect: AtPlace, given: dict[str, float], added: Callable[[Complex], Complex]
) -> None:
    Z = np.zeros((FREQUENCY.size, COUNT, COUNT), dtype=complex)
    place = DOFS.index(str(effect.place))
    Z[:, place, place] = added(np.asarray(2j * np.pi * FREQUENCY))
    found = structure().predict({"loss_factor": LOSS}, (Acting(effect, given),), curve("receptance(6x,2x)"))
    np.testing.assert_allclose(found, receptance(Z), rtol=1e-8)


def test_accelerance_is_receptance_twice_derived() -> None:
    values = {"loss_factor": LOSS}
    receptances, accelerances = (
        structure().predict(values, (), curve(f"{kind}(6x,2x)")) for kind in ("receptance", "accelerance")
    )
    np.testing.assert_allclose(accelerances, -((2 * np.pi * FREQUENCY) ** 2) * receptances)


def test_natural_frequencies_are_those_of_the_matrices_with_a_mass_and_a_spring() -> None:
    M, K = chain()
    M[2, 2] += 0.7
    K[5, 5] += 3e5
    expected = np.sqrt(eigh(K, M, eigvals_only=True)) / (2 * np.pi)
    acting = (Acting(PointMass("3x"), {"mass": 0.7}), Acting(PointSpring("6x"), {"stiffness": 3e5}))
    asked = Curve("frequencies", "a", np.ones(COUNT), np.ones(COUNT), {"mode": np.arange(1.0, COUNT + 1)})
    np.testing.assert_allclose(structure().predict({}, acting, asked).real, expected)


def with_an_absorber(damped: bool) -> tuple[Real, Real, Complex]:
    """M, C and K of the chain with a damper at 1x, and an absorber at 3x as a seventh mass."""
    M, C, K = np.zeros((7, 7)), np.zeros((7, 7)), np.zeros((7, 7), dtype=complex)
    M[:6, :6], K[:6, :6] = chain()
    M[6, 6], C[0, 0] = 0.3, 40.0 * damped
    spring = 0.3 * (2 * np.pi * 80) ** 2 * (1 + 0.1j * damped)
    K[:6, :6] *= 1 + 1j * LOSS * damped
    K[np.ix_((2, 6), (2, 6))] += spring * np.array([[1, -1], [-1, 1]])
    return M, C, K


ABSORBER = Acting(Absorber("3x", highest=200.0), {"mass": 0.3, "tuned": 80.0, "loss": 0.1})


def test_natural_frequencies_with_an_absorber_are_those_of_the_matrices_and_one_more() -> None:
    M, _, K = with_an_absorber(damped=False)
    asked = Curve("frequencies", "a", np.ones(7), np.ones(7), {"mode": np.arange(1.0, 8.0)})
    found = structure().predict({}, (ABSORBER,), asked).real
    np.testing.assert_allclose(found, np.sqrt(eigh(K.real, M, eigvals_only=True)) / (2 * np.pi))
    with pytest.raises(AnalysisError, match="has no mode 7; it has 6"):
        structure().predict({}, (), asked)


def test_poles_with_an_absorber_and_a_damper_are_roots_of_the_determinant_of_the_matrices() -> None:
    M, C, K = with_an_absorber(damped=True)
    asked = Curve("poles", "a", np.ones(7, dtype=complex), np.ones(7), {"mode": np.arange(1.0, 8.0)})
    acting = (ABSORBER, Acting(PointDashpot("1x"), {"damping": 40.0}))
    found = structure().predict({"loss_factor": LOSS}, acting, asked)
    assert np.all(np.diff(found.imag) > 0)
    assert np.all(found.real < 0)
    for pole in found:
        Z = pole**2 * M + pole * C + K
        assert np.linalg.svd(Z, compute_uv=False)[-1] < 1e-9 * np.linalg.norm(Z)


@pytest.mark.parametrize(
    ("effect", "given"),
    [
        (FrictionSpring("6x", largest=1e-4), {"stiffness": 3e5, "slips_from": 4e-6}),
        (CubicPointSpring("6x", largest=1e-4), {"cubic": 4e14}),
    ],
)
def test_a_spring_that_follows_amplitude_has_the_stiffness_of_the_amplitude_that_comes_out(
    effect: AtPlace, given: dict[str, float]
) -> None:
    def asked(observable: str, force: float) -> Curve:
        plain = curve(observable)
        return replace(plain, conditions={**plain.conditions, "force": np.full(FREQUENCY.size, force)})

    place, forces = DOFS.index("6x"), (0.01, 3.0)
    found = [structure().predict({"loss_factor": LOSS}, (Acting(effect, given),), asked("receptance(6x,2x)", force))
             for force in forces]  # fmt: skip
    for response, force in zip(found, forces, strict=True):
        amplitude = np.abs(response) * force
        Z = np.zeros((FREQUENCY.size, COUNT, COUNT), dtype=complex)
        if "cubic" in given:
            Z[:, place, place] = 0.75 * given["cubic"] * amplitude**2
        else:  # the first harmonic of the loop, by its integral over a cycle of sticking and slipping
            Z[:, place, place] = [jenkins(given["stiffness"], given["slips_from"], each) for each in amplitude]
        np.testing.assert_allclose(response, receptance(Z), rtol=2e-3)
    assert np.max(np.abs(found[0] - found[1])) > 0.1 * np.max(np.abs(found[0]))


def jenkins(stiffness: float, slips_from: float, amplitude: float) -> complex:
    """First harmonic of the force of spring and dry friction, over that of the displacement, by steps in time."""
    phase = np.linspace(0.0, 4 * np.pi, 4001)
    force, held = np.zeros(phase.size), 0.0
    displacement = amplitude * np.cos(phase)
    for step, x in enumerate(displacement):
        held = min(max(held, x - slips_from), x + slips_from)
        force[step] = stiffness * (x - held)
    last = slice(2000, 4000)
    return complex(
        np.mean(force[last] * np.exp(-1j * phase[last])) / np.mean(displacement[last] * np.exp(-1j * phase[last]))
    )


def test_a_spring_that_slips_is_named_at_its_place_from_levels_of_force() -> None:
    truth, frequency = Attached("6x", stiffness=3e5, slip=1.2), np.linspace(20.0, 100.0, 13)
    modes, random, curves = NormalModes.of_matrices(*chain(), DOFS, COUNT), np.random.default_rng(1), []
    for force in (0.01, 1.0, 3.0, 10.0):
        conditions = {"frequency": frequency, "force": np.full(13, force)}
        blank = Curve("receptance(6x,2x)", f"{force:g} N", np.ones(13, dtype=complex), np.ones(13), conditions)
        exact = ModalStructure(modes, (truth,)).predict({"loss_factor": LOSS}, (), blank)
        deviation = 0.01 * np.abs(exact)
        noise = deviation * (random.standard_normal(13) + 1j * random.standard_normal(13))
        curves.append(replace(blank, values=exact + noise, deviation=deviation))
    model = ModalStructure(modes)
    kinds = (PointMass, PointSpring, CubicPointSpring, FrictionSpring)
    tried = [each for each in model.effects(curves) if isinstance(each, kinds) and each.place in ("3x", "6x")]
    assert len(tried) == 8
    found = diagnose_curves(model, curves, tried, ("3 N",))
    (effect,) = found.model.effects
    assert isinstance(effect, FrictionSpring)
    assert effect.place == "6x"
    assert found.never_shown is not None
    assert found.never_shown[1] < 0.05 * found.never_shown[0]


def test_modes_with_losses_of_their_own_have_poles_with_these() -> None:
    losses = np.linspace(0.01, 0.06, COUNT)
    lossy = ModalStructure(replace(structure().modes, losses=losses))
    asked = Curve("poles", "a", np.ones(COUNT, dtype=complex), np.ones(COUNT), {"mode": np.arange(1.0, COUNT + 1)})
    found = lossy.predict({"loss_factor": 0.005}, (), asked)
    np.testing.assert_allclose(found**2, -((2 * np.pi * lossy.modes.frequencies) ** 2) * (1 + 1j * (losses + 0.005)))
    one = replace(lossy, modes=replace(lossy.modes, losses=np.full(COUNT, LOSS)))
    responses = one.predict({}, (), curve("receptance(6x,2x)"))
    np.testing.assert_allclose(responses, receptance(np.zeros((FREQUENCY.size, COUNT, COUNT), dtype=complex)))


def test_a_softer_substructure_softens_its_own_springs() -> None:
    M, K = chain()
    part = np.zeros((COUNT, COUNT))
    part[3:5, 3:5] = STIFF * np.array([[1, -1], [-1, 1]])
    expected = np.sqrt(eigh(K - 0.4 * part, M, eigvals_only=True)) / (2 * np.pi)
    asked = Curve("frequencies", "a", np.ones(COUNT), np.ones(COUNT), {"mode": np.arange(1.0, COUNT + 1)})
    found = structure(middle=part).predict({}, (Acting(SofterPart("middle"), {"share": -0.4}),), asked)
    np.testing.assert_allclose(found.real, expected)


def test_a_place_that_does_not_exist_is_refused_with_those_that_do() -> None:
    with pytest.raises(AnalysisError, match="no degree of freedom '7x'; it has 1x"):
        structure().predict({}, (), curve("receptance(7x,1x)"))


def test_a_support_without_a_coordinate_cannot_move() -> None:
    held = ModalStructure(structure().modes, (Attached("1x", stiffness=1e5),))
    asked = Curve("frequencies", "a", np.ones(1), np.ones(1), {"mode": np.ones(1)})
    with pytest.raises(AnalysisError, match="has no coordinate"):
        held.predict({"support": 0.1}, (), asked)


def test_matrices_that_are_not_symmetric_are_refused() -> None:
    M, K = chain()
    K[0, 1] = 5.0
    with pytest.raises(AnalysisError, match="K is to be a symmetric matrix"):
        NormalModes.of_matrices(M, K, DOFS, 3)


@pytest.mark.parametrize(
    ("mass", "stiffness", "parts", "said"),
    [
        (1.0, 1.0 + 0.1j, {}, "K: complex values; give real numbers, and loss as losses or loss_factor"),
        (1.0 + 0.1j, 1.0, {}, "M: complex values"),
        (1.0, 1.0, {"link": 1j * np.eye(COUNT)}, "link: complex values"),
        (1.0, np.nan, {}, "K: not all values are finite"),
        (1.0, -1.0, {}, "squared angular frequency is -.*, below zero; check the sign of K"),
    ],
)
def test_matrices_without_real_modes_are_refused_with_a_hint(
    mass: complex, stiffness: complex, parts: dict[str, Complex], said: str
) -> None:
    M, K = chain()
    with pytest.raises(AnalysisError, match=said):
        NormalModes.of_matrices(np.asarray(mass * M), np.asarray(stiffness * K), DOFS, COUNT, parts)  # type: ignore[arg-type]  # wrong, to be refused


def test_a_free_structure_has_a_mode_at_zero() -> None:
    M, K = chain()
    K[0, 0] = STIFF
    assert NormalModes.of_matrices(M, K, DOFS, 2).frequencies[0] == pytest.approx(0.0, abs=0.01)
    with pytest.raises(AnalysisError, match="0 modes were asked for"):
        NormalModes.of_matrices(M, K, DOFS, 0)


def on_a_line(*coordinates: float, **changes: Any) -> NormalModes:
    """Shapes that are the square of the coordinate, and its cube."""
    at = np.array(coordinates)
    whole = {
        "dofs": tuple(f"{each:g}" for each in coordinates),
        "shapes": np.stack([at**2, at**3], axis=1),
        "frequencies": np.array([10.0, 20.0]),
        "coordinates": at,
    }
    return NormalModes(**(whole | changes))


def test_coordinates_that_do_not_rise_are_sorted_with_their_shapes_and_names() -> None:
    sorted_, other = on_a_line(0.0, 0.1, 0.2, 0.3, 0.4), on_a_line(0.2, 0.3, 0.0, 0.1, 0.4)
    assert other.dofs == sorted_.dofs
    for place in (0.05, 0.15, 0.25, 0.35, "0.3"):
        np.testing.assert_allclose(other.at(place), sorted_.at(place))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"coordinates": np.array([0.0, 0.1])}, r"coordinates have shape \(2,\); 3 numbers are needed"),
        ({"coordinates": np.array([0.0, np.nan, 0.2])}, "coordinates: not all values are finite"),
        ({"shapes": np.full((3, 2), np.nan)}, "shapes: not all values are finite"),
        ({"shapes": np.ones((3, 2)) + 1j}, "shapes: complex values"),
        ({"frequencies": np.array([10.0, np.inf])}, "frequencies: not all values are finite"),
        ({"frequencies": np.array([-10.0, 20.0])}, "a frequency is below zero: -10 Hz"),
        ({"losses": np.array([0.1])}, r"losses have shape \(1,\); 2 numbers are needed"),
        ({"losses": np.array([0.1, np.nan])}, "losses: not all values are finite"),
        ({"parts": {"link": np.eye(3)}}, r"part link is \(3, 3\)"),
    ],
)
def test_modes_that_are_no_real_numbers_for_each_place_and_mode_are_refused(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(AnalysisError, match=said):
        on_a_line(0.0, 0.1, 0.2, **changes)
