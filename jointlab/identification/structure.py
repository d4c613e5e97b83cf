"""The article as analysis has it: its beam, bare or with the masses that are mounted on it."""

from collections import defaultdict
from collections.abc import Sequence

from analysis.structure.beam import Beam, FreeBeam, Mesh
from analysis.structure.converged import assemble_converged
from analysis.suspended.characterisation import FreeBeamResult
from store.exchange.bundle_setup import Article

ELEMENTS_BETWEEN_NODES = 8  # from which `assemble_converged` extrapolates to elements of no length


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


def mesh_of(article: Article, elements: int | None = None) -> Mesh:
    """The beam's mesh, the same for every test of it.

    Args:
        article: whose nodes are in it.
        elements: between neighbouring nodes; where None, as many as leave no error that counts.
    """
    return Mesh.through(article.node_positions, ELEMENTS_BETWEEN_NODES if elements is None else elements)


def free_beam_of(article: Article, tested: FreeBeamResult | None = None, elements: int | None = None) -> FreeBeam:
    """The beam without joints, with the masses of its joints and its sensor.

    Args:
        article: as drawn.
        tested: results of the suspended beam, whose damping, modulus and density replace those of the article.
        elements: see `mesh_of`.
    """
    drawn = beam_of(article)
    material = None if tested is None else tested.material
    beam = drawn if material is None else material.of(drawn)
    ratios = article.beam.free_damping_ratios if tested is None else tested.damping_ratios
    return free_beam_with(article, beam, ratios, elements)


def free_beam_with(article: Article, beam: Beam, ratios: Sequence[float], elements: int | None = None) -> FreeBeam:
    """As `free_beam_of`, for another beam than the drawn one, with the damping ratios of its free modes."""
    masses: dict[int, float] = defaultdict(float)
    for joint in article.joints:
        masses[joint.node] += joint.added_mass
    masses[article.accelerometer.node] += article.accelerometer.mass
    return assemble_converged(beam, mesh_of(article, elements), ratios, masses)
