"""Joint matrices by maximum likelihood from the accelerances themselves, with intervals from the noise.

Modes serve as a start only. Far from the minimum plain Gauss-Newton steps fail, so the search begins on the lowest
lines with the noise raised by half of the accelerance. Both restrictions relax in steps; until then the start counts as
known to `joint_parameters.REACH`. Deviations of the bench are parameters from the beginning: once in three hundred
benches, joints that had to compensate for them ended in a wrong minimum. All lines take part at the end.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import FrequencyResponses, Real
from analysis.inverse.frequency_law import FrequencyLaw
from analysis.inverse.joint_fit import JointFit, describe_fit
from analysis.inverse.joint_parameters import JointParameters, SymmetricTerms
from analysis.inverse.law_choice import is_the_reason, log_odds, may_follow
from analysis.inverse.levenberg_marquardt import Linearised, Minimum, Trial, minimise
from analysis.inverse.response_likelihood import ResponseLikelihood
from analysis.inverse.response_model import ResponseModel
from analysis.inverse.tolerances import EXACT, Tolerances
from analysis.modal.response_variance import standard_deviation, variance_from_residual
from analysis.structure.beam import FreeBeam
from analysis.structure.joints import Joint

BAND = (20.0, 1024.0)  # Hz
APPROACH = ((0.5, 0.15), (0.3, 0.3), (0.1, 0.6), (0.03, 1.0), (0.01, 1.0))
"""Steps of the search: noise added, as a share of the accelerance, and the share of the band that is used."""
WIDE_START = (2.0, 1.0)
"""First step on the whole band, for a second search where the first one fails."""
FIRST_STARTS = 2
"""Starts that differ only in their rotation terms: it proves nothing if they end at one minimum."""
MEETING, SAME = 2, 0.01
"""Searches, and relative difference of their chi-square, that show the minimum of a model that does not fit."""
FITTING = 1.5
"""Chi-square per datum on few lines, below which the model may be right."""
MOST_WIDE = 3
"""Starts that are searched from again."""
MOST_SEARCH_LINES = 300
"""Lines in the search before its last step. All 2000 lines take seven times as long and lead to the same minimum."""
SEARCH_TOLERANCE = 1.0  # gain in chi-square by another step, during the search
FINAL_TOLERANCE = 1e-3  # the same at the end: parameters are within 3 % of a standard deviation
MOST_STEPS = 30
MOST_FINAL_STEPS = 300  # three k11 of which only the sum is known take more than a hundred


def identify_from_responses(
    free_beam: FreeBeam,
    responses: FrequencyResponses,
    start: Sequence[Joint],
    *,
    other_starts: Iterable[Sequence[Joint]] = (),
    parameters: JointParameters | None = None,
    tolerances: Tolerances = EXACT,
    band: tuple[float, float] = BAND,
) -> JointFit:
    """Symmetric k and h of every joint from accelerances, constant over the band or, where `tolerances` let them,
    following a law of frequency, and then stated at 100 Hz.

    The mesh matters: with four elements between nodes of the paper's bench and without extrapolation
    (`structure.converged`), k12 is 0.2 % too low.

    Args:
        free_beam: the beam without joints, as drawn, with its C and known masses.
        responses: accelerances; their variance is the noise. Where it is None, noise is estimated from the scatter
            about the fit, as a floor and a part proportional to the response. The damping of an exponential window is
            not attributed to the joints.
        start: joints to start from, such as those of `identification.identify_joints`; an error of 20 % is acceptable.
        other_starts: asked for one by one while no search ends at the noise, such as those of
            `coarse_search.coarse_joints`.
        parameters: of the joints; all terms of their matrices by default.
        tolerances: of the bench; deviations within them are estimated too, and their uncertainty is in all intervals.
            By default the bench is exactly as drawn.
        band: lowest and highest frequency used, Hz.

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
        deviation=standard_deviation(lines),
        parameters=described_by,
        tolerance=tolerances.covariance(lines.response, lines.inputs, len(start)),
    )
    unknowns = len(described_by.labels) + int(np.sum(target.active))
    if lines.frequency.size < 2 or 2 * lines.accelerance.size <= unknowns:
        raise AnalysisError(
            f"{lines.frequency.size} lines of {len(lines.inputs)} rows are too few for {unknowns} parameters of joints "
            "and bench; widen the band, or state fewer tolerances"
        )
    starts = chain((start, with_small_rotation_terms(start, free_beam)), other_starts)
    found = _search(target, map(described_by.start, starts))
    fit = _described(target, found, lines)
    if tolerances.joint_law is FrequencyLaw.AUTO and may_follow(fit):
        return _following(target, found, tolerances, lines) or fit
    return fit


def _following(
    constant: ResponseLikelihood, found: Minimum, tolerances: Tolerances, lines: FrequencyResponses
) -> JointFit | None:
    """The fit of joints that follow the most probable law; None where constant ones are more probable.

    A fractional Zener law has more parameters than a power. It is tried where a power is better than constant joints,
    from there.
    """
    noise = standard_deviation(lines)
    unchanged = describe_fit(constant, found, noise, lines.scatter)
    deviations = constant.deviations(found.values)
    best, best_odds, explained = None, 0.0, False
    for law in (FrequencyLaw.POWER, FrequencyLaw.ZENER):
        target = _on_law(constant, tolerances, law)
        start = np.concatenate([found.values[: len(constant.parameters.labels)], deviations.values[target.active]])
        near = minimise(target.thinned(MOST_SEARCH_LINES), start, SEARCH_TOLERANCE, MOST_STEPS, along_valleys=True)
        found = minimise(target, near.values, FINAL_TOLERANCE, MOST_FINAL_STEPS, along_valleys=True)
        rival = describe_fit(target, found, noise, lines.scatter)
        odds = log_odds(unchanged, rival)
        if odds <= best_odds:
            break
        best, best_odds, explained = (target, found), odds, is_the_reason(unchanged, rival)
        deviations = target.deviations(found.values).with_zener_for_power()
    return _described(*best, lines) if best is not None and explained else None


def _on_law(constant: ResponseLikelihood, tolerances: Tolerances, law: FrequencyLaw) -> ResponseLikelihood:
    model = constant.model
    allowed = replace(tolerances, joint_law=law)
    return replace(constant, tolerance=allowed.covariance(model.response, model.inputs, len(model.joint_nodes)))


def _described(target: ResponseLikelihood, found: Minimum, lines: FrequencyResponses) -> JointFit:
    """The result at a minimum; where noise is not stated, at that for the noise of the residual."""
    if lines.variance is None:
        for _ in range(2):
            fitted = target.response(found.values).accelerance
            target = replace(target, deviation=np.sqrt(variance_from_residual(lines.accelerance, fitted)))
            found = minimise(target, found.values, FINAL_TOLERANCE, MOST_FINAL_STEPS, along_valleys=True)
    return describe_fit(target, found, standard_deviation(lines), lines.scatter)


def _search(target: ResponseLikelihood, starts: Iterable[Real]) -> Minimum:
    """The minimum, from rough starts; later ones are asked for only where those before do not lead to it."""
    fewer = target.thinned(MOST_SEARCH_LINES)
    tried, reached = list[Real](), list[Minimum]()

    def ends_with(start: Real, approach: Sequence[tuple[float, float]]) -> bool:
        reached.append(_approached(fewer, start, approach))
        return reached[-1].at.cost < fewer.data

    def met() -> bool:
        costs = sorted(found.at.cost for found in reached)
        return len(costs) > FIRST_STARTS and costs[MEETING - 1] < (1 + SAME) * costs[0]

    for start in starts:
        tried.append(start)
        if ends_with(start, APPROACH) or met():
            break
    else:
        for start in tried[:MOST_WIDE]:
            if ends_with(start, (WIDE_START, *APPROACH)):
                break
    nearest = min(reached, key=lambda found: found.at.cost)
    arrived = minimise(fewer, nearest.values, SEARCH_TOLERANCE, MOST_STEPS)
    fits = arrived.at.cost < FITTING * fewer.data  # a model that does not fit is not worth the long way along a valley
    return minimise(target, arrived.values, FINAL_TOLERANCE, MOST_FINAL_STEPS, along_valleys=fits)


def _approached(target: ResponseLikelihood, start: Real, approach: Sequence[tuple[float, float]]) -> Minimum:
    """The point that the steps of one approach lead to."""
    highest, as_drawn = float(target.model.frequency[-1]), np.zeros(int(np.sum(target.active)))
    weight = np.concatenate([1 / target.parameters.reach(start) ** 2, as_drawn])
    start = np.concatenate([start, as_drawn])
    found: Minimum | None = None
    for inflation, share in approach:
        if np.any(target.model.frequency <= share * highest):
            easier = _Held(target.within(share * highest, inflation), start, weight)
            found = minimise(easier, start if found is None else found.values, SEARCH_TOLERANCE, MOST_STEPS)
    assert found is not None  # the last step uses the whole band
    return found


def with_small_rotation_terms(joints: Sequence[Joint], free_beam: FreeBeam) -> list[Joint]:
    """The joints with rotation terms of a realistic size; modes alone often give far too large ones."""
    lever = free_beam.beam.height / 4
    found = []
    for joint in joints:
        z = (joint.dynamic_stiffness + joint.dynamic_stiffness.T) / 2
        z[2, :] = z[:, 2] = 0.0
        z[2, 2] = lever**2 * (z[0, 0] + z[1, 1]) / 2
        found.append(replace(joint, dynamic_stiffness=z))
    return found


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
