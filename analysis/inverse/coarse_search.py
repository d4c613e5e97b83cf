"""Joints to start a fit from, if only the bench as drawn and the accelerances are known.

A global search over few numbers: one scale of stiffness for all joints, then a scale and a shape for each, and one loss
factor. The logarithm of the magnitude is compared, not the accelerance itself, which has a valley wherever one peak
falls on another and counts little but its peaks.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex, FrequencyResponses, Real
from analysis.inverse.cylinder_parameters import CylinderPair
from analysis.inverse.joint_parameters import matrices
from analysis.inverse.response_model import CondensedBeam, ResponseModel
from analysis.inverse.tolerances import Deviations
from analysis.modal.response_variance import standard_deviation
from analysis.structure.beam import FreeBeam
from analysis.structure.joints import Joint

MOST_LINES = 120
LOSS_FACTOR = 0.1
"""Loss factor of the first search. Filled rubber has 0.03 to 0.3."""
SCALES = 10 ** np.arange(-1.0, 5.01, 0.125)
"""Tried values of the largest translational term of a joint, EI/L^3: from a nearly free to a nearly clamped beam."""
COMPRESSION_OVER_SHEAR = (3.4, 6.4, 16.5)
"""For bonded cylinders one, three and six times as wide as high, 3 (1 + 2 S^2) with S = D / 4h (A. N. Gent,
P. B. Lindley, Proc. Inst. Mech. Eng. 173, 1959)."""
STEPS = (0.5, 0.25, 0.1)
"""Steps of the second search, in powers of ten; it halts at each until no single step helps."""
STARTS = 4
"""Valleys that the second search descends, and the most joints that it offers."""
ALIKE = 0.05
"""Largest difference of any scale, in powers of ten, of two results that count as one."""


@dataclass(frozen=True, eq=False)
class JointShapes:
    """The possible shapes of a joint's stiffness matrix, by the drawing.

    Attributes:
        name, node: of the joint.
        shapes: (shapes, 3, 3) stiffness matrices, the largest translational term one; the joint is close to one of
            them times a stiffness.
    """

    name: str
    node: int
    shapes: Real


def drawn_as_cylinders(node: int, pair: CylinderPair, free_beam: FreeBeam) -> JointShapes:
    """A joint of two inclined cylinders, which may be slender or flat."""
    lever = free_beam.beam.height / 4
    terms, _ = pair.terms(np.zeros(2))
    rows = np.array([terms @ [1.0, ratio, (1 + ratio) * lever**2, 0.0] for ratio in COMPRESSION_OVER_SHEAR])
    shapes = matrices(rows.ravel().astype(complex)).real
    return JointShapes(pair.name, node, shapes / np.max(np.abs(shapes[:, :2, :2]), axis=(1, 2), keepdims=True))


def coarse_joints(
    free_beam: FreeBeam, responses: FrequencyResponses, drawn: Sequence[JointShapes], band: tuple[float, float]
) -> list[list[Joint]]:
    """Joints on which the beam's accelerances are like the measured ones, the best first, none close to another.

    Args:
        free_beam: the beam without joints, as drawn.
        band: lowest and highest frequency used, Hz.

    Raises:
        AnalysisError: joints without a node of their own, or no line in the band.
    """
    search = _search(free_beam, responses.band(max(band[0], 1e-9), band[1]), drawn)
    ends = sorted(map(search.descended, search.valleys()), key=search.misfit)
    apart = list[_Point]()
    for end in ends:
        if not any(end.is_like(other) for other in apart):
            apart.append(end)
    return [
        [Joint(joint.name, joint.node, z) for joint, z in zip(drawn, search.stiffness(point), strict=True)]
        for point in apart
    ]


@dataclass(frozen=True)
class _Point:
    """Joints of the search.

    Attributes:
        scales: of each joint, logarithm to base ten, in EI/L^3.
        shapes: of each joint, number of its shape.
        loss: logarithm to base ten of the loss factor of all.
    """

    scales: tuple[float, ...]
    shapes: tuple[int, ...]
    loss: float

    def is_like(self, other: "_Point") -> bool:
        apart = np.abs(np.array(self.scales) - other.scales)
        return self.shapes == other.shapes and bool(np.max(apart) <= ALIKE)


@dataclass(frozen=True, eq=False)
class _Search:
    """The measured accelerances and the beam, prepared for any joints.

    Attributes:
        beam: condensed to joints and points.
        level: (rows, lines) logarithm of the squared magnitude that was measured.
        floor: (rows, lines) power of its noise.
    """

    beam: CondensedBeam
    drawn: Sequence[JointShapes]
    level: Real
    floor: Real

    def stiffness(self, point: _Point) -> Complex:
        """(joints, 3, 3) z, SI."""
        drawing = self.beam.model.free_beam.beam
        unit = drawing.flexural_rigidity / drawing.length**3 * (1 + 1j * 10**point.loss)
        chosen = zip(self.drawn, point.scales, point.shapes, strict=True)
        return np.array([unit * 10**scale * joint.shapes[shape] for joint, scale, shape in chosen])

    def misfit(self, point: _Point) -> float:
        """Mean distance of the logarithms of squared magnitudes."""
        found = np.abs(self.beam.evaluate_on(self.stiffness(point)).accelerance) ** 2 + self.floor
        return float(np.mean(np.abs(np.log(found) - self.level)))

    def valleys(self) -> list[_Point]:
        """Joints of one scale and one kind of shape, where scales to either side do worse; the best ones."""
        count, found = len(self.drawn), list[tuple[float, _Point]]()
        for shape in range(min(len(joint.shapes) for joint in self.drawn)):
            points = [_Point(count * (scale,), count * (shape,), np.log10(LOSS_FACTOR)) for scale in np.log10(SCALES)]
            misfits = [np.inf, *map(self.misfit, points), np.inf]
            for at, point in enumerate(points, start=1):
                if misfits[at] <= min(misfits[at - 1], misfits[at + 1]):
                    found.append((misfits[at], point))
        return [point for _, point in sorted(found, key=lambda each: each[0])[:STARTS]]

    def descended(self, start: _Point) -> _Point:
        """The end of a walk downhill by single steps."""
        best, lowest = start, self.misfit(start)
        for step in STEPS:
            while True:
                tried = [(self.misfit(point), point) for point in self._around(best, step)]
                misfit, point = min(tried, key=lambda each: each[0])
                if misfit >= lowest:
                    break
                best, lowest = point, misfit
        return best

    def _around(self, point: _Point, step: float) -> list[_Point]:
        """One joint stiffer or softer or of another shape, or all more or less lossy."""
        found = [_Point(point.scales, point.shapes, point.loss + by) for by in (-step, step)]
        for joint, scale in enumerate(point.scales):
            for by in (-step, step):
                scales = (*point.scales[:joint], scale + by, *point.scales[joint + 1 :])
                found.append(_Point(scales, point.shapes, point.loss))
            for shape in range(len(self.drawn[joint].shapes)):
                if shape != point.shapes[joint]:
                    shapes = (*point.shapes[:joint], shape, *point.shapes[joint + 1 :])
                    found.append(_Point(point.scales, shapes, point.loss))
        return found


def _search(free_beam: FreeBeam, lines: FrequencyResponses, drawn: Sequence[JointShapes]) -> _Search:
    noise = standard_deviation(lines)
    keep = np.arange(lines.frequency.size) % -(-max(lines.frequency.size, 1) // MOST_LINES) == 0
    nodes = tuple(joint.node for joint in drawn)
    model = ResponseModel(free_beam, nodes, lines.response, lines.inputs, lines.frequency[keep], lines.decay)
    floor = 2 * noise[:, keep] ** 2
    level = np.log(np.abs(lines.accelerance[:, keep]) ** 2 + floor)
    return _Search(model.condensed(Deviations.none(len(nodes), len(lines.inputs))), drawn, level, floor)
