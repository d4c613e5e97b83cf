"""How the uncertainty of measured modes reaches the joint matrices, to first order.

`propagated_covariance` follows the covariance of poles and shapes through averaging, expansion and the
weighted regression. The regression's own covariance of Section 7 is another one: it is estimated from the
residuals, so it contains neither the accuracy of each measured mode nor the effect of the averaging.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.inverse import regression
from analysis.inverse.expansion import force_solution, joint_degrees, measured_degrees
from analysis.inverse.longitudinal_averaging import averaged, averaged_change
from analysis.modes import Modes
from analysis.structure.beam import FreeBeam


@dataclass(frozen=True, eq=False)
class ModalUncertainty:
    """Covariance of what is measured of each mode.

    Attributes:
        pole: (2 modes, 2 modes) of [f_1, eta_1, f_2, eta_2, ...], Hz and 1.
        shape: (modes, 2 measured, 2 measured) of [real parts, imaginary parts] of each shape.
    """

    pole: Real
    shape: Real

    @classmethod
    def of(cls, modes: Modes, measured: Sequence[Dof]) -> ModalUncertainty | None:
        """The uncertainty that `modes` carry, or None where they carry none."""
        if modes.pole_covariance is None or modes.shape_covariance is None:
            return None
        places = np.array([modes.dofs.index(dof) for dof in measured])
        both = np.concatenate([places, places + len(modes.dofs)])
        return cls(modes.pole_covariance, modes.shape_covariance[:, both[:, None], both])

    @classmethod
    def nominal(
        cls,
        modes: Modes,
        measured: Sequence[Dof],
        frequency: float = 5e-4,
        loss_factor: float = 2e-3,
        shape: float = 0.01,
    ) -> ModalUncertainty:
        """What a careful test achieves: standard deviations relative to the frequency, absolute in the loss
        factor, and relative to the largest component of each shape.
        """
        pole = np.stack([frequency * modes.frequency, np.full(modes.poles.size, loss_factor)], axis=1).ravel()
        largest = np.max(np.abs(np.stack([modes.at(dof) for dof in measured], axis=1)), axis=1)
        return cls(
            np.diag(pole**2),
            (shape * largest[:, None, None]) ** 2 * np.eye(2 * len(measured)) + np.zeros((len(largest), 1, 1)),
        )


def propagated_covariance(
    free_beam: FreeBeam,
    modes: Modes,
    joint_nodes: Sequence[int],
    measured: Sequence[Dof],
    average_longitudinal: bool,
    uncertainty: ModalUncertainty | None = None,
) -> Real:
    """(12 joints, 12 joints) covariance of the identified terms of all joints, from that of the modes.

    Args:
        free_beam: the beam without joints.
        modes: as measured.
        joint_nodes: (joints,) numbered from 1.
        measured: components of the shapes that are used.
        average_longitudinal: whether their x components are averaged.
        uncertainty: of the modes; None: the one that they carry.

    Raises:
        AnalysisError: nothing is known of the modes' uncertainty, or the joints cannot be identified.
    """
    known = uncertainty or ModalUncertainty.of(modes, measured)
    if known is None:
        raise AnalysisError("the modes carry no covariance of poles and shapes to propagate")
    jacobian = sensitivity(free_beam, modes, joint_nodes, measured, average_longitudinal)
    of_poles = jacobian[:, :, :2].reshape(len(jacobian), -1)
    covariance = of_poles @ known.pole @ of_poles.T
    for mode, shape_covariance in enumerate(known.shape):
        of_shape = jacobian[:, mode, 2:]
        covariance += of_shape @ shape_covariance @ of_shape.T
    return np.asarray(covariance)


def sensitivity(
    free_beam: FreeBeam,
    modes: Modes,
    joint_nodes: Sequence[int],
    measured: Sequence[Dof],
    average_longitudinal: bool,
) -> Real:
    """(12 joints, modes, 2 + 2 measured) derivatives of the identified terms in each mode's data.

    The data of a mode are [f in Hz, eta, real parts, imaginary parts of its components].
    """
    displacement, force, change_u, change_f = _motion_and_change(
        free_beam, modes, joint_nodes, measured, average_longitudinal
    )
    return np.concatenate(
        [
            _term_sensitivity(displacement[:, at], force[:, at], change_u[..., at], change_f[..., at])
            for at in (slice(3 * joint, 3 * joint + 3) for joint in range(len(joint_nodes)))
        ]
    )


def pole_change(modes: Modes, directions: int) -> Complex:
    """(modes, directions) derivative of each pole in its f (Hz), its eta and, zero, in the rest of its data."""
    change = np.zeros((modes.poles.size, directions), dtype=complex)
    change[:, 0] = modes.poles / modes.frequency
    change[:, 1] = modes.poles * 0.5j / (1 + 1j * modes.loss_factor)
    return change


def _motion_and_change(
    free_beam: FreeBeam, modes: Modes, joint_nodes: Sequence[int], measured: Sequence[Dof], average_longitudinal: bool
) -> tuple[Complex, Complex, Complex, Complex]:
    """Displacement and force at the joints (modes, 3 joints), and their changes (modes, directions, 3 joints)."""
    count, poles = len(measured), modes.poles
    shapes = np.stack([modes.at(dof) for dof in measured], axis=1)
    direct = np.concatenate([np.zeros((2, count)), np.eye(count), 1j * np.eye(count)])
    change = np.tile(direct, (poles.size, 1, 1))
    if average_longitudinal:
        shapes, change = averaged(shapes, measured), averaged_change(shapes, change, measured)

    rows, joints = measured_degrees(free_beam, measured), joint_degrees(free_beam, joint_nodes)
    solution = force_solution(free_beam, poles, measured, joint_nodes)
    reach_slope = free_beam.receptance_slope(poles, rows, joints)
    force = np.einsum("mqi,mi->mq", solution, shapes)
    left_over = shapes - np.einsum("miq,mq->mi", free_beam.receptance(poles, rows, joints), force)
    step = pole_change(modes, change.shape[1])[..., None]
    # derivative of a pseudo-inverse: the second part is zero where there are just enough components
    by_misfit = np.einsum("mqi,mpi,mjp,mj->mq", solution, solution.conj(), reach_slope.conj(), left_over)
    change_f = (
        np.einsum("mqi,mdi->mdq", solution, change - step * np.einsum("miq,mq->mi", reach_slope, force)[:, None])
        + step.conj() * by_misfit[:, None]
    )
    flexibility = free_beam.receptance(poles, joints, joints)
    displacement = np.einsum("mpq,mq->mp", flexibility, force)
    slope = np.einsum("mpq,mq->mp", free_beam.receptance_slope(poles, joints, joints), force)
    change_u = np.einsum("mpq,mdq->mdp", flexibility, change_f) + step * slope[:, None]
    return displacement, force, change_u, change_f


def _term_sensitivity(displacement: Complex, force: Complex, change_u: Complex, change_f: Complex) -> Real:
    """(12, modes, directions) derivatives of one joint's terms, from the changes (modes, directions, 3)."""
    modes = len(displacement)
    coefficients, right = regression.equations(displacement, force)
    weight = regression.weights(coefficients)
    transform = regression.symmetry()
    design, observed = weight[:, None] * coefficients @ transform, weight * right
    scale = np.linalg.norm(design, axis=0)
    inverse = np.linalg.pinv(design / scale) / scale[:, None]
    terms = inverse @ observed
    residual = observed - design @ terms

    d_coefficients, d_right = _equation_change(displacement, force, change_u, change_f)
    rows = (modes, 1, 18)
    greatest = np.argmax(np.abs(coefficients), axis=1)
    signed = np.sign(np.take_along_axis(coefficients, greatest[:, None], axis=1)).reshape(*rows)
    d_greatest = np.take_along_axis(d_coefficients, greatest.reshape(*rows, 1), axis=-1)[..., 0]
    w = weight.reshape(rows)
    d_weight = -(w**2) * signed * d_greatest
    d_design = (
        d_weight[..., None] * coefficients.reshape(modes, 1, 18, 18) + w[..., None] * d_coefficients
    ) @ transform
    d_observed = d_weight * right.reshape(rows) + w * d_right

    by_rows = inverse.reshape(12, modes, 18)
    return np.asarray(
        np.einsum("tmr,mdr->tmd", by_rows, d_observed - d_design @ terms)
        + np.einsum(
            "ts,mds->tmd", inverse @ inverse.T, np.einsum("mdrs,mr->mds", d_design, residual.reshape(modes, 18))
        )
    )


def _equation_change(displacement: Complex, force: Complex, change_u: Complex, change_f: Complex) -> tuple[Real, Real]:
    """Changes of Y (modes, directions, 18, 18) and of its right side (modes, directions, 18).

    Both are quadratic in the motion, so half the difference between plus and minus a change is the
    derivative in it, exactly, however large the change.
    """
    modes, directions, _ = change_u.shape
    size = np.linalg.norm(change_u, axis=-1) / np.linalg.norm(displacement, axis=-1)[:, None]
    factor = np.where(size > 0, 1 / np.where(size > 0, size, 1.0), 1.0)[..., None]

    def moved(sign: float) -> tuple[Real, Real]:
        u = displacement[:, None] + sign * factor * change_u
        f = force[:, None] + sign * factor * change_f
        return regression.equations(u.reshape(-1, 3), f.reshape(-1, 3))

    (up, right_up), (down, right_down) = moved(+1.0), moved(-1.0)
    d_coefficients = (up - down).reshape(modes, directions, 18, 18) / (2 * factor[..., None])
    return d_coefficients, (right_up - right_down).reshape(modes, directions, 18) / (2 * factor)
