"""Is this blow fit for an average? The verdict on one hammer blow, with its reasons in sentences.

Contacts of the hammer are counted on the force after a low-pass filter of nine samples. It removes what rings after
any short pulse behind an anti-alias filter (up to half of the peak unfiltered, below 1 % filtered) and keeps what a
second contact adds. What counts as one follows from the noise of the record itself: a second contact has to stand
out of it so far that noise alone does it in less than one blow in a million, and to exceed half the limit, so that a
bounce at the limit is found although noise takes from it. A blow too weak for both is refused as weak, unless it is
drift and mains hum that hide a second contact: these are taken out.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy.signal import find_peaks
from scipy.special import fdtri, ndtri

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real

_FILTER = np.hanning(11)[1:-1] / np.sum(np.hanning(11))
_FALSE_ALARM = 1e-6  # for a blow
_MISS = 1e-2  # of a bounce at the limit
_CHANCE_OF_TIES = 1e-4  # for a blow, below which equal samples at the extreme are taken for clipping
_EXTREME_VALUES = 10  # distinct values next to the extreme, whose spacing says how likely ties are
_OUT_OF_NOISE = 8.0  # standard deviations; below them equal extremes are the converter's steps
_MAINS = (50.0, 60.0, 100.0, 120.0, 150.0, 180.0)  # Hz, of both grids
_DRIFT = 3  # order of its polynomial
_TOUCHES = 5.0  # deviations of the force, hum included, that are taken for contact
_FEWEST_QUIET_SAMPLES = 8
_RESPONSE = 0.05  # s after the trigger in which an accelerometer has to respond
_FEWEST_BLOWS = 3  # of two blows that disagree nobody knows which is wrong
_LARGEST_DIFFERENCE = 0.25  # difference of blows at one mark; neighbouring marks differ by 0.45 and more
_OVER_THE_OTHERS = 4.0  # times the difference of the others among themselves


class BlowFault(StrEnum):
    """Why a blow does not count."""

    DOUBLE_HIT = "double hit"
    OVERLOAD = "overload"
    CLIPPED = "clipped"
    WEAK = "weak"
    SOFT = "soft"
    LATE_TRIGGER = "late trigger"
    NO_RESPONSE = "no response"
    INCONSISTENT = "inconsistent"
    """Found only by comparison with the other blows of its point."""


@dataclass(frozen=True)
class BlowLimits:
    """The limits that a blow has to keep.

    Attributes:
        lowest_peak_force: in N.
        bounce: second contact, as a fraction of the peak, that noise must not hide. Any that is seen is a double hit,
            from half of this on.
        longest_rise: largest distance in s between trigger and peak.
        highest_frequency: in Hz, up to which the force has to reach; None leaves its spectrum unchecked.
        deepest_spectrum: smallest force at `highest_frequency`, as a fraction of the force at low frequency.
    """

    lowest_peak_force: float = 10.0
    bounce: float = 0.05
    longest_rise: float = 0.005
    highest_frequency: float | None = None
    deepest_spectrum: float = 0.1


@dataclass(frozen=True)
class BlowReason:
    """A fault and the sentence, with figures, that says so to the person with the hammer."""

    fault: BlowFault
    text: str

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class BlowVerdict:
    """The verdict on a blow.

    Attributes:
        reasons: why the blow is refused; empty where it counts.
        peak_force: in N.
        second_contact: largest contact but the main one, as a fraction of it; 0 where there is none.
    """

    reasons: tuple[BlowReason, ...]
    peak_force: float
    second_contact: float

    @property
    def accepted(self) -> bool:
        """Whether the blow counts."""
        return not self.reasons

    @property
    def faults(self) -> tuple[BlowFault, ...]:
        """The faults alone."""
        return tuple(reason.fault for reason in self.reasons)


def check_blow(
    force: Real,
    acceleration: Real,
    sample_rate: float,
    trigger_index: int,
    limits: BlowLimits,
    overloaded: bool = False,
) -> BlowVerdict:
    """Judge one blow.

    Args:
        force: (samples,) in N, positive when the hammer pushes.
        acceleration: (sensors, samples) or (samples,) in m/s^2.
        sample_rate: in Hz.
        trigger_index: sample at which the trigger came; what lies 2 ms and more before it has to be quiet.
        limits: what a blow has to keep.
        overloaded: whether the device reported an overload on any channel.

    Raises:
        AnalysisError: shapes differ, or too few samples before the trigger to know the noise.
    """
    sensors = np.atleast_2d(acceleration)
    if force.ndim != 1 or sensors.shape[1] != force.size:
        raise AnalysisError(f"force has shape {force.shape} and acceleration {sensors.shape}; give equal samples")
    quiet = trigger_index - max(_FILTER.size, round(2e-3 * sample_rate))
    if quiet < _FEWEST_QUIET_SAMPLES or trigger_index >= force.size:
        raise AnalysisError(
            f"{trigger_index} of {force.size} samples before the trigger at {sample_rate:g} Hz leave {quiet} to "
            f"measure the quiet by, {_FEWEST_QUIET_SAMPLES} are needed; record a longer pre-trigger"
        )
    force = force - np.median(force[:quiet])
    contacts = _contacts(force, limits.bounce)
    if contacts.detectable >= limits.bounce:
        contacts = _contacts(_without_hum(force, sample_rate), limits.bounce)
    peak = int(np.argmax(force))
    reasons = [
        *_overload(force, sensors, overloaded),
        *_weakness(float(force[peak]), contacts, limits),
        *_late_trigger((peak - trigger_index) / sample_rate, limits),
        *_double_hit(contacts, sample_rate),
        *_softness(force, sample_rate, limits),
        *_dead_sensors(sensors, quiet, trigger_index, sample_rate),
    ]
    return BlowVerdict(
        reasons=tuple(reasons),
        peak_force=float(force[peak]),
        second_contact=contacts.second,
    )


@dataclass(frozen=True)
class _Contacts:
    """Contacts of the hammer in the filtered force.

    Attributes:
        second: height of the second largest over its surroundings, as a fraction of the main one; 0 if there is none.
        delay: from the main to the second contact, in samples.
        detectable: smallest fraction at which a contact stands out from noise, with few false alarms and few misses.
    """

    second: float
    delay: int
    detectable: float


def _contacts(force: Real, bounce: float) -> _Contacts:
    smooth = np.convolve(force, _FILTER, mode="same")
    main = int(np.argmax(smooth))
    # height over surroundings is a difference of two noisy values
    noise = np.sqrt(2) * _robust_deviation(smooth) / smooth[main]
    unlikely = noise * ndtri(1 - _FALSE_ALARM / force.size)
    detectable = float(unlikely + noise * ndtri(1 - _MISS))
    peaks, found = find_peaks(smooth, prominence=max(unlikely, bounce / 2) * smooth[main])
    heights = np.where(peaks == main, 0.0, found["prominences"])
    if not np.any(heights > 0):
        return _Contacts(0.0, 0, detectable)
    second = int(np.argmax(heights))
    return _Contacts(float(heights[second] / smooth[main]), int(peaks[second]) - main, detectable)


def _without_hum(force: Real, sample_rate: float) -> Real:
    """The force without drift and mains hum, which are no contacts and hide none: fitted where nothing touches."""
    place = np.linspace(-1, 1, force.size)
    turn = 2j * np.pi * np.arange(force.size) / sample_rate
    tones = np.exp(np.array([tone for tone in _MAINS if tone < sample_rate / 2])[:, None] * turn)
    tones = np.concatenate([tones, tones * place])  # the mains is never exactly at its frequency
    columns = np.concatenate([np.polynomial.legendre.legvander(place, _DRIFT).T, tones.real, tones.imag]).T
    level = np.abs(force - np.median(force))
    touched = (
        np.convolve(level > _TOUCHES * _robust_deviation(force), np.ones(round(5e-3 * sample_rate)), mode="same") > 0
    )
    if np.count_nonzero(~touched) < 2 * columns.shape[1]:
        return force
    return np.asarray(force - columns @ np.linalg.lstsq(columns[~touched], force[~touched])[0])


def _robust_deviation(signal: Real) -> float:
    """Standard deviation of Gaussian noise under short contacts, which the median passes over."""
    return float(np.median(np.abs(signal - np.median(signal))) / ndtri(0.75))


def _overload(force: Real, sensors: Real, overloaded: bool) -> Iterator[BlowReason]:
    if overloaded:
        yield BlowReason(
            BlowFault.OVERLOAD,
            f"the device reported an overload; the force peaked at {np.max(force):.0f} N: strike softer",
        )
    for name, signal in (("force", force), *((f"accelerometer {k + 1}", a) for k, a in enumerate(sensors))):
        top = float(signal[np.argmax(np.abs(signal))])
        if abs(top) > _OUT_OF_NOISE * _robust_deviation(signal) and _clipped(signal * np.sign(top)):
            ties = np.count_nonzero(signal == top)
            yield BlowReason(BlowFault.CLIPPED, f"{name} is clipped: {ties} samples stand at its extreme, {top:.4g}")


def _clipped(signal: Real) -> bool:
    """Whether more samples share the largest value than the steps of the converter make likely.

    Two samples tie by chance as often as a step of the converter, the smallest difference there is, fits into the
    spacing of the largest values. With 24 bits two ties tell, with 16 it takes more.
    """
    values, counts = np.unique(signal, return_counts=True)
    if values.size <= _EXTREME_VALUES:
        return False
    chance = np.min(np.diff(values)) / ((values[-1] - values[-1 - _EXTREME_VALUES]) / _EXTREME_VALUES)
    return bool(counts[-1] > 1 and chance ** (counts[-1] - 1) < _CHANCE_OF_TIES)


def _weakness(peak: float, contacts: _Contacts, limits: BlowLimits) -> Iterator[BlowReason]:
    if peak < limits.lowest_peak_force:
        yield BlowReason(
            BlowFault.WEAK,
            f"weak blow: the force peaked at {peak:.1f} N, at least {limits.lowest_peak_force:g} N is needed",
        )
    elif contacts.detectable <= 0:
        yield BlowReason(
            BlowFault.WEAK,
            "weak blow: more than half of the force record does not move at all, so no second contact stands out from "
            f"the converter's steps beside a peak of {peak:.1f} N; choose a smaller range, or strike harder",
        )
    elif contacts.detectable >= limits.bounce:
        yield BlowReason(
            BlowFault.WEAK,
            f"weak blow: noise hides a second contact below {100 * contacts.detectable:.1f} % of the peak of "
            f"{peak:.1f} N, and {100 * limits.bounce:g} % has to be seen",
        )


def _late_trigger(delay: float, limits: BlowLimits) -> Iterator[BlowReason]:
    if abs(delay) > limits.longest_rise:
        side = "after" if delay > 0 else "before"
        yield BlowReason(
            BlowFault.LATE_TRIGGER,
            f"late trigger: the force peaked {1e3 * abs(delay):.1f} ms {side} it, "
            f"not within {1e3 * limits.longest_rise:g} ms",
        )


def _double_hit(contacts: _Contacts, sample_rate: float) -> Iterator[BlowReason]:
    if contacts.second > 0:
        side = "after" if contacts.delay > 0 else "before"
        yield BlowReason(
            BlowFault.DOUBLE_HIT,
            f"double hit: a second contact of {100 * contacts.second:.1f} % of the peak, "
            f"{1e3 * abs(contacts.delay) / sample_rate:.1f} ms {side} it",
        )


def _softness(force: Real, sample_rate: float, limits: BlowLimits) -> Iterator[BlowReason]:
    if limits.highest_frequency is None:
        return
    size = np.abs(np.fft.rfft(force))
    frequency = np.fft.rfftfreq(force.size, 1 / sample_rate) / limits.highest_frequency
    reach = float(np.median(size[(frequency > 0.9) & (frequency <= 1)]) / np.median(size[frequency <= 0.1]))
    if reach < limits.deepest_spectrum:
        yield BlowReason(
            BlowFault.SOFT,
            f"soft blow: at {limits.highest_frequency:g} Hz the force has {100 * reach:.1f} % of what it has at low "
            f"frequency, at least {100 * limits.deepest_spectrum:g} % is needed; take a harder tip",
        )


def _dead_sensors(sensors: Real, quiet: int, trigger_index: int, sample_rate: float) -> Iterator[BlowReason]:
    for index, signal in enumerate(sensors):
        after = signal[trigger_index : trigger_index + max(quiet, round(_RESPONSE * sample_rate))]
        before, level = np.var(signal[:quiet], ddof=1), np.var(after, ddof=1)
        if level <= before * fdtri(after.size - 1, quiet - 1, 1 - _FALSE_ALARM):
            yield BlowReason(
                BlowFault.NO_RESPONSE,
                f"accelerometer {index + 1} did not respond: {np.sqrt(level):.3g} m/s^2 rms after the trigger, "
                f"{np.sqrt(before):.3g} m/s^2 before; check its cable",
            )


def check_point(
    force: Real, acceleration: Real, sample_rate: float, band: tuple[float, float]
) -> tuple[BlowReason | None, ...]:
    """Which blows do not fit the others of their point; to be asked again with every blow that is added.

    Args:
        force: (blows, samples) in N, of blows that count by themselves.
        acceleration: (blows, samples) in m/s^2.
        sample_rate: in Hz.
        band: lowest and highest frequency in Hz that are compared.

    Returns:
        For each blow the reason why it is inconsistent with the others, or None; all None for fewer than three blows.

    Raises:
        AnalysisError: shapes differ, or there are no lines in the band.
    """
    if force.ndim != 2 or force.shape != acceleration.shape:
        raise AnalysisError(f"force has shape {force.shape} and acceleration {acceleration.shape}; give equal ones")
    frequency = np.fft.rfftfreq(force.shape[1], 1 / sample_rate)
    within = (frequency >= band[0]) & (frequency <= band[1])
    if not np.any(within):
        raise AnalysisError(f"there are no lines between {band[0]:g} and {band[1]:g} Hz")
    blows = len(force)
    if blows < _FEWEST_BLOWS:
        return (None,) * blows
    accelerance = np.fft.rfft(acceleration)[:, within] / np.fft.rfft(force)[:, within]
    difference = _differences(accelerance, accelerance)
    opposite = _differences(accelerance, -accelerance)
    return tuple(_judged(difference, opposite[blow], blow, band) for blow in range(blows))


def _differences(one: Complex, other: Complex) -> Real:
    """(blows, blows) median over lines of the difference over the root mean square of both: 0 alike, 2 opposite."""
    size = np.abs(one) ** 2
    return np.array(
        [np.median(np.abs(row - other) * np.sqrt(2 / (own + size)), axis=1) for row, own in zip(one, size, strict=True)]
    )


def _judged(difference: Real, opposite: Real, blow: int, band: tuple[float, float]) -> BlowReason | None:
    others = np.delete(np.arange(len(difference)), blow)
    own = float(np.median(difference[blow, others]))
    pairs = difference[np.ix_(others, others)][np.triu_indices(others.size, 1)]
    among_others = float(np.median(pairs))
    limit = max(_LARGEST_DIFFERENCE, _OVER_THE_OTHERS * among_others)
    if own <= limit:
        return None
    turned = float(np.median(opposite[others])) <= limit
    advice = "it has the opposite sign: turn the hammer round" if turned else "was another point struck?"
    return BlowReason(
        BlowFault.INCONSISTENT,
        f"inconsistent with the others at its point: between {band[0]:g} and {band[1]:g} Hz its accelerance differs "
        f"from theirs by {100 * own:.0f} %, those from each other by {100 * among_others:.0f} %; {advice}",
    )
