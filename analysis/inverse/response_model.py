"""Accelerances of the beam on joints, fast where only the joints change.

The free beam is condensed once to its receptance R between joints, accelerometer and blows. On joints z a unit force at
s moves the joints by g_s = (1 + R_JJ z)^-1 R_Js: one solution of 3 equations for each joint and line, for all s
together. All free modes are in R; nothing is truncated or approximated.

E and rho scale the free beam's stiffness and mass exactly: with e = E/E0, r = rho/rho0 and constant modal damping
ratios, a free mode has the receptance 1 / (r lambda^2 + sqrt(e r) lambda c + e w^2) on the drawing's shapes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from analysis.dof import Direction, Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.inverse.frequency_laws import REFERENCE_FREQUENCY, growth
from analysis.inverse.tolerances import Deviations
from analysis.structure.beam import DIRECTIONS, FreeBeam, Theory
from analysis.structure.beam_motion import modes_near, modes_under_blow

ROUNDED = 2e-4
"""m, over which the kink under a blow is rounded: no hammer tip is a point, and no search comes to rest at a kink."""


@dataclass(frozen=True, eq=False)
class ResponseModel:
    """A roving-hammer experiment: the points struck, the accelerometer and the lines.

    Attributes:
        free_beam: the beam without joints, as drawn.
        joint_nodes: (joints,) numbered from 1.
        response: the accelerometer.
        inputs: (rows,) the points struck.
        frequency: (lines,) Hz, all above zero.
        decay: of the exponential window that the records carry, 1/s.

    Raises:
        AnalysisError: there is no joint, joints share a node, a node is unknown, or a line is not above 0 Hz.
    """

    free_beam: FreeBeam
    joint_nodes: tuple[int, ...]
    response: Dof
    inputs: tuple[Dof, ...]
    frequency: Real
    decay: float = 0.0

    def __post_init__(self) -> None:
        nodes = self.joint_nodes
        if not nodes or len(set(nodes)) < len(nodes):
            raise AnalysisError(f"joints sit at nodes {list(nodes)}; give one or more, each at a node of its own")
        if self.frequency.size == 0 or not np.all(self.frequency > 0):
            raise AnalysisError("accelerances need lines above 0 Hz to say anything of the joints")
        for node in (*nodes, self.response.node, *(point.node for point in self.inputs)):
            self.free_beam.mesh.node_degrees(node)

    @property
    def poles(self) -> Complex:
        """(lines,) lambda = decay + i w, rad/s."""
        return np.asarray(self.decay + 2j * np.pi * self.frequency)

    def condensed(self, deviations: Deviations) -> CondensedBeam:
        """The free beam between joints, accelerometer and blows, for a bench with these deviations."""
        free = self.free_beam
        blows = zip(self.inputs, deviations.blow_positions.tolist(), deviations.blow_leans.tolist(), strict=True)
        sensor = modes_near(free, self.response, deviations.sensor_position)
        struck = [modes_under_blow(free, dof, place, lean) for dof, place, lean in blows]
        joints = [
            modes_near(free, Dof(node, way), d)
            for node, d in zip(self.joint_nodes, deviations.joint_positions.tolist(), strict=True)
            for way in DIRECTIONS
        ]
        at_joints, at_ends = (np.array([value for value, *_ in places]) for places in (joints, [sensor, *struck]))
        compliance = 1 / self.modal_stiffness(deviations)
        return CondensedBeam(
            model=self,
            deviations=deviations,
            at_joints=at_joints,
            at_ends=at_ends,
            joint_slopes=np.array([slope for _, slope in joints]),
            end_slopes=np.array([sensor[1], *(slope for _, slope, _ in struck)]),
            blow_turns=np.array([turn for *_, turn in struck]),
            compliance=compliance,
            joints=_by_line(_receptance(compliance, at_joints, at_joints)),
            ends=_by_line(_receptance(compliance, at_joints, at_ends)),
            direct=_receptance(compliance, at_ends[:1], at_ends)[0] + self.kinks(deviations)[:, None],
            log_frequency=np.log(self.poles / (2j * np.pi * REFERENCE_FREQUENCY)),
        )

    def kinks(self, deviations: Deviations) -> Real:
        """(1 + rows,) m/N by which shear lowers the motion at the accelerometer, for a blow beside it but at its node.

        Under a force the beam has a kink: its slope jumps by 1 / (kappa G A). The motion about a node (`modes_near`) is
        smooth and holds for an accelerometer exactly under the blow. With their distance, the motion falls by
        1 / (2 kappa G A) for each metre.
        """
        beside = self._beside(deviations)
        return -self.kink_slope(deviations) * beside**2 / np.hypot(beside, ROUNDED)

    def kink_slope(self, deviations: Deviations) -> Real:
        """(1 + rows,) 1 / (2 kappa G A), 1/N, for blows at the node of an accelerometer across the beam; else 0."""
        beam = self.free_beam.beam
        across = self.free_beam.theory is Theory.TIMOSHENKO and self.response.direction is Direction.Y
        slope = beam.shear_flexibility(1.0) / (24 * beam.flexural_rigidity) if across else 0.0
        at_it = np.array([False, *(point == self.response for point in self.inputs)])
        return np.where(at_it, slope / (1 + deviations.youngs_modulus), 0.0)

    def kink_side(self, deviations: Deviations) -> Real:
        """(1 + rows,) derivative of the rounded distance: 1 for a blow right of the accelerometer, -1 left of it."""
        beside = self._beside(deviations)
        return np.asarray(beside * (beside**2 + 2 * ROUNDED**2) / np.hypot(beside, ROUNDED) ** 3)

    def kink_bend(self, deviations: Deviations) -> Real:
        """(1 + rows,) second derivative of the rounded distance, 1/m."""
        beside = self._beside(deviations)
        return np.asarray(ROUNDED**2 * (2 * ROUNDED**2 - beside**2) / np.hypot(beside, ROUNDED) ** 5)

    def _beside(self, deviations: Deviations) -> Real:
        return np.array([0.0, *(deviations.blow_positions - deviations.sensor_position)])

    def modal_stiffness(self, deviations: Deviations) -> Complex:
        """(N, lines) the free modes' dynamic stiffness."""
        free, lam = self.free_beam, self.poles
        e, r = 1 + deviations.youngs_modulus, 1 + deviations.density
        damping = np.sqrt(e * r) * np.outer(free.damping_rate, lam)
        return np.asarray(r * lam**2 + damping + e * free.squared_frequency[:, None])


@dataclass(frozen=True, eq=False)
class CondensedBeam:
    """The free beam of one bench, condensed to its joints and ends; ends are the accelerometer, then the blows.

    Attributes:
        model: the experiment.
        deviations: of this bench from the drawing.
        at_joints: (3 joints, N) the free modes' motion at the joints.
        at_ends: (1 + rows, N) that at the accelerometer and at the blows.
        joint_slopes, end_slopes: the same shapes, derivatives in the position, 1/m.
        blow_turns: (rows, N) derivatives in the lean of the blows, 1/rad.
        compliance: (N, lines) of the free modes.
        joints: (lines, 3 joints, 3 joints) free receptance between joints, m/N.
        ends: (lines, 3 joints, 1 + rows) free receptance between joints and ends.
        direct: (1 + rows, lines) free receptance between the accelerometer and all ends.
        log_frequency: (lines,) logarithm of lambda over that at which joints are stated.
    """

    model: ResponseModel
    deviations: Deviations
    at_joints: Real
    at_ends: Real
    joint_slopes: Real
    end_slopes: Real
    blow_turns: Real
    compliance: Complex
    joints: Complex
    ends: Complex
    direct: Complex
    log_frequency: Complex

    @property
    def growth(self) -> Complex:
        """(3 joints, lines) factor of frequency on the stiffness at each freedom of the joints."""
        return np.repeat(growth(self.deviations.joint_laws, self.log_frequency), 3, axis=0)

    def evaluate_on(self, dynamic_stiffness: Complex) -> SupportedResponse:
        """Motion on joints of `dynamic_stiffness` (joints, 3, 3), at 100 Hz if they depend on frequency.

        Raises:
            AnalysisError: a line lies exactly on a resonance without damping.
        """
        z, growth = block_diag(*dynamic_stiffness), self.growth
        try:
            moved = np.linalg.solve(np.eye(len(z)) + (self.joints * growth.T[:, None]) @ z, self.ends)
        except np.linalg.LinAlgError as error:
            raise AnalysisError("a line lies on a resonance of the beam without damping") from error
        displacement = np.ascontiguousarray(np.moveaxis(moved, 0, -1))
        force = np.asarray(growth[:, None] * np.tensordot(z, displacement, axes=1), dtype=complex)
        through_joints = np.einsum("jl,jsl->sl", np.moveaxis(self.ends[:, :, 0], 0, -1), force)
        receptance = (self.direct - through_joints)[1:]
        factor = self.model.poles**2 * (1 + self.deviations.gain)
        if not np.all(np.isfinite(receptance)):
            raise AnalysisError("a line lies on a resonance of the free beam without damping: give damping ratios")
        return SupportedResponse(self, displacement, force, factor * receptance)


@dataclass(frozen=True, eq=False)
class SupportedResponse:
    """The beam on its joints under unit forces at each end.

    Attributes:
        condensed: the free beam.
        displacement: (3 joints, 1 + rows, lines) at the joints, m/N.
        force: the same shape, z times it: reaction of the joints, N/N.
        accelerance: (rows, lines) as read by the accelerometer, (m/s^2)/N.
    """

    condensed: CondensedBeam
    displacement: Complex
    force: Complex
    accelerance: Complex


def times_fields(rows: Real, fields: Complex) -> Complex:
    """(rows, lines) real `rows` (rows, N) times complex `fields` (N, lines), without making the rows complex."""
    product = rows @ np.ascontiguousarray(fields).view(np.float64)
    return np.asarray(product.view(np.complex128))


def _receptance(compliance: Complex, rows: Real, columns: Real) -> Complex:
    """(rows, columns, lines) sum over free modes."""
    products = (rows[:, None, :] * columns).reshape(-1, rows.shape[-1])
    return times_fields(products, compliance).reshape(len(rows), len(columns), -1)


def _by_line(matrices: Complex) -> Complex:
    return np.ascontiguousarray(np.moveaxis(matrices, -1, 0))
