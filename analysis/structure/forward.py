"""Forward prediction: the beam on known joints, its modes and its accelerances.

The free modes far above the band of interest respond without resonance, so they are eliminated: they act on the joints
as a flexibility R(lambda) in series. The dynamic stiffness over the few low free modes is left. It is exact at every
lambda, and small enough for thousands of lines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, eig

from analysis.dof import Direction, Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, FrequencyResponses, Real
from analysis.modes import Modes
from analysis.structure.beam import FreeBeam
from analysis.structure.joints import Joint
from analysis.structure.setup import RIGID_MODES

LOW_BAND = 3.0  # times the highest frequency of interest, up to which free modes stay as unknowns
MARGIN = 1.1  # times the highest frequency asked for, up to which starting values are searched
ITERATIONS = 30
CONVERGED = 1e-12  # relative change of a pole


@dataclass(frozen=True, eq=False)
class ReducedBeam:
    """A free beam on joints: (Z(lambda) + z) u = f of Eqs. (40), (41), condensed.

    Attributes:
        free: the beam without joints.
        degrees: (3 joints,) rows of the joints' freedoms.
        joint_stiffness: (3 joints, 3 joints) z = k + i h.
        low: number of free modes that stay as unknowns.
    """

    free: FreeBeam
    degrees: NDArray[np.intp]
    joint_stiffness: Complex
    low: int

    @classmethod
    def of(cls, free: FreeBeam, joints: Sequence[Joint], highest_frequency: float) -> ReducedBeam:
        """Put `free` on `joints` for frequencies up to `highest_frequency`, Hz.

        Raises:
            AnalysisError: two joints share a node, or a node is unknown.
        """
        nodes = [joint.node for joint in joints]
        if len(set(nodes)) < len(nodes):
            raise AnalysisError(f"joints sit at nodes {nodes}; put what shares a node into one joint")
        degrees = [free.mesh.node_degrees(node) for node in nodes]
        limit = (2 * np.pi * LOW_BAND * highest_frequency) ** 2
        return cls(
            free=free,
            degrees=np.concatenate(degrees) if degrees else np.zeros(0, dtype=np.intp),
            joint_stiffness=block_diag(*(joint.dynamic_stiffness for joint in joints))
            if joints
            else np.zeros((0, 0), dtype=complex),
            low=max(RIGID_MODES, int(np.searchsorted(free.squared_frequency, limit))),
        )

    def dynamic_stiffness(self, poles: Complex) -> Complex:
        """(..., low, low) D(lambda) over the mass-normalised low free modes, 1/s^2, the high ones in the joints."""
        at_joints = self._low_at(self.degrees)
        series = self._in_series(poles)
        return np.asarray(
            _diagonal(self.free.modal_stiffness(poles)[..., : self.low]) + at_joints.T @ series @ at_joints
        )

    def slope(self, poles: Complex) -> Complex:
        """(..., low, low) derivative of `dynamic_stiffness` by lambda, 1/s."""
        at_joints = self._low_at(self.degrees)
        series = self._in_series(poles)
        lam = np.asarray(poles)[..., None]
        rate = 2 * lam + self.free.damping_rate
        weight = -rate[..., self.low :] / self._high_stiffness(poles) ** 2
        change = -series @ self._high_flexibility(weight, self.degrees, self.degrees) @ series
        return np.asarray(_diagonal(rate[..., : self.low]) + at_joints.T @ change @ at_joints)

    def shapes(self, poles: Complex, low_modes: Complex) -> Complex:
        """(modes, N) whole shapes, from poles (modes,) and their (modes, low) components of free modes."""
        force = np.einsum("mij,mj->mi", self._in_series(poles), low_modes @ self._low_at(self.degrees).T)
        high = -(force @ self._high_at(self.degrees)) / self._high_stiffness(poles)
        return np.asarray(np.concatenate([low_modes, high], axis=-1) @ self.free.shapes.T)

    def receptance(self, poles: Complex, output: int, inputs: Sequence[int]) -> Complex:
        """(inputs, lines) displacement at row `output` for unit forces at rows `inputs`, m/N, at lambda (lines,).

        One solution a line serves all inputs, by reciprocity of the beam; joints need not be symmetric.
        """
        flipped = ReducedBeam(self.free, self.degrees, self.joint_stiffness.T, self.low)
        return flipped._column(np.asarray(poles, dtype=complex), output, np.asarray(inputs, dtype=np.intp)).T

    def _column(self, poles: Complex, source: int, receivers: NDArray[np.intp]) -> Complex:
        """(lines, receivers) displacement for a unit force at row `source`."""
        at_joints = self._low_at(self.degrees)
        series = self._in_series(poles)
        weight = 1 / self._high_stiffness(poles)
        one = np.array([source])
        reach = self._high_flexibility(weight, self.degrees, one)
        load = self._low_at(one).T - at_joints.T @ series @ reach
        low_modes = np.linalg.solve(self.dynamic_stiffness(poles), load)
        force = series @ (at_joints @ low_modes + reach)
        displacement = (
            self._low_at(receivers) @ low_modes
            + self._high_flexibility(weight, receivers, one)
            - self._high_flexibility(weight, receivers, self.degrees) @ force
        )
        return np.asarray(displacement[..., 0])

    def _in_series(self, poles: Complex) -> Complex:
        """(..., 3 joints, 3 joints) z (1 + R z)^-1: the joints in series with the high modes' flexibility."""
        flexibility = self._high_flexibility(1 / self._high_stiffness(poles), self.degrees, self.degrees)
        z = self.joint_stiffness
        return np.asarray(np.linalg.solve(np.eye(len(z)) + z @ flexibility, z + np.zeros_like(flexibility)))

    def _high_flexibility(self, weight: Complex, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Complex:
        """(..., rows, columns) sum over high modes of shape, weight (..., high), shape."""
        product = self._high_at(rows)[:, None, :] * self._high_at(columns)[None, :, :]
        flat = weight @ product.reshape(-1, product.shape[-1]).T
        return np.asarray(flat.reshape(*weight.shape[:-1], rows.size, columns.size))

    def _low_at(self, rows: NDArray[np.intp]) -> Real:
        return self.free.shapes[rows, : self.low]

    def _high_at(self, rows: NDArray[np.intp]) -> Real:
        return self.free.shapes[rows, self.low :]

    def _high_stiffness(self, poles: Complex) -> Complex:
        return self.free.modal_stiffness(poles)[..., self.low :]


def _diagonal(values: Complex) -> Complex:
    """(..., n, n) matrices with `values` (..., n) on their diagonals."""
    return np.asarray(values[..., None] * np.eye(values.shape[-1]))


def eigensolution(
    free_beam: FreeBeam, joints: Sequence[Joint], highest_frequency: float, dofs: Sequence[Dof] | None = None
) -> Modes:
    """Complex modes of the supported beam, Eqs. (17), (41), those with positive imaginary part.

    Structural damping of the joints and the beam's C are both in; nothing is assumed small. Shapes are
    scaled to unit modal mass: psi^T (2 lambda M + C) psi = 2 lambda.

    Args:
        free_beam: the beam without joints.
        joints: any number, at any nodes.
        highest_frequency: of the modes wanted, Hz.
        dofs: components wanted of each shape; x and y at all nodes where not given.

    Raises:
        AnalysisError: the iteration for a pole does not settle, or two of them end in the same mode.
    """
    supported = ReducedBeam.of(free_beam, joints, highest_frequency)
    found = [_refined(supported, start) for start in _starting_poles(supported, MARGIN * highest_frequency)]
    poles = np.array([pole for pole, _ in found], dtype=complex)
    low_modes = np.array([vector for _, vector in found], dtype=complex).reshape(poles.size, supported.low)

    order = np.argsort(poles.imag)
    poles, low_modes = poles[order], low_modes[order]
    same = np.abs(np.diff(poles)) < 1e-9 * np.abs(poles[1:])
    if np.any(same):
        twice = poles[1:][same].imag / (2 * np.pi)
        raise AnalysisError(f"two modes at {twice.round(3).tolist()} Hz could not be distinguished")

    if dofs is None:
        nodes = range(1, len(free_beam.mesh.named) + 1)
        dofs = [Dof(node, direction) for node in nodes for direction in (Direction.X, Direction.Y)]
    rows = [free_beam.mesh.degree(dof) for dof in dofs]
    modes = Modes(poles, supported.shapes(poles, low_modes)[:, rows], tuple(dofs))
    keep = modes.frequency <= highest_frequency
    return Modes(modes.poles[keep], modes.shapes[keep], modes.dofs)


def accelerance(
    free_beam: FreeBeam,
    joints: Sequence[Joint],
    frequency: Real,
    response: Dof,
    inputs: Sequence[Dof],
    decay: float = 0.0,
) -> FrequencyResponses:
    """Accelerances of the supported beam, Eq. (46), exact for all modes of the mesh.

    Args:
        free_beam: the beam without joints.
        joints: any number, at any nodes.
        frequency: (lines,) Hz, rising, none negative; a beam that is not held has no answer at 0 Hz.
        response: where the accelerometer sits.
        inputs: (rows,) where the hammer strikes.
        decay: of the exponential window through which they are seen, 1/s.

    Raises:
        AnalysisError: a node is unknown, a frequency is negative, or the beam is free and one is zero.
    """
    frequency = np.asarray(frequency, dtype=float)
    if frequency.size and (np.min(frequency) < 0 or not np.all(np.isfinite(frequency))):
        raise AnalysisError("frequencies must be finite and not negative, in Hz")
    supported = ReducedBeam.of(free_beam, joints, float(np.max(frequency, initial=0.0)))
    poles: Complex = np.asarray(decay + 2j * np.pi * frequency)
    output, rows = free_beam.mesh.degree(response), [free_beam.mesh.degree(dof) for dof in inputs]
    try:
        receptance = supported.receptance(poles, output, rows)
    except np.linalg.LinAlgError as error:
        raise AnalysisError("the beam is not held against every rigid motion: leave out 0 Hz") from error
    return FrequencyResponses(frequency, poles**2 * receptance, response, tuple(inputs), decay=decay)


def _starting_poles(supported: ReducedBeam, highest_frequency: float) -> Complex:
    """Poles up to about `highest_frequency`, Hz, with the high modes' flexibility taken as static."""
    low = supported.low
    rate = supported.free.damping_rate[:low]
    static = supported.dynamic_stiffness(np.zeros((), dtype=complex))
    companion = np.block([[np.zeros((low, low)), np.eye(low)], [-static, -np.diag(rate)]])
    poles = np.linalg.eigvals(companion)
    oscillating = (poles.imag > 0) & ((poles**2).real < 0)
    return np.asarray(poles[oscillating & (np.sqrt(np.abs(poles**2)) <= 2 * np.pi * highest_frequency)])


def _refined(supported: ReducedBeam, pole: complex) -> tuple[complex, Complex]:
    """Pole and (low,) vector of the exact problem next to `pole`, by successive linear problems."""
    for _ in range(ITERATIONS):
        lam = np.asarray(pole, dtype=complex)
        balance = 1 / np.sqrt(abs(pole) ** 2 + supported.free.squared_frequency[: supported.low])
        slope = balance[:, None] * supported.slope(lam) * balance
        steps, vectors = eig(balance[:, None] * supported.dynamic_stiffness(lam) * balance, slope)
        nearest = int(np.argmin(np.abs(steps)))
        pole = complex(pole - steps[nearest])
        if abs(steps[nearest]) <= CONVERGED * abs(pole):
            vector = vectors[:, nearest]
            return pole, balance * vector * np.sqrt(2 * pole / (vector @ slope @ vector))
    raise AnalysisError(f"the mode near {pole.imag / (2 * np.pi):.1f} Hz did not settle in {ITERATIONS} iterations")
