"""Predictions of a fitted model under conditions that were not measured, with their standard deviation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.effect import StructureEffect
from analysis.gap.structures.likelihood import STEP, CurveLikelihood
from analysis.gap.structures.simulator import Simulator


@dataclass(frozen=True, eq=False)
class Known:
    """The estimated parameters of one model of a diagnosis.

    Attributes:
        scores: (parameters,) of the structure, then of each effect in turn.
        covariance: (parameters, parameters) of these scores.
    """

    scores: Real
    covariance: Real


@dataclass(frozen=True, eq=False)
class PredictedCurve:
    """Readings of one curve.

    Attributes:
        values: (n,) predicted, in the unit of the observable.
        deviation: (n,) standard deviation due to the parameters alone, of real and imaginary part together.
    """

    values: Complex
    deviation: Real


def predict(simulator: Simulator, effects: Sequence[StructureEffect], known: Known, curve: Curve) -> PredictedCurve:
    """Readings of a curve, whose own values are not used; local parameters are at their centres.

    Raises:
        AnalysisError: the simulator gives none there, or not one for each value.
    """
    model = CurveLikelihood(simulator, tuple(effects), ())
    values = model.predict(known.scores, curve)
    slopes = [
        (model.predict(known.scores + step, curve) - model.predict(known.scores - step, curve)) / (2 * STEP)
        for step in STEP * np.eye(known.scores.size)
    ]
    columns = np.array(slopes).reshape(-1, values.size)
    parts = np.concatenate([columns.real, columns.imag], axis=1)
    variance = np.einsum("in,ij,jn->n", parts, known.covariance, parts).reshape(2, -1).sum(axis=0)
    return PredictedCurve(np.asarray(values), np.sqrt(variance))
