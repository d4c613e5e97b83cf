"""The further experiment that tells most about which explanation is true, for the rig time that it takes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

from analysis.gap.evidence.calibration import UNCALIBRATED, Calibration
from analysis.gap.evidence.verdict import UNKNOWN, Status, Weighed, leading
from analysis.gap.experiments.catalogue import (
    EXPERIMENTS,
    PAPER_TIME,
    Experiment,
    FurtherMeasurement,
    RigTime,
    SizeCheck,
)
from analysis.gap.experiments.information import entropy
from analysis.gap.fitting.model import Model
from analysis.gap.search.single_effects import ParallelMap, serial_map

RIVALS = 4
"""Number of explanations, beside the verdict and an unknown cause, that an experiment is to tell from the verdict."""
RIVAL = 1e-6
"""Probability from which an explanation is a rival, whatever effects it has."""
TRUSTED = 0.9
"""Probability that the weighing is right; if it is not, all explanations are equally probable."""
LEAST = 0.03
"""Bits of information below which an experiment tells nothing: the accuracy of the information itself."""
MOST_OF = 0.5
"""Share of the largest information, from which rig time decides between experiments."""


@dataclass(frozen=True)
class NextExperiment:
    """What a diagnosis asks for next.

    Attributes:
        id: the experiment.
        effects: ids of those that it is expected to tell apart or to confirm, or that are to be corrected.
        tells_apart: whether these data cannot tell `effects` apart; otherwise the experiment confirms them.
        information: that is expected of it, bits; 0 where none was computed.
        doubt: about the explanation before it, bits; no experiment tells more.
        minutes: of rig time.
        corrections: ids of effects that records show; their cause is to be removed before anything is measured again.
    """

    id: Experiment
    effects: tuple[str, ...] = ()
    tells_apart: bool = False
    information: float = 0.0
    doubt: float = 0.0
    minutes: float = 0.0
    corrections: tuple[str, ...] = ()


def experiments_in_turn(
    status: Status,
    weighed: Sequence[Weighed[Model]],
    groups: Sequence[Sequence[str]],
    calibration: Calibration = UNCALIBRATED,
    time: RigTime = PAPER_TIME,
    among: Sequence[SizeCheck | FurtherMeasurement] = EXPERIMENTS,
    parallel_map: ParallelMap = serial_map,
) -> tuple[NextExperiment, ...]:
    """The experiments to ask for, each where those before it cannot be made.

    Each is, among those that tell nearly as much as the best, the one with most bits a minute. The last one has no
    information: no further experiment would tell enough.

    Args:
        status: of the diagnosis.
        weighed: explanations.
        groups: of effects that these data cannot tell apart.
        calibration: how wrong laws may be.
        time: of the rig.
        among: experiments that can be made.
        parallel_map: computes the information of experiments, in parallel if it can.
    """
    if status is Status.NONE:
        return (NextExperiment(Experiment.NOTHING),)
    rivals = doubtful(weighed)
    verdict, before = rivals[0], entropy([each.probability for each in rivals])
    none = next((each.model for each in weighed if not each.effects), None)
    possible = among if len(rivals) > 1 else ()
    expected_of = partial(_expected, rivals=rivals, none=none, time=time, calibration=calibration)
    asked = dict(zip(possible, parallel_map(expected_of, possible), strict=True))
    named = tuple(name for group in groups for name in group)
    if verdict.effects == UNKNOWN:
        named = tuple(dict.fromkeys(name for each in rivals if each.effects != UNKNOWN for name in each.effects))
    in_turn = list[NextExperiment]()
    while True:
        enough = max(LEAST, MOST_OF * max((bits for bits, _ in asked.values()), default=0.0))
        useful = {each: found for each, found in asked.items() if found[0] >= enough}
        if not useful:
            break
        best = max(useful, key=lambda each: useful[each][0] / useful[each][1])
        bits, minutes = asked.pop(best)
        in_turn.append(NextExperiment(best.id, named or verdict.effects, bool(named), bits, before, minutes))
    if verdict.effects == UNKNOWN:
        return (*in_turn, NextExperiment(Experiment.NEW_SET_UP, doubt=before))
    return (*in_turn, NextExperiment(Experiment.CORRECT_EFFECTS, verdict.effects, doubt=before))


def _expected(
    experiment: SizeCheck | FurtherMeasurement,
    rivals: Sequence[Weighed[Model]],
    none: Model | None,
    time: RigTime,
    calibration: Calibration,
) -> tuple[float, float]:
    """Expected information in bits, and minutes, of one experiment."""
    return experiment.asked(rivals, none, time, calibration)


def doubtful(weighed: Sequence[Weighed[Model]]) -> list[Weighed[Model]]:
    """The verdict, its best rivals and an unknown cause, the verdict first; probabilities sum to one.

    Rivals are the best explanations without each effect of the verdict, however improbable, and other probable ones.
    """
    verdict = leading(weighed)
    others = sorted((each for each in weighed if each is not verdict), key=lambda each: -each.probability)
    unknown = [each for each in others if each.effects == UNKNOWN and each.probability > RIVAL]
    known = [each for each in others if each.effects != UNKNOWN]
    lacking = [next((each for each in known if effect not in each.effects), None) for effect in verdict.effects]
    rivals = [each for each in known if each.probability > RIVAL][:RIVALS]
    rivals += [each for each in lacking if each is not None and verdict.effects != UNKNOWN and each not in rivals]
    chosen = [verdict, *dict.fromkeys(rivals), *unknown]
    total, even = sum(each.probability for each in chosen), (1 - TRUSTED) / len(chosen)
    return [replace(each, probability=TRUSTED * each.probability / total + even) for each in chosen]
