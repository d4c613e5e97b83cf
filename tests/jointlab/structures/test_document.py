"""The diagnosis of any structure as JSON and in sentences."""

import json
from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.structures.curve import Curve
from analysis.gap.structures.diagnosis import CurveDiagnosis, diagnose_curves
from analysis.gap.structures.modal_structure import STIFFNESS, ModalStructure
from analysis.gap.structures.modes import NormalModes
from analysis.gap.structures.pulls import Pull
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
    assert effect["not_applied"] is None
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


def test_a_verdict_says_on_how_many_curves_its_effect_does_not_act() -> None:
    modes = NormalModes(("a",), np.ones((1, 1)), np.array([20.0]))
    structure, curves = ModalStructure(modes, parameters=(STIFFNESS,)), []
    for part, humidity in enumerate((0.0, 1.0, 2.0, 3.0, 4.0, None)):
        conditions = {"mode": np.ones(2)} | ({} if humidity is None else {"humidity": np.full(2, humidity)})
        values = 20 * np.sqrt(1 - 0.02 * (humidity or 0.0)) * np.array([1.0001, 0.9999])
        curves.append(Curve("frequencies", f"{part}", values, np.full(2, 0.002), conditions))
    tried = [each for each in structure.effects(curves) if each.id == "modulus_change"]
    document = json.loads(json.dumps(structure_document(diagnose_curves(structure, curves, tried), "one", "one.csv")))
    (effect,) = document["verdict"]["effects"]
    assert effect["not_applied"] == {"curves": 1, "of": 6, "needs": ["humidity"]}
    said = "  modulus_change: not applied to 1 of 6 curves, which lack a condition that it needs (humidity)"
    assert said in list(sentences(document))


def test_a_parameter_of_the_simulation_that_is_far_off_is_told_with_its_value(found: CurveDiagnosis) -> None:
    pull = Pull("k", "left", 1.15e5, 1e5, "N/m", 14.0)
    document = json.loads(json.dumps(structure_document(replace(found, pulls=(pull,)), "row", "row.csv")))
    assert document["verdict"]["pulls"][0]["deviations"] == 14.0
    (said,) = (each for each in sentences(document) if "its own parameter" in each)
    assert "k of part 'left' at 1.15e+05 N/m, 14.0 standard deviations from its centre, 1e+05 N/m" in said
