"""A shaker on the article: steady sines of one force, joints at each line as soft as their own motion makes them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simlab.article import SimulatedArticle, with_kinks
from simlab.beam import Real, free_modes
from simlab.coupling import Complex, CoupledBeam, block_diagonal

ITERATIONS = 60
SETTLED = 1e-6
"""Relative change of an amplitude below which the balance of first harmonics is found."""


@dataclass(frozen=True)
class Shaken:
    """The response to a shaker of one force.

    Attributes:
        accelerance: (points, lines) in y over the force, (m/s^2)/N.
        amplitudes: for each joint, (lines,) zero to peak, m, of its deformation in x and y together.
    """

    accelerance: Complex
    amplitudes: dict[str, Real]


def shake(
    article: SimulatedArticle, shaker: float, points: Sequence[tuple[float, str]], frequency: Real, force: float
) -> Shaken:
    """Push across the beam with sines of `force` N zero to peak, one line after the other.

    Args:
        article: that is shaken.
        shaker: where along the beam, m.
        points: where the accelerometer goes: m along the beam, and x or y.
        frequency: (lines,) Hz, above zero.
        force: zero to peak, N.

    Raises:
        RuntimeError: no steady amplitude is found at some line.
    """
    modes = free_modes(with_kinks(article).beam)
    pushed = modes.shape("y", shaker)[None]
    places = {name: [modes.shape(way, joint.position) for way in "xyr"] for name, joint in article.joints.items()}
    omega = np.asarray(2 * np.pi * frequency, dtype=np.complex128)
    beam = CoupledBeam(modes, np.concatenate(list(places.values())), omega)
    amplitudes = {name: np.full(frequency.shape, 1e-9) for name in article.joints}
    for _ in range(ITERATIONS):
        joints = [joint.dynamic_stiffness(amplitudes[name], frequency) for name, joint in article.joints.items()]
        held = block_diagonal(joints, frequency.size)
        before = amplitudes
        amplitudes = {
            name: force
            * np.linalg.norm([beam.accelerance(way, pushed, held)[0] for way in ways[:2]], axis=0)
            / (2 * np.pi * frequency) ** 2
            for name, ways in places.items()
        }
        changes = [np.abs(amplitudes[name] / before[name] - 1).max() for name in amplitudes]
        if max(changes) < SETTLED:
            rows = [beam.accelerance(modes.shape(way, at), pushed, held)[0] for at, way in points]
            return Shaken(np.array(rows), amplitudes)
        amplitudes = {name: np.sqrt(amplitudes[name] * before[name]) for name in amplitudes}
    raise RuntimeError(f"no steady amplitude at {force} N: it still changes by {max(changes):.1g}")
