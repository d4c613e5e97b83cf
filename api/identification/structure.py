"""The article as analysis has it: its beam, bare or with what is mounted on it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

from analysis.structure.beam import Beam, FreeBeam, Mesh, assemble
from store.bundle_setup import Article

ELEMENTS_BETWEEN_NODES = 8  # four leave k12 by maximum likelihood 0.2 % low
FOR_AN_EXACT_BENCH = 32
"""Where no tolerance is stated, the error of eight elements is what is left, and intervals are too narrow for it."""


def beam_of(article: Article) -> Beam:
    """The bare beam as drawn."""
    given = article.beam
    return Beam(
        length=given.length,
        height=given.height,
        width=given.width,
        youngs_modulus=given.youngs_modulus,
        poisson_ratio=given.poisson_ratio,
        density=given.density,
    )


def free_beam_of(article: Article, damping_ratios: Sequence[float] | None = None) -> FreeBeam:
    """The beam without joints, on a mesh finer than its nodes, with what its joints and sensor weigh.

    Its modes from the lowest elastic one up have these `damping_ratios`, or those that the article states.
    """
    masses: dict[int, float] = defaultdict(float)
    for joint in article.joints:
        masses[joint.node] += joint.added_mass
    masses[article.accelerometer.node] += article.accelerometer.mass
    return assemble(
        beam_of(article),
        Mesh.through(article.node_positions, ELEMENTS_BETWEEN_NODES if _is_uncertain(article) else FOR_AN_EXACT_BENCH),
        damping_ratios=article.beam.free_damping_ratios if damping_ratios is None else tuple(damping_ratios),
        point_masses=masses,
    )


def _is_uncertain(article: Article) -> bool:
    """Whether the laboratory admits not to know something of the beam test."""
    stated = article.tolerances.model_dump(exclude={"tester_gain"})
    return any(value > 0 for value in stated.values())
