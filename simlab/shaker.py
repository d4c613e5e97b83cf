"""A shaker on the article: steady sines of one force, joints at each line as soft as their own motion makes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simlab.article import Article, Joint
from simlab.assembly import Complex
from simlab.beam import Real
from simlab.elastomer import REFERENCE_TEMPERATURE
from simlab.supported_beam import SupportedBeam

ITERATIONS = 60
SETTLED = 1e-6
"""Relative change of an amplitude below which the balance of first harmonics is found."""


@dataclass(frozen=True)
class Shaken:
    """What a shaker of one force finds.

    Attributes:
        accelerance: (points, lines) in y over the force, (m/s^2)/N.
        amplitudes: for each joint, (lines,) zero to peak, m, of its deformation in x and y together.
    """

    accelerance: Complex
    amplitudes: dict[str, Real]


def shake(
    article: Article, shaker: float, points: Sequence[tuple[float, str]], frequency: Real, force: float
) -> Shaken:
    """Push across the bar with sines of `force` N zero to peak, one line after the other.

    Args:
        article: that is shaken.
        shaker: where along the bar, m.
        points: where the accelerometer goes: m along the bar, and x or y.
        frequency: (lines,) Hz, above zero.
        force: zero to peak, N.

    Raises:
        RuntimeError: no steady amplitude is found at some line.
    """
    beam = SupportedBeam(article)
    lines, pushed = beam.in_plane.lines(frequency), beam.free.shape("y", shaker)
    places = {name: [beam.free.shape(way, joint.position) for way in "xy"] for name, joint in article.joints.items()}
    amplitudes = {name: np.full(frequency.shape, 1e-9) for name in article.joints}
    for _ in range(ITERATIONS):
        held = _held(article, frequency, amplitudes)
        before = amplitudes
        amplitudes = {
            name: force
            * np.linalg.norm([beam.in_plane.accelerance(lines, held, way, pushed) for way in ways], axis=0)
            / (2 * np.pi * frequency) ** 2
            for name, ways in places.items()
        }
        changes = [np.abs(amplitudes[name] / before[name] - 1).max() for name in amplitudes]
        if max(changes) < SETTLED:
            rows = [beam.in_plane.accelerance(lines, held, beam.free.shape(way, at), pushed) for at, way in points]
            return Shaken(np.array(rows), amplitudes)
        amplitudes = {name: np.sqrt(amplitudes[name] * before[name]) for name in amplitudes}
    raise RuntimeError(f"no steady amplitude at {force} N: it still changes by {max(changes):.1g}")


def _held(article: Article, frequency: Real, amplitudes: dict[str, Real]) -> Complex:
    """(lines, 6, 6) both joints in x, y and rotation, each line at its own amplitude."""
    whole = np.zeros((frequency.size, 6, 6), dtype=np.complex128)
    for place, (name, joint) in enumerate(article.joints.items()):
        own = slice(3 * place, 3 * place + 3)
        whole[:, own, own] = [_at(joint, *each) for each in zip(amplitudes[name], frequency, strict=True)]
    return whole


def _at(joint: Joint, amplitude: float, frequency: float) -> Complex:
    return joint.dynamic_stiffness(float(amplitude), frequency, REFERENCE_TEMPERATURE)
