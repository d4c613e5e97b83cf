"""Joint matrices by maximum likelihood on the accelerances themselves, with intervals from the noise up.

Modes are not needed but to start from. Far from the minimum plain Gauss-Newton steps go astray, so the search begins
on the lowest lines, with the noise raised by half of the accelerance, and lets both go step by step; until then the
start counts as known to `joint_parameters.REACH`. Deviations of the bench take part from the beginning: joints that
have to make up for them end, once in three hundred benches, where nothing leads out again. All lines join at the end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import FrequencyResponses, Real
from analysis.inverse.joint_fit import JointFit, describe_fit
from analysis.inverse.joint_parameters import JointParameters, SymmetricTerms
from analysis.inverse.levenberg_marquardt import Linearised, Minimum, Trial, minimise
from analysis.inverse.response_likelihood import ResponseLikelihood
from analysis.inverse.response_model import ResponseModel
from analysis.inverse.tolerances import EXACT, Tolerances
from analysis.modal.response_variance import variance_from_neighbours, variance_from_residual
from analysis.structure.beam import FreeBeam
from analysis.structure.joints import Joint

BAND = (20.0, 1024.0)  # Hz
APPROACH = ((0.5, 0.15), (0.3, 0.3), (0.1, 0.6), (0.03, 1.0), (0.01, 1.0))
"""Noise added, as a share of the accelerance, and the part of the band that is open."""
WIDE = (2.0, 1.0)
"""A way in that looks at the whole band at first, for where the other leads astray."""
LINES_ON_THE_WAY = 300
"""At most; the rest join at the end. All 2000 of them take seven times as long and lead to the same place."""
ROUGHLY = 1.0  # chi-square that a step may still gain on the way
FINALLY = 1e-3  # and at the end: parameters are then within 3 % of a standard deviation
MOST_STEPS = 30
MOST_AT_THE_END = 300  # along the valley of three k11 of which the sum alone is known it takes more than a hundred


def identify_from_responses(
    free_beam: FreeBeam,
    responses: FrequencyResponses,
    start: Sequence[Joint],
    *,
    parameters: JointParameters | None = None,
    tolerances: Tolerances = EXACT,
    band: tuple[float, float] = BAND,
) -> JointFit:
    """Symmetric k and h of every joint from accelerances, constant over the band or, where `tolerances` let them,
    following a power of frequency, and then stated at 100 Hz.

    The mesh counts: with four elements between nodes of the paper's bench, not carried on to those of no length
    (`structure.converged`), k12 comes out 0.2 % low.

    Args:
        free_beam: the beam without joints, as drawn, with its C and known masses.
        responses: accelerances; their variance is the noise. Where it is None, noise is estimated from the scatter
            about the fit, as a floor and a part proportional to the response. What an exponential window adds to the
            damping is no part of the joints'.
        start: joints to start from, such as those of `identification.identify_joints`; 20 % off will do.
        parameters: what joints are described by; all terms of their matrices by default.
        tolerances: of the bench; deviations within them are estimated alongside, and their uncertainty is in all
            intervals. By default the bench is taken to be exactly as drawn.
        band: lowest and highest frequency that count, Hz.

    Raises:
        AnalysisError: too few lines, joints without a node of their own, or a start that the model cannot follow.
    """
    lines = responses.band(max(band[0], 1e-9), band[1])
    described_by = parameters or SymmetricTerms(tuple(joint.name for joint in start))
    if tuple(joint.name for joint in start) != described_by.names:
        raise AnalysisError(
            f"the start has joints {[joint.name for joint in start]}, the parameters {list(described_by.names)}; "
            "give both in one order"
        )
    if lines.accelerance.size < len(described_by.labels):
        raise AnalysisError(
            f"{lines.accelerance.size} accelerances between {band[0]:g} and {band[1]:g} Hz are too few for "
            f"{len(described_by.labels)} parameters"
        )
    model = ResponseModel(
        free_beam, tuple(joint.node for joint in start), lines.response, lines.inputs, lines.frequency, lines.decay
    )
    target = ResponseLikelihood(
        model=model,
        measured=lines.accelerance,
        deviation=_deviation(lines),
        parameters=described_by,
        tolerance=tolerances.covariance(lines.response, lines.inputs, len(start)),
    )
    found = _search(
        target, [described_by.start(joints) for joints in (start, with_small_rotation_terms(start, free_beam))]
    )
    if lines.variance is None:
        for _ in range(2):
            fitted = target.response(found.values).accelerance
            target = replace(target, deviation=np.sqrt(variance_from_residual(lines.accelerance, fitted)))
            found = minimise(target, found.values, FINALLY, MOST_STEPS)
    return describe_fit(target, found, lines.scatter)


def _search(target: ResponseLikelihood, starts: Sequence[Real]) -> Minimum:
    """The way from rough starts to the minimum."""
    fewer = target.thinned(LINES_ON_THE_WAY)
    reached: list[Minimum] = []
    for approach in (APPROACH, (WIDE, *APPROACH)):
        for start in starts:
            reached.append(_approached(fewer, start, approach))
            if reached[-1].at.cost < fewer.data:
                break
        else:
            continue
        break
    nearest = min(reached, key=lambda found: found.at.cost)
    arrived = minimise(fewer, nearest.values, ROUGHLY, MOST_STEPS)
    return minimise(target, arrived.values, FINALLY, MOST_AT_THE_END)


def _approached(target: ResponseLikelihood, start: Real, approach: Sequence[tuple[float, float]]) -> Minimum:
    """Where one way of raising noise and opening the band leads."""
    highest, as_drawn = float(target.model.frequency[-1]), np.zeros(int(np.sum(target.active)))
    weight = np.concatenate([1 / target.parameters.reach(start) ** 2, as_drawn])
    start = np.concatenate([start, as_drawn])
    found: Minimum | None = None
    for inflation, share in approach:
        if np.any(target.model.frequency <= share * highest):
            easier = _Held(target.within(share * highest, inflation), start, weight)
            found = minimise(easier, start if found is None else found.values, ROUGHLY, MOST_STEPS)
    assert found is not None  # the whole band is open in the end
    return found


def with_small_rotation_terms(joints: Sequence[Joint], free_beam: FreeBeam) -> list[Joint]:
    """The joints with what turns them as small as joints are beside a beam; modes alone often give it far too large."""
    lever = free_beam.beam.height / 4
    found = []
    for joint in joints:
        z = (joint.dynamic_stiffness + joint.dynamic_stiffness.T) / 2
        z[2, :] = z[:, 2] = 0.0
        z[2, 2] = lever**2 * (z[0, 0] + z[1, 1]) / 2
        found.append(replace(joint, dynamic_stiffness=z))
    return found


def _deviation(lines: FrequencyResponses) -> Real:
    """Standard deviation of each line, with a floor where the stated variance is zero."""
    variance = variance_from_neighbours(lines.accelerance) if lines.variance is None else lines.variance
    floor = 1e-9 * np.max(np.abs(lines.accelerance), axis=1, keepdims=True)
    return np.asarray(np.maximum(np.sqrt(variance), floor))


@dataclass(frozen=True, eq=False)
class _Held:
    """A likelihood whose parameters are held near a start (parameters,) by a weight each."""

    likelihood: ResponseLikelihood
    start: Real
    weight: Real

    @property
    def data(self) -> int:
        return self.likelihood.data

    def at(self, values: Real) -> Trial:
        free, off = self.likelihood.at(values), values - self.start
        pull = float(np.sum(self.weight * off**2))

        def linearised() -> Linearised:
            at = free.linearised()
            return Linearised(at.cost + pull, at.descent - self.weight * off, at.normal + np.diag(self.weight))

        return Trial(free.cost + pull, linearised)
