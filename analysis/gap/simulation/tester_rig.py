"""The tester's reading of a specimen, by the paper's model with effects on top of it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.bench import Loading
from analysis.gap.effect import Effect, Given
from analysis.gap.measurement import TesterPoints
from analysis.gap.simulation.baseline import Baseline

TURNS = 4
"""Iterations for the amplitude of a specimen in a compliant frame; each reduces the error to a third or less."""
Acting = Sequence[tuple[Effect, Given]]
"""Effects in the order in which they act, with their values."""


def tester_loading(points: TesterPoints) -> Loading:
    """The state of motion of the cylinders at the tester's points, moved as far as the machine moves."""
    return Loading(
        tester=True,
        frequency=points.frequency,
        amplitude=points.amplitude,
        blow_amplitudes=None,
        fraction=points.fraction,
        angled=points.angled,
    )


def reading_of_tester(baseline: Baseline, given: Given, acting: Acting, points: TesterPoints) -> Complex:
    """(points,) dynamic stiffness as the tester reads it, N/m.

    A compliant frame takes up a part of the machine's motion. Laws of amplitude use the motion that the specimen has.
    """
    loading = tester_loading(points)
    read, left = _read(baseline, given, acting, points, loading)
    follows = any(effect.follows_motion for effect, _ in acting)
    for _ in range(TURNS if follows and any(effect.reduces_motion for effect, _ in acting) else 0):
        moved = replace(loading, amplitude=left * points.amplitude)
        read, left = _read(baseline, given, acting, points, moved)
    return np.asarray(baseline.factor_in_tester(given, points) * read)


def _read(
    baseline: Baseline, given: Given, acting: Acting, points: TesterPoints, loading: Loading
) -> tuple[Complex, Real]:
    """(points,) the reading without the gain, and the part of the machine's motion that the specimen sees."""
    cylinders, mounting = baseline.cylinders(given), baseline.mounting(given)
    for effect, own in acting:
        cylinders = effect.cylinders(own, cylinders, loading)
        mounting = effect.mounting(own, mounting)
    weights, at = baseline.weights(given, mounting), (points.specimen, points.configuration)
    stiffness = baseline.in_tester(given, cylinders).complex_stiffness[:, :2, 0]
    if stiffness.shape[2] == 1:  # one stiffness at all points
        read = np.sum(weights * stiffness[:, None, :, 0], axis=2)[at]
    else:
        read = np.sum(weights[at] * stiffness[points.specimen, :, np.arange(points.order.size)], axis=1)
    left = np.ones(points.order.size)
    for effect, own in acting:
        before, read = read, effect.tester(own, read, points)
        if effect.reduces_motion:
            left = left * np.abs(read / before)
    return read, left
