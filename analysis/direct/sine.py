"""First harmonic of one or several signals on one clock: the least-squares sine fit of IEEE 1057.

The model of each signal, with t = 0 at its first sample and one angular frequency w for all of them, is

    x(t) = drift(t) + Re( X_1 e^(i w t) + X_2 e^(2 i w t) + ... ),

drift being a polynomial of low order. With w held this is linear (the standard's three-parameter fit). With w refined
it is the four-parameter fit, here by Gauss-Newton steps in w alone, with all linear parameters eliminated. Signals are
weighted by their own residual, so their units do not matter.

The noise of a machine is not white. So the record is also cut into blocks of whole cycles, and each block is fitted
again at the same w: the scatter between blocks is that of repeats.

Batch means (Schmeiser, Operations Research 30, 1982, 556-568) take blocks as independent. Blocks of a cycle or two are
not, because an amplitude varies slowly: part of the deviation of one cycle remains in the next. In a process that
forgets after one cycle the correlation of neighbours is 1/2 at most, as in a straight line from the value of one cycle
to the next; the variance of the mean is then twice that of independent cycles. Ten cycles cannot distinguish this from
no correlation. So 1/2 is assumed for slow variation, and more for longer blocks where more is measured. Only the part
that follows the amplitude varies slowly. The rest, the noise of the sensors, scatters independently.
"""

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real

FEWEST_CYCLES = 2.0
FINER = 4  # padding of a spectrum; a fit then starts within an eighth of a cycle in the record of the sine
MOST_BLOCKS = 30  # batch means want 10 to 30 batches (Schmeiser, Operations Research 30, 1982, 556-568)
CONVERGED = 1e-5  # rad over the record; the next step would be about 1e-10
MOST_STEPS = 20
LARGEST_OVERLAP = 0.05  # of one block, divided among all
SAMPLES_PER_UNKNOWN = 2  # of a block, so that its own fit is overdetermined
LARGEST_CORRELATION = 0.5  # of neighbours in a series that forgets after one step
CLOSE_TONE = 3.0  # cycles in the record from the sine
STRONG_TONE = 100.0  # power over that of noise in the record, of one whose phase is a measure of its frequency
LARGEST_DETUNING = 0.005  # of the mains, relative
TUNINGS = 3
FEWEST_TO_SPLIT = 5  # blocks; a regression on amplitude explains fewer completely


@dataclass(frozen=True)
class SineFit:
    """Fitted sines of several signals at one frequency, in the signals' own units.

    Attributes:
        frequency: in Hz, refined or held.
        harmonics: (signals, harmonics) complex X_1, X_2, ... with t = 0 at the first sample.
        blocks: (blocks, signals, harmonics) complex X_1, X_2, ... of each block of whole cycles, same t = 0.
        cycles_per_block: whole cycles in each block.
        cycles: length of the record in cycles.
        residual: (signals, samples) without drift, harmonics and tones.
        residual_standard_error: (signals,) of the real part, and of the imaginary part, of X_1 if the residual
            were white noise.
        tone_inflation: of the variance of X_1, because tones beside it are fitted too; 1 without any.
    """

    frequency: float
    harmonics: Complex
    blocks: Complex
    cycles_per_block: int
    cycles: float
    residual: Real
    residual_standard_error: Real
    tone_inflation: float = 1.0

    @property
    def first(self) -> Complex:
        """(signals,) first harmonic X_1."""
        return np.asarray(self.harmonics[:, 0])

    @property
    def amplitude_pp(self) -> Real:
        """(signals,) peak-to-peak amplitude of the first harmonic."""
        return np.asarray(2 * np.abs(self.first))

    @property
    def other_pp(self) -> Real:
        """(signals,) peak-to-peak value of a sine as strong as all that is neither drift nor first harmonic."""
        higher = np.sum(np.abs(self.harmonics[:, 1:]) ** 2, axis=1)
        return np.asarray(2 * np.sqrt(2 * np.mean(self.residual**2, axis=1) + higher))

    @property
    def total_harmonic_distortion(self) -> Real:
        """(signals,) root of the sum of |X_2|^2, |X_3|^2, ... over |X_1|."""
        return np.asarray(np.linalg.norm(self.harmonics[:, 1:], axis=1) / np.abs(self.first))

    @property
    def distortion_deviation(self) -> Real:
        """(blocks, signals) change of `total_harmonic_distortion` by each block, to first order."""
        higher, first = self.harmonics[:, 1:], np.abs(self.first)
        size = np.linalg.norm(higher, axis=1)
        # d |H| = Re(H* dH) / |H|: changes across H, such as most noise, change its length in second order only
        along = np.divide(higher.conj(), size[:, None], out=np.zeros_like(higher), where=size[:, None] > 0)
        of_higher = np.sum((along * (self.blocks[:, :, 1:] - higher)).real, axis=2)
        of_first = (self._relative_blocks - 1).real * size
        return np.asarray((of_higher - of_first) / first)

    @property
    def amplitude_scatter(self) -> Real:
        """(signals,) standard deviation of |X_1| from block to block, relative."""
        return np.asarray(np.std(self._relative_blocks.real, axis=0, ddof=1))

    @property
    def amplitude_pp_standard_error(self) -> Real:
        """(signals,) standard error of `amplitude_pp` from the scatter between blocks, as if they were independent."""
        return np.asarray(self.amplitude_pp * self.amplitude_scatter / math.sqrt(len(self.blocks)))

    @property
    def noise_of_block(self) -> Real:
        """(signals,) variance of the real and of the imaginary part of X_1 of a block, over |X_1|^2, by white noise.

        Its power is the median of the residual's spectrum: wander and hum are far above it, near few lines.
        """
        samples = self.residual.shape[1]
        power = np.median(np.abs(np.fft.rfft(self.residual, axis=1)) ** 2, axis=1) / (math.log(2) * samples)
        return np.asarray(2 * power * len(self.blocks) / samples / np.abs(self.first) ** 2)

    @property
    def _relative_blocks(self) -> Complex:
        return np.asarray(self.blocks[:, :, 0] / self.first)


def strongest_frequency(signal: Real, sample_rate: float) -> float:
    """Frequency in Hz of the strongest sine of two cycles or more in `signal` (samples,), to begin a fit with."""
    spectrum = np.abs(np.fft.rfft((signal - np.mean(signal)) * np.hanning(signal.size), FINER * signal.size))
    first = int(FINER * FEWEST_CYCLES)
    return float((first + np.argmax(spectrum[first:])) * sample_rate / (FINER * signal.size))


def fit_sine(
    signals: ArrayLike,
    sample_rate: float,
    frequency: float,
    *,
    harmonics: int = 5,
    drift_order: int = 1,
    refine: bool = True,
    names: Sequence[str] = (),
    tones: Sequence[float] = (),
) -> SineFit:
    """Fit a sine of one common frequency, its harmonics, drift and tones to every signal.

    Args:
        signals: (samples,) or (signals, samples), any units.
        sample_rate: in Hz.
        frequency: in Hz; if `refine`, a start value within about a third of a cycle over the record.
        harmonics: how many to model, the first included; those above Nyquist are left out.
        drift_order: of the polynomial; 1 is a straight line.
        refine: refine the frequency (four-parameter fit) or hold it (three-parameter fit).
        names: of the signals, for errors.
        tones: Hz, of hum with a common fundamental, a cycle in the record or more beside sine and harmonics. The phasor
            of one that is close to the sine may change linearly over the record; where that tone is strong enough, it
            tells the fundamental within half a per cent.

    Returns:
        The fit; one signal gives arrays with one row.

    Raises:
        AnalysisError: a value is not finite, a signal is constant, the record has fewer than two cycles or too few
            samples, the frequency is not between 0 and Nyquist, or no sine was found near the given frequency.
    """
    record = _checked(signals, sample_rate, frequency, harmonics, drift_order, names)
    samples = record.shape[1]
    duration = samples / sample_rate
    # a harmonic nearer to Nyquist than the record resolves cannot be distinguished from its alias
    harmonics = min(harmonics, int((sample_rate / 2 - 1 / duration) / frequency))
    unknowns = drift_order + 1 + 2 * harmonics  # of a block
    cycles_per_block = max(
        math.ceil(duration * frequency / MOST_BLOCKS),
        math.ceil(SAMPLES_PER_UNKNOWN * unknowns * frequency / sample_rate),
    )
    if 2 * cycles_per_block * sample_rate / frequency > samples + 1:
        raise AnalysisError(
            f"{samples} samples are too few for {unknowns} unknowns in each of two blocks of whole cycles; "
            "record longer or model fewer harmonics"
        )
    model = _Model(record, sample_rate, drift_order, harmonics, tones, frequency)
    omega = 2 * math.pi * float(frequency)
    model.fit(omega)
    for _ in range(TUNINGS if tones else 0):
        model.tune()
        model.fit(omega)
    if refine:
        refined_by = model.mirrored(omega) if tones else model
        omega = _refine(refined_by, omega)
        if refined_by is not model:
            model.fit(omega)
    refined = omega / (2 * math.pi)
    to_first_sample = np.exp(1j * omega * model.time[0] * np.arange(1, harmonics + 1))
    noise = np.sum(model.residual**2, axis=1) / (samples - unknowns)
    return SineFit(
        frequency=refined,
        harmonics=model.amplitudes * to_first_sample,
        blocks=_fit_blocks(model, cycles_per_block, sample_rate / refined) * to_first_sample,
        cycles_per_block=cycles_per_block,
        cycles=duration * refined,
        residual=model.residual,
        residual_standard_error=np.sqrt(2 * noise / samples),
        tone_inflation=model.inflation if tones else 1.0,
    )


class _Model:
    """Linear least squares of one record with the frequency held; the regressors are overwritten by each `fit`.

    `rows` (unknowns, samples): powers of time, tones, then cos and -sin of each harmonic, so that the coefficients
    (signals, unknowns) are the drift's and Re X_1, Im X_1, Re X_2, ... with `time` = 0 in the middle of the record,
    where amplitude and frequency are least correlated.
    """

    def __init__(
        self,
        record: Real,
        sample_rate: float,
        drift_order: int,
        harmonics: int,
        tones: Sequence[float],
        frequency: float,
    ) -> None:
        samples = record.shape[1]
        self.record = record
        self.time: Real = (np.arange(samples) - (samples - 1) / 2) / sample_rate
        powers = np.vander(self.time / self.time[-1], max(drift_order + 1, 2), increasing=True).T
        self.tones: Real = 2 * math.pi * np.array(tones, dtype=float)
        self.close = np.flatnonzero(np.abs(np.array(tones) - frequency) * samples < CLOSE_TONE * sample_rate)
        self.tuned, self.powers = 1.0, powers
        self.hum = len(self.tones) + len(self.close)
        self.drift = drift_order + 1 + 2 * self.hum
        self.rows: Real = np.empty((self.drift + 2 * harmonics, samples))
        self.rows[: drift_order + 1] = powers[: drift_order + 1]
        self._set_tones()

    def _set_tones(self, mirror: float | None = None) -> None:
        turning = np.exp(1j * self.tuned * self.tones[:, None] * self.time)
        close = turning[self.close]
        beside = close * self.powers[1] if mirror is None else close.conj() * np.exp(2j * mirror * self.time)
        hum = np.concatenate([turning, beside])
        self.rows[self.drift - 2 * self.hum : self.drift] = np.concatenate([hum.real, hum.imag])

    def mirrored(self, omega: float) -> "_Model":
        """The same, fitted at `omega`, with the mirror image of each close tone about the sine instead of its change.

        It tells the frequency of a sine whose amplitude wanders. Such a sine has two equal side bands. Where a tone
        takes one of them, the other looks like a change of frequency, and the amplitude at that frequency is wrong.
        """
        other = copy(self)
        other.rows = self.rows.copy()
        other._set_tones(omega)
        other.fit(omega)
        return other

    def tune(self) -> None:
        """Set the tones' frequencies by how the phase of a close one changes, where it stands out of the noise."""
        hum = self.coefficients[:, self.drift - 2 * self.hum : self.drift]
        phasor = hum[:, : self.hum] - 1j * hum[:, self.hum :]
        level, change = phasor[:, self.close], phasor[:, len(self.tones) :]
        weight = 1 / (np.mean(self.residual**2, axis=1, keepdims=True) + np.finfo(float).tiny)
        strength = float(np.sum(weight * np.abs(level) ** 2))
        if strength * self.time.size < STRONG_TONE:
            return
        turn = np.sum(weight * (change * level.conj()).imag) / (strength * self.time[-1])
        off = self.tuned + float(turn / np.mean(self.tones[self.close]))
        # what lies farther off is a side band of the sine, whose amplitude wanders
        self.tuned = off if abs(off - 1) < LARGEST_DETUNING else 1.0
        self._set_tones()

    def fit(self, omega: float) -> None:
        """Set the frequency, in rad/s, and solve for all linear parameters."""
        # e^(i w (a + b)) = e^(i w a) e^(i w b): two short exponentials instead of one long
        stride = math.isqrt(self.time.size)
        coarse = np.exp(1j * omega * self.time[::stride])
        fine = np.exp(1j * omega * (self.time[:stride] - self.time[0]))
        wave = np.outer(coarse, fine).ravel()[: self.time.size]
        power = wave.copy()
        for row in range(self.drift, len(self.rows), 2):
            self.rows[row] = power.real
            np.negative(power.imag, out=self.rows[row + 1])
            power *= wave
        self.gram = self.rows @ self.rows.T
        self.coefficients = np.linalg.solve(self.gram, self.rows @ self.record.T).T
        self.residual: Real = self.record - self.coefficients @ self.rows

    @property
    def inflation(self) -> float:
        """Factor on the variance of X_1 by everything that is fitted beside it."""
        first = slice(self.drift, self.drift + 2)
        return float(np.mean(np.diag(np.linalg.inv(self.gram))[first] * np.diag(self.gram)[first]))

    @property
    def amplitudes(self) -> Complex:
        """(signals, harmonics) X_1, X_2, ..."""
        return np.asarray(self.coefficients[:, self.drift :: 2] + 1j * self.coefficients[:, self.drift + 1 :: 2])


def _checked(
    signals: ArrayLike, sample_rate: float, frequency: float, harmonics: int, drift_order: int, names: Sequence[str]
) -> Real:
    record = np.atleast_2d(np.asarray(signals, dtype=np.float64))
    if record.ndim != 2 or record.shape[1] == 0:
        raise AnalysisError(f"signals have shape {np.shape(signals)}; give (samples,) or (signals, samples)")
    if harmonics < 1 or drift_order < 0:
        raise AnalysisError(f"harmonics = {harmonics} and drift_order = {drift_order}; at least 1 and 0 are needed")
    if not (math.isfinite(sample_rate) and sample_rate > 0):
        raise AnalysisError(f"the sample rate is {sample_rate} Hz; it has to be positive")
    duration = record.shape[1] / sample_rate
    if not 0 < frequency < sample_rate / 2 - 1 / duration:
        raise AnalysisError(
            f"{frequency:g} Hz is not between 0 and {sample_rate / 2 - 1 / duration:g} Hz, what a record of "
            f"{duration:g} s at {sample_rate:g} Hz resolves below Nyquist; sample faster"
        )
    if duration * frequency < FEWEST_CYCLES * (1 - 1e-6):
        raise AnalysisError(
            f"the record has {duration * frequency:.2f} cycles of {frequency:g} Hz; "
            f"at least {FEWEST_CYCLES:g} are needed"
        )
    names = names or [f"signal {row}" for row in range(len(record))]
    for name, signal in zip(names, record, strict=True):
        bad = np.flatnonzero(~np.isfinite(signal))
        if bad.size:
            raise AnalysisError(f"{name} is not a finite number at sample {bad[0]}")
        if np.ptp(signal) == 0:
            raise AnalysisError(f"{name} is constant at {signal[0]:g}; is its channel connected?")
    return record


def _refine(model: _Model, omega: float) -> float:
    """Gauss-Newton steps in w: returns w, at which `model` is fitted."""
    start = omega
    duration = model.time[-1] - model.time[0]
    floor = 1e-28 * np.mean(model.record**2, axis=1)  # a noiseless signal would have infinite weight
    for _ in range(MOST_STEPS):
        # d/dw Re(X e^(i m w t)) = Re(i m t X e^(i m w t))
        turned = 1j * model.amplitudes * np.arange(1, model.amplitudes.shape[1] + 1)
        coefficients = np.zeros_like(model.coefficients)
        coefficients[:, model.drift :: 2], coefficients[:, model.drift + 1 :: 2] = turned.real, turned.imag
        slope = (coefficients @ model.rows) * model.time
        inside = model.rows @ slope.T  # the part of the slope that the linear parameters can imitate
        steepness = np.sum(slope**2, axis=1) - np.sum(inside * np.linalg.solve(model.gram, inside), axis=0)
        weight = 1 / (np.mean(model.residual**2, axis=1) + floor)
        step = float(weight @ np.sum(slope * model.residual, axis=1)) / float(weight @ steepness)
        omega += step
        if not abs(omega - start) * duration < 2 * math.pi:
            break
        model.fit(omega)
        if abs(step) * duration < CONVERGED:
            return omega
    raise AnalysisError(
        f"no sine found near {start / (2 * math.pi):g} Hz: the refined frequency runs away; "
        "check the commanded frequency, or hold it with refine=False"
    )


def _fit_blocks(model: _Model, cycles_per_block: int, period: float) -> Complex:
    """(blocks, signals, harmonics) of blocks of whole cycles, each fitted with its own offset.

    Drift is taken from the whole record: a line fitted to a single cycle imitates its sine and would more than double
    the variance of that part.
    """
    samples = model.time.size
    length = round(cycles_per_block * period)
    # a record of slightly less than whole cycles keeps its last block, with a slight overlap
    count = max(2, int(samples / (cycles_per_block * period) + LARGEST_OVERLAP))
    first = np.round(np.linspace(0, samples - length, count)).astype(int)
    level = model.record - model.coefficients[:, : model.drift] @ model.rows[: model.drift]
    rows = model.rows if model.drift == 1 else np.concatenate([model.rows[:1], model.rows[model.drift :]])
    coefficients = np.empty((count, len(rows), len(level)))
    for block, start in enumerate(first):
        own = rows[:, start : start + length]
        coefficients[block] = np.linalg.solve(own @ own.T, own @ level[:, start : start + length].T)
    return np.asarray(coefficients[:, 1::2] + 1j * coefficients[:, 2::2]).transpose(0, 2, 1)


def covariance_of_mean(deviation: Complex, amplitude: Real, cycles_per_block: int) -> Real:
    """(2, 2) covariance of the real and imaginary part of the mean of `deviation`.

    Args:
        deviation: (blocks,) of each block, two blocks or more; any unit.
        amplitude: (blocks,) of the motion in each, any unit.
        cycles_per_block: whole cycles in a block.
    """
    count = len(deviation)
    left = np.stack([deviation.real, deviation.imag])
    left = left - np.mean(left, axis=1, keepdims=True)
    variation = amplitude - np.mean(amplitude)
    square = float(variation @ variation)
    if count < FEWEST_TO_SPLIT or square == 0:
        # all of it is taken as slow variation
        return np.asarray(left @ left.T) * _inflation(LARGEST_CORRELATION / (2 * cycles_per_block - 1), count)
    slope = left @ variation / square
    left = left - np.outer(slope, variation)
    shared = variance_of_mean(amplitude, cycles_per_block)
    # the error of the slope, 1 / square of the rest, is in its square: subtract it
    independent = left @ left.T / (count - 2) * (1 / count - shared / square)
    return np.asarray(independent + np.outer(slope, slope) * shared)


def variance_of_mean(series: Real, cycles_per_block: int) -> float:
    """Variance of the mean of a slowly varying quantity, from its values (blocks,), two blocks or more."""
    count = len(series)
    left = series - np.mean(series)
    square = float(left @ left)
    if square == 0:
        return 0.0
    # the correlation of neighbours in a short series is biased by -1 / count
    measured = float(left[1:] @ left[:-1]) / square + 1 / count
    at_least = LARGEST_CORRELATION / (2 * cycles_per_block - 1)
    return square * _inflation(min(max(at_least, measured), LARGEST_CORRELATION), count)


def _inflation(correlation: float, count: int) -> float:
    """From the sum of squares to the variance of the mean of `count` values whose neighbours are correlated."""
    return (1 + 2 * correlation) / (count * (count - 1))
