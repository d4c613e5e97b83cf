"""The article as analysis has it: one mesh for every test of its beam, and what the beam is made of."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from analysis.dof import Direction, Dof
from analysis.interval import Estimate
from analysis.modes import Modes, poles_from
from analysis.structure.beam import assemble
from analysis.suspended.characterisation import characterise_free_beam
from jointlab.identification.inverse import tolerances_of
from jointlab.identification.structure import beam_of, free_beam_of, mesh_of
from store.exchange.bundle_setup import Article, article_from
from tests.api.conftest import paper


def article(**tolerances: float) -> Article:
    document: dict[str, Any] = paper()["article"]
    document["tolerances"] = dict.fromkeys(document["tolerances"], 0.0) | tolerances
    return article_from(document)


def test_every_test_of_the_beam_has_one_mesh_and_the_paper_s_can_be_had() -> None:
    for each in (article(density=0.003), article()):
        assert mesh_of(each).positions.tolist() == free_beam_of(each).mesh.positions.tolist()
        assert mesh_of(each).positions.size == 81
    assert free_beam_of(article(), elements=1).mesh.positions.tolist() == list(article().node_positions)


def test_damping_modulus_and_density_are_what_the_article_states_or_what_is_measured() -> None:
    drawn = beam_of(article())
    mesh = mesh_of(article(), 4)
    true = replace(drawn, youngs_modulus=1.003 * drawn.youngs_modulus)
    free = assemble(true, mesh, damping_ratios=(0.01, 0.002))
    points = [Dof(node, Direction.Y) for node in range(1, 12)]
    shapes = free.shapes[[mesh.degree(point) for point in points], 3:5].T.astype(complex)
    poles = poles_from(free.frequency[3:5], 2 * np.array([0.01, 0.002]))
    tested = characterise_free_beam(
        Modes(poles, shapes, tuple(points), np.diag(4 * [1e-8])), drawn, mesh, weighed=Estimate(9.2551, 0.001)
    )
    stated, measured = free_beam_of(article()), free_beam_of(article(), tested)
    assert measured.damping_rate[3] / stated.damping_rate[3] == pytest.approx(0.01 / 0.004, rel=0.01)
    assert measured.frequency[3] == pytest.approx(np.sqrt(1.003) * stated.frequency[3], rel=1e-4)
    assert tested.material is not None
    assert measured.beam == tested.material.of(drawn)
    tolerances = tolerances_of(article(), tested.material, by_hand=True)
    assert 0 < tolerances.density < tolerances_of(article(density=0.003), by_hand=True).density
    assert tolerances.material_correlation != 0
