"""A verdict says where its effect acts, and which places the data cannot tell apart."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.linalg import eigh

from analysis.gap.effect import Mechanism
from analysis.gap.evidence.verdict import Status
from analysis.gap.parameter import Parameter
from analysis.gap.structures.attached_effects import ModulusFollows, PointMass, SofterPart
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.diagnosis import CurveDiagnosis, diagnose_curves
from analysis.gap.structures.effect import StructureEffect, Variant, variant_of
from analysis.gap.structures.modal_structure import STIFFNESS, ModalStructure
from analysis.gap.structures.modes import NormalModes

DOFS = ("1x", "2x", "3x", "4x")
ADDED = 0.4
"""kg at 1x."""


@dataclass(frozen=True)
class Loose(StructureEffect):
    id: ClassVar[str] = "loose"
    title: ClassVar[str] = "a bolt is loose"
    mechanism: ClassVar[Mechanism] = Mechanism.BEAM
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("share", "1", 0.0, 0.1),)
    bolt: int = 1
    table: tuple[float, ...] = (0.0, 1.0)


@pytest.mark.parametrize(
    ("effect", "expected"),
    [
        (PointMass("c", 3.0), {"place": "c"}),
        (PointMass(0.25, 3.0), {"place": 0.25}),
        (SofterPart("link"), {"part": "link"}),
        (ModulusFollows("angle", 1.0, 2.0), {"sensor": "angle"}),
        (Loose(7), {"bolt": 7}),
    ],
)
def test_a_variant_is_the_place_part_or_sensor_and_no_size_of_a_prior(
    effect: StructureEffect, expected: Variant
) -> None:
    assert variant_of(effect) == expected


def row(*masses: float) -> ModalStructure:
    """Four masses between two walls, with equal springs."""
    K = 1e6 * (2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
    return ModalStructure(NormalModes.of_matrices(np.diag(masses), K, DOFS, 4), parameters=(STIFFNESS,))


def with_a_mass(structure: ModalStructure) -> CurveDiagnosis:
    """The diagnosis of natural frequencies with a mass at 1x, which three series have."""
    M, random = np.eye(4), np.random.default_rng(3)
    modal = structure.modes
    M += ADDED * np.outer(modal.shapes[0], modal.shapes[0])
    exact = np.sqrt(eigh(np.diag((2 * np.pi * modal.frequencies) ** 2), M, eigvals_only=True)) / (2 * np.pi)
    conditions = {"mode": np.arange(1.0, 5.0)}
    curves = [
        Curve("frequencies", f"series {n}", exact * (1 + 2e-4 * random.standard_normal(4)), 2e-4 * exact, conditions)
        for n in range(3)
    ]
    return diagnose_curves(structure, curves)


def test_a_mass_is_named_at_its_place() -> None:
    found = with_a_mass(row(2.0, 2.0, 3.0, 2.5))
    assert (found.status, found.effects) == (Status.EXPLAINED, ("added_mass",))
    assert found.ranking[0].variants == {"added_mass": {"place": "1x"}}
    assert found.alike == {}


def test_places_that_the_data_cannot_tell_apart_are_both_told() -> None:
    found = with_a_mass(row(2.0, 2.0, 2.0, 2.0))
    assert found.effects == ("added_mass",)
    assert sorted(each["place"] for each in found.alike["added_mass"]) == ["1x", "4x"]
    assert found.alike["added_mass"][0] == found.ranking[0].variants["added_mass"]
