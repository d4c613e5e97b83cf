"""Whether compression, shear and angled agree with each other as well as their errors say."""

import math

import numpy as np
import pytest

from analysis.direct.agreement import scatter_factor, typical_contradiction, with_scatter, wrong_points
from analysis.direct.cylinder_terms import CylinderTerms, cylinder_terms
from analysis.direct.pair_lean import UPRIGHT, Triple
from analysis.direct.point_covariance import own_covariance, with_shared_error
from tests.analysis.direct.points import point

A, B = 0.4e6 * (1 + 0.10j), 2.0e6 * (1 + 0.12j)
FREQUENCIES = np.geomspace(5, 200, 12)


def level(scatter: float = 1.0, seed: int = 1, wrong: tuple[int, str] | None = None) -> list[Triple]:
    """One amplitude; points scatter by `scatter` times their stated error, and one has k 20 % too large."""
    rng, error = np.random.default_rng(seed), 0.002
    triples = []
    for number, frequency in enumerate(FREQUENCIES):
        values = {"compression": B, "shear": 2 * A, "angled": A + B}
        found = {}
        for name, value in values.items():
            size = 1.2 if wrong == (number, name) else 1 + scatter * error * complex(*rng.standard_normal(2))
            found[name] = point(value * (frequency / 50) ** 0.05 * size, error, float(frequency))
        triples.append(Triple(**found))
    return triples


def misfits(triples: list[Triple]) -> list[float]:
    return [each.misfit for each in terms_of(triples)]


def terms_of(triples: list[Triple]) -> tuple[CylinderTerms, ...]:
    return cylinder_terms(
        [each.compression for each in triples], [each.shear for each in triples], [each.angled for each in triples]
    )


def test_an_understated_error_is_seen_over_all_triples() -> None:
    found = [scatter_factor(misfits(level(5.0, seed) + level(5.0, seed + 100))) for seed in range(20)]
    assert all(3 < factor < 8 for factor in found)
    assert np.mean(found) == pytest.approx(5, rel=0.1)


def test_honest_errors_have_no_factor_but_by_rare_chance() -> None:
    assert sum(scatter_factor(misfits(level(1.0, seed))) > 1 for seed in range(200)) <= 5
    assert scatter_factor([]) == 1


def test_one_wrong_point_is_no_scatter_of_all() -> None:
    assert scatter_factor(misfits(level(wrong=(4, "angled")))) == 1


@pytest.mark.parametrize("name", ["compression", "shear", "angled"])
@pytest.mark.parametrize("number", [0, 5, 11])
def test_a_wrong_point_is_named(name: str, number: int) -> None:
    triples = level(wrong=(number, name))
    (found,) = wrong_points(triples, terms_of(triples))
    assert found.configuration == name
    assert found.frequency == pytest.approx(FREQUENCIES[number])
    assert wrong_points(level(), terms_of(level())) == []


def test_the_factor_widens_what_points_have_for_themselves_alone() -> None:
    (triple, *_) = level()
    shared = Triple(with_shared_error(triple.compression, "gain", 1e3 + 0j), triple.shear, triple.angled)
    widened = with_scatter(shared, 3.0).compression
    assert widened.shared_errors == {"gain": 1e3 + 0j}
    np.testing.assert_allclose(own_covariance(widened), 9 * own_covariance(triple.compression), rtol=1e-6)


def test_a_pair_that_was_entered_as_one_cylinder_contradicts_by_half_of_it() -> None:
    halved = [Triple(each.compression, point(A, 0.002, each.shear.frequency), each.angled) for each in level()]
    assert typical_contradiction(halved, UPRIGHT) == pytest.approx(1.0, rel=0.1)
    assert typical_contradiction(level(), UPRIGHT) < 0.05
    assert math.isclose(typical_contradiction([], UPRIGHT), 0.0)
