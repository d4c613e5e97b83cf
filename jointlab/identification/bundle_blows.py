"""Single blows of a bundle: their forces, and how far each moves the average of its row.

A file does not name the set of its blow, so blows are used only where a bundle has a single set.
"""

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from analysis.frequency_response import Complex
from analysis.modal.spectra import Windows, responses_from_blows
from jointlab.identification.measurement import PointForces, dof
from store.dof import StoredDof
from store.exchange.blow_file import BundleBlow
from store.exchange.blow_window import stated_window
from store.measurements.frequency_responses import FrequencyResponseSet

SAME = 3.0
"""Largest difference, in standard deviations, of the average of the blows in the bundle from that of all blows."""


def forces_of_bundle(
    sets: Sequence[FrequencyResponseSet], blows: Sequence[BundleBlow]
) -> dict[int, tuple[PointForces, ...]]:
    """By set number, the force of the blows at each point; empty unless there is a record at every one."""
    struck = _by_point(sets, blows)
    return {
        number: tuple(
            PointForces(dof(blow.point), blow.force[None, :], blow.sample_rate) for point in points for blow in point
        )
        for number, points in struck.items()
    }


def scatter_of_bundle(sets: Sequence[FrequencyResponseSet], blows: Sequence[BundleBlow]) -> dict[int, Complex]:
    """By set number, (rows, blows, lines) how far each blow moves the average of its row, (m/s^2)/N.

    Empty unless every point has four blows or more, all of one length and rate, whose averages are those of the set.
    Where the bundle has only some of the averaged blows, these stand for all.
    """
    found = {}
    for number, points in _by_point(sets, blows).items():
        scatter = _scatter(sets[0], points)
        if scatter is not None:
            kept = np.array([len(point) for point in points]) / sets[0].averages
            found[number] = scatter * np.sqrt(np.minimum(kept, 1.0))[:, None, None]
    return found


def _by_point(
    sets: Sequence[FrequencyResponseSet], blows: Sequence[BundleBlow]
) -> dict[int, tuple[list[BundleBlow], ...]]:
    """By number of the only set, the blows at each of its points."""
    struck = defaultdict[StoredDof, list[BundleBlow]](list)
    for blow in blows:
        struck[blow.point].append(blow)
    if len(sets) != 1 or not set(sets[0].inputs) <= set(struck):
        return {}
    return {sets[0].number: tuple(struck[point] for point in sets[0].inputs)}


def _scatter(measured: FrequencyResponseSet, points: Sequence[Sequence[BundleBlow]]) -> Complex | None:
    """(rows, blows, lines), computed from the blows; None where their average is not that of the set."""
    every = [blow for point in points for blow in point]
    if len({(blow.force.size, blow.sample_rate) for blow in every}) > 1:
        return None
    window = stated_window(measured.window, measured.block_seconds)[0]
    computed = responses_from_blows(
        [np.array([blow.force for blow in point]) for point in points],
        [np.array([blow.acceleration for blow in point]) for point in points],
        every[0].sample_rate,
        dof(measured.response),
        [dof(point) for point in measured.inputs],
        # a rate that was read from rounded times is off by a little; half a line is more than that
        float(measured.frequency[-1]) + 0.5 * every[0].sample_rate / every[0].force.size,
        pre_trigger=min(blow.trigger_index for blow in every),
        windows=Windows(window.force_seconds, window.decay),
    )
    if computed.frequency.shape != measured.frequency.shape or not np.allclose(computed.frequency, measured.frequency):
        return None
    if computed.scatter is None:
        return None
    off = np.linalg.norm(computed.accelerance - measured.accelerance, axis=1)
    return computed.scatter if np.all(off <= SAME * np.linalg.norm(computed.scatter, axis=(1, 2))) else None
