"""The input of an identification: the article, its accelerances and its sine points, from any source."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from analysis.direct.rig_calibration import CalibrationRun
from analysis.dof import Direction, Dof
from analysis.frequency_response import Complex, FrequencyResponses, Real
from analysis.interval import Estimate
from analysis.modal.response_variance import CREDIBLE, variance_from_coherence, weighing_variance
from analysis.modal.spectra import Windows
from analysis.suspended.free_modes import BeamSuspension
from jointlab.identification.sine_points import IdentifiedSinePoint
from jointlab.identification.tester_corrections import ReferenceTemperature
from store.dof import StoredDof
from store.exchange.blow_window import stated_window
from store.exchange.bundle_setup import Article
from store.measurements.amendments import AS_MEASURED
from store.measurements.frequency_responses import FrequencyResponseSet


@dataclass(frozen=True, eq=False)
class SuspendedTest:
    """A roving-hammer set on the beam in its cords.

    Attributes:
        responses: of the set.
        suspension: the cords, or None where they are not known.
        weighed: mass of the bare beam in kg, or None where it was not weighed.
        run: number of the run that it is from, or None where it is not stored.
    """

    responses: FrequencyResponses
    suspension: BeamSuspension | None = None
    weighed: Estimate | None = None
    run: int | None = None


@dataclass(frozen=True, eq=False)
class PointForces:
    """The force records of the blows at one point that count.

    Attributes:
        point: where they were struck.
        force: (blows, samples) in N.
        sample_rate: Hz.
    """

    point: Dof
    force: Real
    sample_rate: float


@dataclass(frozen=True, eq=False)
class MeasuredArticle:
    """The experiments on one article; some of them may be missing.

    Attributes:
        title: of the run or bundle.
        article: as built.
        sets: roving-hammer sets, the reference set first.
        points: sine points in the order of measuring.
        raw: whether both were computed here from raw records, not imported as numbers.
        scatter: by set number, (rows, blows, lines) how far each blow moves the average of its row, in (m/s^2)/N; only
            where single blows are available, and enough of them at each point.
        forces: by set number, the force of its blows at each of its points; only where there is a record at every one.
        calibration: sine points on known pieces in the tester.
        reference: temperature to which sine points are corrected; None for that of the room.
        suspended: the test of the beam without joints, or None.
        left_out: accepted blows that contradict the others at their point and are in no average; one sentence each.
        faults: corrected faults in rows of hammer sets, one sentence each.
        setup_version: of the run's setup that `article` is from; 1 where it was never amended.
    """

    title: str
    article: Article
    sets: tuple[FrequencyResponseSet, ...]
    points: tuple[IdentifiedSinePoint, ...]
    raw: bool
    scatter: Mapping[int, Complex] = field(default_factory=dict)
    forces: Mapping[int, tuple[PointForces, ...]] = field(default_factory=dict)
    calibration: tuple[CalibrationRun, ...] = ()
    reference: ReferenceTemperature | None = None
    suspended: SuspendedTest | None = None
    left_out: tuple[str, ...] = ()
    faults: tuple[str, ...] = ()
    setup_version: int = AS_MEASURED

    def responses(self, index: int = 0) -> FrequencyResponses:
        """Set `index` as analysis has it, with the scatter of its blows where that is known."""
        measured = self.sets[index]
        return replace(responses_of(measured), scatter=self.scatter.get(measured.number))


def dof(stored: StoredDof) -> Dof:
    """A stored degree of freedom as analysis has it."""
    return Dof(stored.node, Direction(stored.direction))


def says_noise(coherence: Real) -> bool:
    """Whether any line with signal is below a coherence (rows, lines) of 1."""
    return bool(np.any((coherence > CREDIBLE) & (coherence < 1)))


def responses_of(measured: FrequencyResponseSet) -> FrequencyResponses:
    """A stored set as analysis has it; where only coherence is known, the variance follows from it.

    A coherence of 1 on all lines with signal says nothing of the noise, which is then not stated.
    """
    decay = stated_window(measured.window, measured.block_seconds)[0].decay
    accelerance = measured.accelerance.astype(np.complex128)
    variance = measured.variance
    told = measured.coherence is not None and measured.averages > 1 and says_noise(measured.coherence)
    if variance is None and measured.coherence is not None and told:
        by_line = variance_from_coherence(accelerance, measured.coherence, measured.averages)
        variance = weighing_variance(by_line, measured.averages)
        variance /= Windows(decay=decay).noise_kept(measured.block_seconds)
    return FrequencyResponses(
        frequency=measured.frequency,
        accelerance=accelerance,
        response=dof(measured.response),
        inputs=tuple(dof(point) for point in measured.inputs),
        coherence=measured.coherence,
        variance=variance,
        decay=decay,
    )
