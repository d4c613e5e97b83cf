"""Averaged accelerances from the records of hammer blows.

Conventions: D. J. Ewins, Modal Testing, 2nd ed., Chapter 3; ISO 7626-5 for impact excitation. The window is
rectangular unless asked for: a blow and its response start and end within the record, so anything else would only
add damping.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import FEWEST_FOR_SCATTER, Complex, FrequencyResponses, Real
from analysis.modal.estimator import Estimator
from analysis.modal.local_model import SHORTEST, LocalModel, local_model
from analysis.modal.response_variance import (
    WEIGHED_OVER,
    blow_scatter,
    h2_scatter,
    variance_from_scatter,
    weighing_variance,
)


@dataclass(frozen=True)
class Windows:
    """Windows on the records; none by default.

    Attributes:
        force_duration: in s from the end of the pre-trigger, after which the force is set to zero, with a cosine taper
            over the last tenth. None leaves the force as it is.
        decay: in 1/s; force and acceleration are multiplied by exp(-decay t). The accelerance is then that at
            lambda = decay + i w, as of a structure whose poles lie `decay` further left; an
            identification finds the decay in `FrequencyResponses.decay`.
    """

    force_duration: float | None = None
    decay: float = 0.0

    def added_loss_factor(self, frequency: Real) -> Real:
        """The loss factor that the exponential window adds to a mode at `frequency` in Hz, for small damping."""
        return np.asarray(self.decay / (np.pi * frequency))

    def noise_kept(self, block_seconds: float) -> float:
        """Share of the noise's power that the exponential window leaves in a record of `block_seconds`.

        The window also correlates neighbouring lines. Where lines are taken as independent, all of the noise counts.
        """
        fallen = 2 * self.decay * block_seconds
        return float(-np.expm1(-fallen) / fallen) if fallen > 0 else 1.0


RECTANGULAR = Windows()
NO_FORCE = "the force record is zero; check the hammer's cable"


@dataclass(frozen=True)
class AveragedResponse:
    """The average of the blows at one point; arrays are (lines,).

    Attributes:
        accelerance: complex, in (m/s^2)/N.
        coherence: in 0..1; 1 throughout for a single blow.
        scatter: (blows, lines) how far each blow moves the average, in (m/s^2)/N; zero for a single blow.
    """

    accelerance: Complex
    coherence: Real
    scatter: Complex

    @property
    def variance(self) -> Real:
        """(lines,) per real and imaginary part, in ((m/s^2)/N)^2; zero for a single blow."""
        return variance_from_scatter(self.scatter)


def average(force: Complex, acceleration: Complex, estimator: Estimator = Estimator.H1) -> AveragedResponse:
    """Average the spectra (blows, lines) of the blows at one point.

    H1 is sum(A F*) / sum(F F*), H2 sum(A A*) / sum(F A*), Hv their geometric mean, which minimises the errors of
    both channels in proportion to their size. All of blows brought to the same force, see `equal_blows`. The local
    estimate is H1 of accelerations that have no transient any more.

    Raises:
        AnalysisError: no blow, or no force at some line.
    """
    if force.shape[0] == 0:
        raise AnalysisError("no blow to average")
    force, acceleration = equal_blows(force, acceleration)
    cross = np.sum(acceleration * force.conj(), axis=0)
    force_power = np.sum(np.abs(force) ** 2, axis=0)
    acceleration_power = np.sum(np.abs(acceleration) ** 2, axis=0)
    if not np.all(force_power > 0):
        raise AnalysisError(NO_FORCE)
    coherence = np.abs(cross) ** 2 / (force_power * np.maximum(acceleration_power, np.finfo(float).tiny))
    coherence = np.clip(coherence, np.finfo(float).tiny, 1.0)
    h1, exponent = cross / force_power, {Estimator.HV: 0.5, Estimator.H2: 1.0}.get(estimator, 0.0)
    scatter = np.zeros_like(force)
    if force.shape[0] > 1:
        by_h1 = blow_scatter(force, acceleration, h1)
        by_h2 = h2_scatter(force, acceleration, h1 / coherence) if exponent > 0 else 0.0
        scatter = (1 - exponent) * coherence**-exponent * by_h1 + exponent * coherence ** (1 - exponent) * by_h2
    return AveragedResponse(h1 * coherence**-exponent, coherence, scatter)


def equal_blows(force: Complex, acceleration: Complex) -> tuple[Complex, Complex]:
    """Spectra (blows, lines) of force and acceleration as blows of their mean force would have left them.

    Harder blows would weigh more otherwise, by the square of their force, and as joints soften with amplitude the
    average would be that of a harder blow than the mean one. It costs little: where noise is all there is and forces
    scatter by a tenth, 2 % of the standard deviation.

    Raises:
        AnalysisError: a blow without force.
    """
    size = np.sqrt(np.mean(np.abs(force) ** 2, axis=1, keepdims=True))
    if not np.all(size > 0):
        raise AnalysisError(NO_FORCE)
    factor = np.mean(size) / size
    return force * factor, acceleration * factor


def responses_from_blows(
    force: Sequence[Real],
    acceleration: Sequence[Real],
    sample_rate: float,
    response: Dof,
    inputs: Sequence[Dof],
    highest_frequency: float | None = None,
    estimator: Estimator | str = Estimator.H1,
    *,
    pre_trigger: int = 0,
    windows: Windows = RECTANGULAR,
    smoothed_over: int = WEIGHED_OVER,
) -> FrequencyResponses:
    """Average the blows at each point to accelerances with coherence and variance.

    Args:
        force: for each point struck, (blows, samples) in N.
        acceleration: the same records of the accelerometer, in m/s^2.
        sample_rate: in Hz.
        response: where the accelerometer sits.
        inputs: the points struck, in the order of `force`.
        highest_frequency: in Hz; lines above it are left out. None keeps all.
        estimator: H1, H2, Hv or local.
        pre_trigger: samples before the blow; their mean is a sensor's offset and is subtracted.
        windows: on the records.
        smoothed_over: lines over which the variance is averaged, see `weighing_variance`. With 1 it is the bare
            variance of each line, which is no weight.

    Returns:
        Accelerances in (m/s^2)/N; coherence is None where a point was struck only once, scatter where one was struck
        less than four times. The variance of a single blow is from the lines around each line, see `local_model`; it
        is None where its record is too short for that.

    Raises:
        AnalysisError: no blow at a point, records of unequal shape, or a record without force.
    """
    samples = _common_length(force, acceleration, inputs)
    records = _Records(samples, sample_rate, pre_trigger, windows)
    frequency = np.asarray(np.fft.rfftfreq(samples, 1 / sample_rate), dtype=np.float64)
    keep = frequency <= (np.inf if highest_frequency is None else highest_frequency)
    found = [
        _row(records, struck, heard, Estimator(estimator), int(np.sum(keep)))
        for struck, heard in zip(force, acceleration, strict=True)
    ]
    rows = [row for row, _ in found]
    repeated = all(len(blows) > 1 for blows in force)
    known = repeated or samples >= SHORTEST
    variance = np.array([row.variance for row in rows])
    if smoothed_over > 1:
        variance = weighing_variance(variance, [len(blows) for blows in force], smoothed_over)
    for own, (_, of_one_blow) in zip(variance, found, strict=True):
        if of_one_blow is not None:
            own[keep] = of_one_blow
    variance /= windows.noise_kept(samples / sample_rate)
    return FrequencyResponses(
        frequency=frequency[keep],
        accelerance=np.array([row.accelerance[keep] for row in rows]),
        response=response,
        inputs=tuple(inputs),
        coherence=np.array([row.coherence[keep] for row in rows]) if repeated else None,
        variance=variance[:, keep] if known else None,
        scatter=_stacked([row.scatter[:, keep] for row in rows]),
        decay=windows.decay,
    )


def _row(
    records: _Records, struck: Real, heard: Real, estimator: Estimator, lines: int
) -> tuple[AveragedResponse, Real | None]:
    """The average of the blows at one point, and the variance of its first `lines` lines where it is of one blow."""
    struck, heard = records.windowed(struck, records.windows.force_duration), records.windowed(heard)
    force, acceleration, variance = np.fft.rfft(struck, axis=1), np.fft.rfft(heard, axis=1), None
    single = len(struck) == 1 and struck.shape[1] >= SHORTEST
    if estimator is not Estimator.LOCAL and not single:
        return average(force, acceleration, estimator), None
    models = [records.model(*each, lines) for each in zip(struck, heard, strict=True)]
    if estimator is Estimator.LOCAL:
        acceleration[:, :lines] -= [model.transient for model in models]
    row = average(force, acceleration, estimator)
    if single:
        noise = models[0].noise_without if estimator is Estimator.LOCAL else models[0].noise
        variance = noise / np.abs(force[0, :lines]) ** 2
    return row, variance


def _stacked(scatter: Sequence[Complex]) -> Complex | None:
    """(rows, most blows, lines), zero where a row has fewer blows than another; None where one has too few."""
    if min(map(len, scatter)) < FEWEST_FOR_SCATTER:
        return None
    most = max(map(len, scatter))
    return np.array([np.pad(row, ((0, most - len(row)), (0, 0))) for row in scatter])


def _common_length(force: Sequence[Real], acceleration: Sequence[Real], inputs: Sequence[Dof]) -> int:
    """Number of samples of all records, after a check of their shapes."""
    if not 0 < len(force) == len(acceleration) == len(inputs):
        raise AnalysisError(
            f"{len(force)} points have force, {len(acceleration)} acceleration, {len(inputs)} a name; give all three"
        )
    samples = int(force[0].shape[-1])
    for struck, heard, point in zip(force, acceleration, inputs, strict=True):
        if struck.ndim != 2 or struck.shape != heard.shape or struck.shape[1] != samples:
            raise AnalysisError(
                f"at {point} force has shape {struck.shape} and acceleration {heard.shape}; "
                f"give (blows, samples) with {samples} samples as at {inputs[0]}"
            )
        if struck.shape[0] == 0:
            raise AnalysisError(f"no blow at {point}")
    return samples


@dataclass(frozen=True)
class _Records:
    """Offset and windows of records (blows, samples), and the local model of one."""

    samples: int
    sample_rate: float
    pre_trigger: int
    windows: Windows

    def windowed(self, record: Real, force_duration: float | None = None) -> Real:
        if self.pre_trigger:
            record = record - np.mean(record[:, : self.pre_trigger], axis=1, keepdims=True)
        if force_duration is not None:
            since_blow = (np.arange(self.samples) - self.pre_trigger) / self.sample_rate
            taper = np.clip((force_duration - since_blow) / (0.1 * force_duration), 0, 1)
            record = record * (1 - np.cos(np.pi * taper)) / 2
        return np.asarray(record * self._decaying)

    def model(self, force: Real, acceleration: Real, lines: int) -> LocalModel:
        """Of `windowed` records (samples,) of one blow."""
        return local_model(force, acceleration, lines, self._decaying)

    @cached_property
    def _decaying(self) -> Real:
        return np.asarray(np.exp(-self.windows.decay * np.arange(self.samples) / self.sample_rate))
