"""How far a joint's frame leans off 45 degrees, from the tester's three configurations.

The frame that leans by delta towards the direction of loading turns the angled pair in the tester as it turns the
joint under the beam: with e = sin 2 delta the pair has

    angled = (1 - e) a + (1 + e) b,     so      angled - compression - shear / 2 = e (compression - shear / 2).

e is one number for all frequencies and amplitudes of a joint, found by weighted least squares together with the stated
tolerance of delta. Errors that points share, such as gains of configurations, are in its error as a whole. Where
amplitudes give values that differ by more than their errors, as where superposition does not hold, the error is widened
by that misfit (the ratio of R. T. Birge, Physical Review 40, 1932, 207-227). Where a = b, every direction is alike, and
the stated tolerance is all that is known.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.point_covariance import own_covariance, shared_covariance, with_shared_error

FINEST = 1e-9  # least error of an excess, relative to the magnitude of the angled pair


@dataclass(frozen=True)
class Triple:
    """One frequency and amplitude, measured in all three configurations."""

    compression: DynamicStiffness
    shear: DynamicStiffness
    angled: DynamicStiffness

    @property
    def by_lean(self) -> complex:
        """Compression - shear / 2, N/m: b - a of its cylinders."""
        return self.compression.complex_stiffness - self.shear.complex_stiffness / 2


@dataclass(frozen=True)
class PairLean:
    """How far the frame of a joint leans towards the direction of loading, off 45 degrees.

    Attributes:
        angle: rad.
        standard_error: rad.
        source: name of this error among those that points share.
    """

    angle: float = 0.0
    standard_error: float = 0.0
    source: str = "lean"

    @property
    def excess(self) -> float:
        """e = sin 2 delta: what it adds to the share of b, and takes from that of a."""
        return math.sin(2 * self.angle)

    @property
    def slope(self) -> float:
        """Change of `excess` by one standard error of the angle."""
        return 2 * math.cos(2 * self.angle) * self.standard_error

    def shared_by(self, triple: Triple) -> Triple:
        """The triple, with the error of the lean among those of its angled pair."""
        if self.standard_error == 0:
            return triple
        return replace(triple, angled=with_shared_error(triple.angled, self.source, self.slope * triple.by_lean))


UPRIGHT = PairLean()
"""A frame that stands exactly at 45 degrees."""


def lean_of(levels: Sequence[Sequence[Triple]], tolerance: float, source: str = "lean") -> PairLean:
    """The lean of one joint's frame.

    Args:
        levels: triples of each amplitude.
        tolerance: standard deviation of the lean as stated, rad; with 0 the frame stands as drawn.
        source: name of its error.
    """
    if tolerance == 0:
        return PairLean(source=source)
    known, weighted, shared = np.zeros(len(levels)), np.zeros(len(levels)), dict[str, float]()
    for number, triples in enumerate(levels):
        excesses = [_excess(triple) for triple in triples]
        for triple, excess in zip(triples, excesses, strict=True):
            by_lean = np.array([triple.by_lean.real, triple.by_lean.imag])
            own = own_covariance(excess) + (FINEST * triple.angled.magnitude) ** 2 * np.eye(2)
            weights = np.linalg.solve(own, by_lean)
            known[number] += weights @ by_lean
            weighted[number] += weights @ [excess.stiffness, excess.damping]
            for name, error in excess.shared_errors.items():
                shared[name] = shared.get(name, 0.0) + float(weights @ [error.real, error.imag])
    total, telling = float(np.sum(known)), known > 0  # cylinders as stiff across as along say nothing
    if not np.any(telling):
        return PairLean(0.0, tolerance, source)
    found = float(np.sum(weighted)) / total
    misfit = np.sum((weighted - found * known)[telling] ** 2 / known[telling])
    scatter = float(misfit) / max(int(np.sum(telling)) - 1, 1)
    # of delta: half of that of e, as they are small; what all points share does not average out
    variance = (max(1.0, scatter) / total + sum((each / total) ** 2 for each in shared.values())) / 4
    share = tolerance**2 / (tolerance**2 + variance)
    return PairLean(share * found / 2, math.sqrt(share * variance), source)


def _excess(triple: Triple) -> DynamicStiffness:
    """Angled less compression less half of shear, with its errors."""
    parts = ((triple.angled, 1.0), (triple.compression, -1.0), (triple.shear, -0.5))
    shared = {
        source: sum(factor * point.shared_errors.get(source, 0j) for point, factor in parts)
        for source in {name for point, _ in parts for name in point.shared_errors}
    }
    own = sum(factor**2 * own_covariance(point) for point, factor in parts)
    return replace(
        triple.angled,
        complex_stiffness=sum(factor * point.complex_stiffness for point, factor in parts),
        covariance=own + shared_covariance(shared),
        shared_errors=shared,
    )
