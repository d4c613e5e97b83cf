"""The article as analysis has it: a mesh as fine as what is not known of the bench allows."""

from __future__ import annotations

from typing import Any

from api.identification.structure import free_beam_of
from store.bundle_setup import Article, article_from
from tests.api.conftest import paper


def article(**tolerances: float) -> Article:
    document: dict[str, Any] = paper()["article"]
    document["tolerances"] = dict.fromkeys(document["tolerances"], 0.0) | tolerances
    return article_from(document)


def test_a_bench_that_is_stated_to_be_exact_gets_a_mesh_whose_error_is_below_the_noise() -> None:
    coarse, fine = (free_beam_of(each).mesh.positions.size for each in (article(density=0.003), article()))
    assert (coarse, fine) == (81, 321)


def test_the_tester_s_tolerance_is_none_of_the_beam_s() -> None:
    assert free_beam_of(article(tester_gain=0.003)).mesh.positions.size == 321


def test_damping_is_what_the_article_states_or_what_is_measured() -> None:
    stated, measured = free_beam_of(article()), free_beam_of(article(), [0.01, 0.002])
    assert stated.damping_rate.max() > 0
    assert measured.damping_rate[3] / stated.damping_rate[3] == 0.01 / 0.004
