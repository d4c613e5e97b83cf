"""The diagnosis of any structure as JSON and in sentences."""

import json
from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.structures.curve import Curve
from analysis.gap.structures.diagnosis import CurveDiagnosis, diagnose_curves
from analysis.gap.structures.modal_structure import STIFFNESS, ModalStructure
from analysis.gap.structures.modes import NormalModes
from jointlab.structures.document import sentences, structure_document

SYMMETRIC = np.array([[1.0, 1.0, 1.0], [1.4, 0.0, -1.4], [1.0, -1.0, 1.0]]) / 2


@pytest.fixture(scope="module")
def found() -> CurveDiagnosis:
    """Of three masses, with a mass of which the frequencies do not say at which end it is."""
    modes = NormalModes(("left", "middle", "right"), SYMMETRIC, np.array([20.0, 35.0, 50.0]))
    structure = ModalStructure(modes, parameters=(STIFFNESS,))
    stiffness, conditions = np.diag((2 * np.pi * modes.frequencies) ** 2), {"mode": np.arange(1.0, 4.0)}
    whole = np.eye(3) + 0.2 * np.outer(SYMMETRIC[0], SYMMETRIC[0])
    exact = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(whole, stiffness)).real)) / (2 * np.pi)
    values = [exact * (1 + 1e-4 * np.random.default_rng(seed).standard_normal(3)) for seed in range(4)]
    return diagnose_curves(
        structure,
        [Curve("frequencies", f"{n}", each, 1e-4 * exact, conditions) for n, each in enumerate(values)],
        [each for each in structure.effects([]) if each.id == "added_mass"],
    )


def test_the_document_has_the_place_of_each_effect_and_the_places_that_are_alike(found: CurveDiagnosis) -> None:
    document = json.loads(json.dumps(structure_document(found, "row", "row.csv")))
    (effect,) = document["verdict"]["effects"]
    assert effect["fields"] == found.ranking[0].variants["added_mass"]
    assert document["ranking"][0]["fields"] == {"added_mass": effect["fields"]}
    assert sorted(each["place"] for each in document["verdict"]["alike"]["added_mass"]) == ["left", "right"]


def test_sentences_say_where_an_effect_acts_and_where_else_it_may_act(found: CurveDiagnosis) -> None:
    place = found.ranking[0].variants["added_mass"]["place"]
    said = list(sentences(structure_document(found, "row", "row.csv")))
    assert said[0] == f"EXPLAINED: a mass that the model lacks at {place} (added_mass, the only one)"
    other = {"left": "right", "right": "left"}[str(place)]
    assert f"These data cannot tell apart: added_mass at {place}; added_mass at {other}" in said


@pytest.mark.parametrize(
    ("variant", "said"),
    [({"place": 0.25}, " at 0.25 m ("), ({"part": "link"}, ", part link ("), ({}, "lacks (")],
)
def test_coordinates_and_parts_are_told_as_what_they_are(
    found: CurveDiagnosis, variant: dict[str, str | int | float], said: str
) -> None:
    first = replace(found.ranking[0], variants={"added_mass": variant})
    document = structure_document(replace(found, ranking=(first, *found.ranking[1:])), "row", "row.csv")
    assert said in next(sentences(document))
