"""Effects at degrees of freedom of different units and sizes, such as the rotations of a finite-element beam."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.frequency_response import Real
from analysis.gap.structures.attached_effects import OfAmplitudeAtPlace, PointMass, PointSpring
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.diagnosis import diagnose_curves
from analysis.gap.structures.effect import Acting
from analysis.gap.structures.modal_structure import ModalStructure
from analysis.gap.structures.modes import NormalModes

FREQUENCY = np.linspace(5.0, 320.0, 60)


def cantilever(count: int = 4) -> NormalModes:
    """Modes of a beam of 0.5 m and 0.2 kg, with a displacement (w, m) and a rotation (r, rad) at each node."""
    part, bending, weight = 0.5 / count, 21.9, 0.405
    four = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    inert = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
    sizes = np.array([1, part, 1, part])
    M, K = np.zeros((2, 2 * count + 2, 2 * count + 2))
    for first in range(0, 2 * count, 2):
        own = slice(first, first + 4)
        M[own, own] += weight * part / 420 * inert * np.outer(sizes, sizes)
        K[own, own] += bending / part**3 * four * np.outer(sizes, sizes)
    dofs = [f"{kind}{node}" for node in range(1, count + 1) for kind in "wr"]
    return NormalModes.of_matrices(M[2:, 2:], K[2:, 2:], dofs, 4)


def in_other_units(modes: NormalModes, dof: str, factor: float) -> NormalModes:
    shapes = modes.shapes.copy()
    shapes[modes.dofs.index(dof)] *= factor
    return replace(modes, shapes=shapes)


def levels(modes: NormalModes, observable: str = "accelerance(w4,w4)") -> list[Curve]:
    """Exact responses of the structure alone under two forces."""
    model = ModalStructure(modes)
    found = []
    for force in (1.0, 2.0):
        conditions = {"frequency": FREQUENCY, "force": np.full(FREQUENCY.size, force)}
        blank = Curve(observable, f"{force:g} N", np.ones(FREQUENCY.size, dtype=complex), np.ones(60), conditions)
        exact = model.predict({"loss_factor": 0.02}, (), blank)
        found.append(replace(blank, values=exact, deviation=np.full(60, 1e-3 * float(np.max(np.abs(exact))))))
    return found


def spreads(modes: NormalModes, curves: list[Curve]) -> dict[tuple[str, str], Real]:
    """Spread of each parameter of each effect at a place."""
    offered = [each for each in ModalStructure(modes).effects(curves) if hasattr(each, "place")]
    return {(each.id, str(each.place)): np.array([own.spread for own in each.parameters]) for each in offered}


def test_units_of_one_degree_of_freedom_change_no_prior_at_another() -> None:
    modes = cantilever()
    curves = levels(modes)
    before, after = spreads(modes, curves), spreads(in_other_units(modes, "r3", 1e3), curves)
    assert {name for name, _ in before} >= {"added_mass", "added_spring", "added_damper", "absorber", "friction_spring"}
    for (name, place), own in before.items():
        if place != "r3":
            np.testing.assert_allclose(after[name, place], own, err_msg=f"{name} at {place}")
    np.testing.assert_allclose(after["added_mass", "r3"], before["added_mass", "r3"] / 1e6)


def test_the_prior_of_a_cubic_spring_does_not_depend_on_the_unit_of_the_response_that_was_measured() -> None:
    offered = []
    for factor in (1.0, 1e3):
        modes = in_other_units(cantilever(), "r4", factor)
        found = ModalStructure(modes).effects(levels(modes, "receptance(r4,w4)"))
        offered.append([each for each in found if isinstance(each, OfAmplitudeAtPlace) and each.place == "w2"])
    assert [each.largest for each in offered[0]] == pytest.approx([each.largest for each in offered[1]])


def test_a_mass_on_a_beam_with_rotations_is_named_at_its_place() -> None:
    modes, random = cantilever(), np.random.default_rng(0)
    model, curves = ModalStructure(modes), []
    for response in ("w4", "w2"):
        blank = Curve(f"accelerance({response},w4)", response, np.ones(60, dtype=complex), np.ones(60),
                      {"frequency": FREQUENCY})  # fmt: skip
        exact = model.predict({"loss_factor": 0.02}, (Acting(PointMass("w4"), {"mass": 0.02}),), blank)
        deviation = np.full(60, 0.005 * float(np.sqrt(np.mean(np.abs(exact) ** 2))))
        noise = deviation * (random.standard_normal(60) + 1j * random.standard_normal(60))
        curves.append(replace(blank, values=exact + noise, deviation=deviation))
    kinds = (PointMass, PointSpring)
    tried = [each for each in model.effects(curves) if isinstance(each, kinds) and each.place in ("w2", "w4", "r4")]
    found = diagnose_curves(model, curves, tried)
    (effect,) = found.model.effects
    assert isinstance(effect, PointMass)
    assert effect.place == "w4"
    assert found.after < 0.1 * found.before
