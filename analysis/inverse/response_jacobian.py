"""Exact derivatives of accelerances in the terms of the joints and in the deviations of the bench.

All follow from dH = -u_a^T dZ u_s, with u_a and u_s the motion under unit forces at the accelerometer and at a blow.
Only u_a is needed as a whole field; each row then costs one product. Finite differences are not enough: in Young's
modulus they break the exact degeneracy of a common factor on k, E, rho and the gain, and so create information.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from analysis.frequency_response import Complex
from analysis.inverse.frequency_laws import growth_slopes
from analysis.inverse.regression import UPPER
from analysis.inverse.response_model import SupportedResponse, times_fields
from analysis.inverse.tolerances import COMMON, law_places


def term_columns(response: SupportedResponse) -> Complex:
    """(6 joints, rows, lines) derivatives of the accelerances in the upper terms of each joint's z = k + i h at 100 Hz.

    The derivative in a damping h is i times that in k, for the accelerance is analytic in z.
    """
    u = response.displacement
    sensor, blows = u[:, :1], u[:, 1:]
    factor = -_to_accelerance(response)
    columns = np.empty((2 * len(u), *response.accelerance.shape), dtype=complex)
    weighted = factor * response.condensed.growth[:, None] * sensor
    for joint in range(len(u) // 3):
        for place, (p, q) in enumerate(UPPER):
            first, second = 3 * joint + p, 3 * joint + q
            column = columns[len(UPPER) * joint + place]
            np.multiply(weighted[first], blows[second], out=column)
            if p != q:
                column += weighted[second] * blows[first]
    return columns


def deviation_columns(response: SupportedResponse, active: NDArray[np.bool_]) -> Complex:
    """(active, rows, lines) derivatives of the accelerances in the deviations of the bench.

    Args:
        response: at the deviations of its condensed beam.
        active: (4 + 5 joints + 2 rows,) which of them are wanted, in the order of `tolerances.Deviations`.
    """
    if not np.any(active):
        return np.empty((0, *response.accelerance.shape), dtype=complex)
    return np.array(list(_columns(response, active)))


def _columns(response: SupportedResponse, active: NDArray[np.bool_]) -> Iterator[Complex]:
    beam = response.condensed
    free, model, deviations = beam.model.free_beam, beam.model, beam.deviations
    factor = _to_accelerance(response)
    sensor = beam.compliance * (beam.at_ends[:1].T - times_fields(beam.at_joints.T, response.force[:, 0]))
    e, r, lam = 1 + deviations.youngs_modulus, 1 + deviations.density, model.poles

    if active[0]:
        yield response.accelerance / (1 + deviations.gain)
    damping = np.outer(free.damping_rate, lam) / 2
    of_kinks = (model.kink_slope(deviations) * model.kink_side(deviations))[1:, None] * factor
    if active[1]:
        shape = sensor * (free.squared_frequency[:, None] + np.sqrt(r / e) * damping)
        yield -factor * (_along(response, shape) + model.kinks(deviations)[1:, None] / e)
    if active[2]:
        yield -factor * _along(response, sensor * (lam**2 + np.sqrt(e / r) * damping))
    if active[3]:
        yield factor * _along(response, np.broadcast_to(beam.end_slopes[0][:, None], sensor.shape)) + of_kinks
    joints = len(model.joint_nodes)
    laws = law_places(joints)
    for joint in np.flatnonzero(active[len(COMMON) : laws.start]):
        at = slice(3 * joint, 3 * joint + 3)
        slopes, force = beam.joint_slopes[at], response.force[at]
        at_sensor = np.einsum("jl,jsl->sl", times_fields(slopes, sensor), force[:, 1:])
        yield -factor * (at_sensor + _along(response, times_fields(slopes.T, force[:, 0])))
    growing = growth_slopes(deviations.joint_laws, beam.log_frequency).reshape(-1, model.frequency.size)
    for place in np.flatnonzero(active[laws]):
        at = slice(3 * (place % joints), 3 * (place % joints) + 3)
        given = np.einsum("jl,jsl->sl", response.displacement[at, 0], response.force[at, 1:])
        yield -factor * growing[place] * given
    moved = np.concatenate([beam.end_slopes[1:], beam.blow_turns])
    for place in np.flatnonzero(active[laws.stop :]):
        column, row = np.zeros_like(response.accelerance), place % len(model.inputs)
        column[row] = factor * times_fields(moved[place][None], sensor)[0]
        if place == row:
            column[row] -= of_kinks[row]
        yield column


def _along(response: SupportedResponse, load: Complex) -> Complex:
    """(rows, lines) sum over free modes of `load` (N, lines) times the motion under each blow, by reciprocity."""
    beam = response.condensed
    field = beam.compliance * load
    direct = times_fields(beam.at_ends[1:], field)
    return np.asarray(direct - np.einsum("jl,jsl->sl", times_fields(beam.at_joints, field), response.force[:, 1:]))


def _to_accelerance(response: SupportedResponse) -> Complex:
    """(lines,) factor from a receptance to the reading of the accelerometer."""
    beam = response.condensed
    return np.asarray(beam.model.poles**2 * (1 + beam.deviations.gain))
