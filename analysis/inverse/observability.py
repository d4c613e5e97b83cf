"""Least covariance of joint terms from modes and from accelerances, without prior knowledge of the joints.

`modal_bound` is the Cramer-Rao bound: the inverse of the Fisher information of poles and shape components about the
terms of all joints, with the scale of each shape unknown and no assumption about the longitudinal motion. On the
paper's bench only k11(I) + k11(II) is determined, because the beam hardly stretches, as `undetermined_terms` finds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.inverse.covariance_propagation import ModalUncertainty, pole_change
from analysis.inverse.expansion import JointMotion, joint_degrees, joint_motion, measured_degrees
from analysis.inverse.joint_parameters import HALF
from analysis.inverse.regression import TERMS, UPPER
from analysis.inverse.response_likelihood import Information
from analysis.inverse.undetermined_terms import (
    KnownInSum,
    LeftBy,
    Reasons,
    reasons_array,
    too_wide,
    undetermined,
    widths,
)
from analysis.modes import Modes
from analysis.structure.beam import FreeBeam
from analysis.structure.joints import Joint

WIDER = 2.0  # ratio of two half-widths from which the larger is named as the cause
UNKNOWN = 1e6  # standard deviation of a term that nothing determines, in units of `stiffness_unit`
EXACT = 1e-6  # least standard deviation of a shape component, relative to the largest


def modal_bound(
    free_beam: FreeBeam,
    joints: Sequence[Joint],
    modes: Modes,
    measured: Sequence[Dof],
    uncertainty: ModalUncertainty,
) -> Real:
    """(12 joints, 12 joints) smallest covariance that any unbiased estimate from such modes can have.

    Args:
        free_beam: the beam without joints.
        joints: at which the bound is taken.
        modes: those of `free_beam` on `joints`, from `forward.eigensolution`. Measured modes do not solve the model
            exactly, and every inconsistency would count as information.
        measured: components of the shapes that are used.
        uncertainty: of the modes' data, for the scale of these shapes.

    Raises:
        AnalysisError: the components do not determine the motion of the joints.
    """
    nodes = [joint.node for joint in joints]
    shapes = np.stack([modes.at(dof) for dof in measured], axis=1)
    motion = joint_motion(free_beam, modes.poles, shapes, measured, nodes)
    in_poles, in_shapes = _model_change(free_beam, joints, modes, motion, measured)

    per_data = pole_change(modes, 2)  # d lambda / d(f, eta), inverted to d(f, eta) / d lambda
    two_by_two = np.stack([per_data.real, per_data.imag], axis=1)
    of_poles = np.linalg.solve(two_by_two, np.stack([in_poles.real, in_poles.imag], axis=1))
    design = _whiten(uncertainty.pole, np.asarray(of_poles).reshape(-1, of_poles.shape[-1]))
    information = design.T @ design
    for shape, change, covariance in zip(shapes, in_shapes, uncertainty.shape, strict=True):
        floor = (EXACT * np.max(np.abs(shape))) ** 2 * np.eye(len(covariance))
        scale = np.stack([np.concatenate([z.real, z.imag]) for z in (shape, 1j * shape)], axis=1)
        columns = _whiten(covariance + floor, np.column_stack([np.concatenate([change.real, change.imag]), scale]))
        free, _ = np.linalg.qr(columns[:, -2:])
        seen = columns[:, :-2] - free @ (free.T @ columns[:, :-2])
        information += seen.T @ seen

    return bounded_inverse(information, term_units(free_beam, len(joints)))


def term_units(free_beam: FreeBeam, joints: int) -> Real:
    """(12 joints,) units of the terms of all joints: EI/L^3, EI/L^2 and EI/L."""
    return np.tile([free_beam.beam.stiffness_unit[place] for place in UPPER], 2 * joints)


def bounded_inverse(information: Real, unit: Real) -> Real:
    """Inverse of a Fisher information (terms, terms); undetermined terms are known to `UNKNOWN` units (terms,).

    Eigenvalues below rounding are raised to it, so all are positive.
    """
    scaled = information * np.outer(unit, unit) + np.eye(unit.size) / UNKNOWN**2
    balance = 1 / np.sqrt(np.diag(scaled))
    strength, axes = np.linalg.eigh(scaled * np.outer(balance, balance))
    root = axes / np.sqrt(np.maximum(strength, unit.size * np.finfo(float).eps * strength[-1]))
    root *= (balance * unit)[:, None]
    return np.asarray(root @ root.T)


def _model_change(
    free_beam: FreeBeam, joints: Sequence[Joint], modes: Modes, motion: JointMotion, measured: Sequence[Dof]
) -> tuple[Complex, Complex]:
    """Derivatives of poles (modes, terms) and of measured components (modes, measured, terms) in all joint terms.

    A mode solves (1 + z H(lambda)) p = 0 with the joint forces p and the free beam's receptance H at the joints.
    """
    held = joint_degrees(free_beam, [joint.node for joint in joints])
    rows = measured_degrees(free_beam, measured)
    count = held.size
    stiffness = block_diag(*(joint.dynamic_stiffness for joint in joints))
    # change of all joints' z for a unit of each term
    terms = np.zeros((len(TERMS) * len(joints), count, count), dtype=complex)
    places = [(3 * joint + p, 3 * joint + q, f) for joint in range(len(joints)) for f in (1.0, 1j) for p, q in UPPER]
    for number, (row, column, factor) in enumerate(places):
        terms[number, [row, column], [column, row]] = factor
    poles = modes.poles
    at_joints, slope = (f(poles, held, held) for f in (free_beam.receptance, free_beam.receptance_slope))
    at_rows, rows_slope = (f(poles, rows, held) for f in (free_beam.receptance, free_beam.receptance_slope))

    of_poles = np.empty((poles.size, len(terms)), dtype=complex)
    of_shapes = np.empty((poles.size, len(measured), len(terms)), dtype=complex)
    for mode in range(poles.size):
        u = motion.displacement[mode].ravel()
        p = motion.force[mode].ravel()
        # unknown change of p and of lambda; the last row keeps the scale of p
        bordered = np.zeros((count + 1, count + 1), dtype=complex)
        bordered[:count, :count] = np.eye(count) + stiffness @ at_joints[mode]
        bordered[:count, count] = stiffness @ slope[mode] @ p
        bordered[count, :count] = p.conj()
        size = np.concatenate([np.abs(np.diag(stiffness)), [1.0]])
        size[size == 0] = 1.0
        right = np.concatenate([-(terms @ u).T, np.zeros((1, len(terms)))])
        change = np.linalg.solve(bordered / size[:, None], right / size[:, None])
        of_poles[mode] = change[count]
        of_shapes[mode] = at_rows[mode] @ change[:count] + np.outer(rows_slope[mode] @ p, change[count])
    return of_poles, of_shapes


def _whiten(covariance: Real, columns: Real) -> Real:
    """L^-1 `columns` with covariance = L L^t."""
    scale = np.sqrt(np.diag(covariance))
    try:
        factor = np.linalg.cholesky(covariance / np.outer(scale, scale))
    except np.linalg.LinAlgError as error:
        raise AnalysisError("a covariance of the modes is not positive definite") from error
    return np.asarray(np.linalg.solve(factor, columns / scale[:, None]))


@dataclass(frozen=True, eq=False)
class TermBound:
    """Cramer-Rao bounds of the terms of all joints, (12 joints, 12 joints), in the order of `regression.TERMS`.

    Attributes:
        as_drawn: where the bench is known exactly.
        within_tolerances: where it deviates by what its tolerances allow.
    """

    as_drawn: Real
    within_tolerances: Real

    def undetermined(self, values: Real, names: Sequence[str]) -> Reasons:
        """(12 joints,) why the data do not determine a term on its own, to a quarter of its value; None where they do.

        The common factor of gain, E and rho correlates all terms without making any a sum of others. So terms that are
        known in a sum only are judged with the bench as drawn. Of the others, the cause that leaves the wider interval
        is named: more blows do not help a term that the tolerances leave unknown.

        Args:
            values: (12 joints,) of the terms.
            names: (12 joints,) of the terms, as from `term_names`.
        """
        by_data = undetermined(self.as_drawn, values, names)
        by_bench = too_wide(self.within_tolerances, values, LeftBy.TOLERANCES)
        wider = widths(self.within_tolerances, values) > WIDER * widths(self.as_drawn, values)
        return reasons_array(
            [
                bench if data is None or (wide and not isinstance(data, KnownInSum)) else data
                for data, bench, wide in zip(by_data, by_bench, wider, strict=True)
            ]
        )


def term_bound(information: Information, tolerance: Real, unit: Real) -> TermBound:
    """Bounds from the products of derivatives.

    Args:
        information: over upper terms of z, then active deviations.
        tolerance: (active, active) covariance of the latter.
        unit: (12 joints,) of the terms.
    """
    joints = unit.size // (2 * HALF)
    chain = block_diag(*joints * [np.hstack([np.eye(HALF), 1j * np.eye(HALF)])], np.eye(len(tolerance)))
    normal = np.real(chain.conj().T @ information.products @ chain)
    count = unit.size
    terms, across, others = normal[:count, :count], normal[:count, count:], normal[count:, count:]
    lost = np.zeros_like(terms)
    if tolerance.size:
        root = np.linalg.cholesky(tolerance)
        seen = across @ root
        lost = seen @ np.linalg.solve(root.T @ others @ root + np.eye(len(root)), seen.T)
    return TermBound(bounded_inverse(terms, unit), bounded_inverse(terms - lost, unit))
