"""Forward prediction: modes and accelerances of a beam on known joints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import eig

from analysis.dof import Direction, Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, FrequencyResponses, Real
from analysis.modes import Modes
from analysis.structure.beam import FreeBeam
from analysis.structure.joints import Joint
from analysis.structure.supported_beam import SupportedBeam

MARGIN = 1.1  # starting values are sought so far above the highest frequency asked for
ITERATIONS = 30
CONVERGED = 1e-12  # relative change of a pole


def eigensolution(
    free_beam: FreeBeam,
    joints: Sequence[Joint],
    highest_frequency: float,
    dofs: Sequence[Dof] | None = None,
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
    supported = SupportedBeam.of(free_beam, joints, highest_frequency)
    found = [_refined(supported, start) for start in _starting_poles(supported, MARGIN * highest_frequency)]
    poles = np.array([pole for pole, _ in found], dtype=complex)
    low_modes = np.array([vector for _, vector in found], dtype=complex).reshape(poles.size, supported.low)

    order = np.argsort(poles.imag)
    poles, low_modes = poles[order], low_modes[order]
    same = np.abs(np.diff(poles)) < 1e-9 * np.abs(poles[1:])
    if np.any(same):
        twice = poles[1:][same].imag / (2 * np.pi)
        raise AnalysisError(f"two modes at {twice.round(3).tolist()} Hz could not be told apart")

    wanted = dofs if dofs is not None else _in_plane(len(free_beam.mesh.named))
    rows = [free_beam.mesh.degree(dof) for dof in wanted]
    modes = Modes(poles, supported.shapes(poles, low_modes)[:, rows], tuple(wanted))
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
    supported = SupportedBeam.of(free_beam, joints, float(np.max(frequency, initial=0.0)))
    poles: Complex = np.asarray(decay + 2j * np.pi * frequency)
    output, rows = free_beam.mesh.degree(response), [free_beam.mesh.degree(dof) for dof in inputs]
    try:
        receptance = supported.receptance(poles, output, rows)
    except np.linalg.LinAlgError as error:
        raise AnalysisError("the beam is not held against every rigid motion: leave out 0 Hz") from error
    return FrequencyResponses(frequency, poles**2 * receptance, response, tuple(inputs), decay=decay)


def _in_plane(nodes: int) -> tuple[Dof, ...]:
    return tuple(Dof(node, direction) for node in range(1, nodes + 1) for direction in (Direction.X, Direction.Y))


def _starting_poles(supported: SupportedBeam, highest_frequency: float) -> Complex:
    """Poles up to about `highest_frequency`, Hz, with the high modes' flexibility taken as static."""
    low = supported.low
    rate = supported.free.damping_rate[:low]
    static = supported.dynamic_stiffness(np.zeros((), dtype=complex))
    companion = np.block([[np.zeros((low, low)), np.eye(low)], [-static, -np.diag(rate)]])
    poles = np.linalg.eigvals(companion)
    oscillating = (poles.imag > 0) & ((poles**2).real < 0)
    return np.asarray(poles[oscillating & (np.sqrt(np.abs(poles**2)) <= 2 * np.pi * highest_frequency)])


def _refined(supported: SupportedBeam, pole: complex) -> tuple[complex, Complex]:
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
