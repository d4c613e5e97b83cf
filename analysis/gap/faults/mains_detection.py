"""Mains hum: found in records of blows or as dips of coherence, and taken out of the accelerances.

A hum is there before the blow and after it. Once the beam is silent, what stands out of the neighbouring frequencies
exactly at 50 or 60 Hz or a multiple, and does not die away, is hum. Where no records were kept, hum shows in the
averages: it differs from blow to blow, and lowers the coherence of all rows at single lines.

A record holds no whole number of periods of the mains, which is never exactly at its 50 or 60 Hz. Seen through the
record, the tone then stands at its line with C, and k lines away with C d / (d - k), where d is its distance from that
line, in lines (F. J. Harris, Proc. IEEE 66, 1978, for the rectangular window). Averages divide by the force, which is
smooth.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from analysis.direct.mains_hum import MAINS
from analysis.frequency_response import Complex, Real
from analysis.gap.effect import RecordEffect
from analysis.gap.measurement import HammerSet, Measurement, RawBlow
from analysis.gap.parameter import ParameterEstimate

HUM = "mains_hum"
"""Hz, of the world's grids."""
MULTIPLES = 10
SHARED = 300.0
"""Hz; this and its multiples are multiples of both mains, and prove neither."""
SILENCE = 0.5
"""Share of a record, at its end, in which the beam is assumed to be at rest."""
COMMON = 10.0
"""Hz, of which both mains are multiples."""
SHORTEST = 0.4
"""s, least duration of the silence; in a shorter one, the neighbours of two tones overlap."""
NEIGHBOURS = np.array([*range(-9, -2), *range(3, 10)])
"""Resolved frequencies, or lines, beside a tone that it is compared with."""
FALSE_ALARM = 1e-7
LEAST = 6.0
"""Least power of a tone over that of its neighbours, for any number of records."""
LASTING = 0.5
"""Power of a tone in the later half of the silence over that in the earlier half; ringing of the beam has less."""
DIP = 5.0
"""Noise at a line over that at its neighbours, from the coherence of all rows together, that shows a tone."""
ALONE = 30.0
"""Ratio as of `DIP`, for a tone at the mains frequency itself without multiples."""
BESIDE = 2
"""Lines on either side of a tone that are left out together with it."""


@dataclass(frozen=True)
class MainsTones:
    """Tones at the mains and its multiples.

    Attributes:
        mains: Hz.
        tones: Hz, those that stand out.
        amplitude: of the first of them, m/s^2, with its standard deviation; None without records.
    """

    mains: float
    tones: tuple[float, ...]
    amplitude: tuple[float, float] | None = None


def mains_hum(measurement: Measurement) -> MainsTones | None:
    """Hum in the records of blows, else in the averages; None where there is none."""
    return _in_records(measurement.blows) or _in_averages(measurement.sets)


def found_hum(hum: MainsTones) -> RecordEffect:
    """The effect of the catalogue that a hum is."""
    parameters, size = {"mains": ParameterEstimate(hum.mains, (hum.mains, hum.mains), "Hz")}, "coherence dips there"
    if hum.amplitude is not None:
        value, deviation = hum.amplitude
        parameters["amplitude"] = ParameterEstimate(
            value, (value - 1.645 * deviation, value + 1.645 * deviation), "m/s^2"
        )
        size = f"{value:.2g} m/s^2 at {hum.tones[0]:g} Hz"
    tones = ", ".join(f"{tone:g}" for tone in hum.tones)
    fault = f"mains hum on the accelerometer at {tones} Hz ({size}); these lines are left out"
    return RecordEffect(HUM, parameters, fault)


def without_tones(measurement: Measurement, hum: MainsTones) -> Measurement:
    """A measurement without the lines at and next to the tones, and without their leakage into other lines."""

    def quiet(each: HammerSet) -> HammerSet:
        spacing = float(np.median(np.diff(each.frequency))) if each.frequency.size > 1 else 0.0
        away = np.min(np.abs(each.frequency[:, None] - np.array(hum.tones)), axis=1)
        keep = away > (BESIDE + 0.5) * spacing
        return each.lines(keep) if np.any(keep) else each

    return replace(measurement, sets=tuple(map(quiet, without_leakage(measurement.sets, hum.tones))))


def _multiples(mains: float, highest: float) -> list[float]:
    return [mains * multiple for multiple in range(1, MULTIPLES + 1) if mains * multiple < highest]


# --- in the silence at the end of blows ---


@dataclass(frozen=True, eq=False)
class _Silence:
    """Power spectra (lines,) of the end of one record, and of the earlier and the later half of it, (m/s^2)^2."""

    spacing: float
    whole: Real
    halves: tuple[Real, Real]

    def at(self, tone: float) -> float:
        return float(self.whole[round(tone / self.spacing)])

    def beside(self, tone: float) -> float:
        """Power of noise: the median of the neighbours, which a resonance that still rings does not change."""
        near = round(tone / self.spacing) + NEIGHBOURS
        return max(float(np.median(self.whole[near]) / np.log(2.0)), float(np.finfo(float).tiny))

    def half(self, which: int, tone: float) -> float:
        return float(self.halves[which][round(tone / self.spacing / 2)])


def _silence(blow: RawBlow) -> _Silence | None:
    """The silence of a record, of a length that makes the mains and its multiples lines; None if it is too short."""
    periods = int(SILENCE * blow.acceleration.size / blow.sample_rate * COMMON / 2) * 2
    samples = round(periods / COMMON * blow.sample_rate)
    if periods < SHORTEST * COMMON:
        return None
    end, half = blow.acceleration[-samples:], samples // 2
    return _Silence(COMMON / periods, _power(end), (_power(end[:half]), _power(end[half:])))


def _power(signal: Real) -> Real:
    """Square of the amplitude by line, seen through a Hann window."""
    window = np.hanning(signal.size)
    return np.asarray(np.abs(np.fft.rfft(window * (signal - np.mean(signal)))) ** 2 * (2 / np.sum(window)) ** 2)


def _in_records(blows: Sequence[RawBlow]) -> MainsTones | None:
    ends = [end for end in map(_silence, blows) if end is not None]
    if not ends:
        return None
    found, highest = list[MainsTones](), 0.4 * min(blow.sample_rate for blow in blows)
    by_chance = float(chi2.isf(FALSE_ALARM, 2 * len(ends))) / (2 * len(ends))
    for mains in MAINS:
        tones = [tone for tone in _multiples(mains, highest) if _hums(ends, tone, max(LEAST, by_chance))]
        if mains in tones or sum(tone % SHARED > 0 for tone in tones) > 1:
            amplitude = np.sqrt(np.mean([end.at(tones[0]) for end in ends]))
            deviation = np.sqrt(np.mean([end.beside(tones[0]) for end in ends]) / 2 / len(ends))
            found.append(MainsTones(mains, tuple(tones), (float(amplitude), float(deviation))))
    return max(found, key=lambda each: len(each.tones), default=None)


def _hums(ends: Sequence[_Silence], tone: float, least: float) -> bool:
    """Whether a tone stands out of its neighbours, and lasts."""
    stands_out = np.mean([end.at(tone) / end.beside(tone) for end in ends]) > least
    earlier, later = (sum(end.half(which, tone) for end in ends) for which in (0, 1))
    return bool(stands_out and later > LASTING * earlier)


# --- in averages ---


def _in_averages(sets: Sequence[HammerSet]) -> MainsTones | None:
    noises = [(each.frequency, noise) for each in sets if (noise := _noise(each)) is not None]
    if not noises:
        return None
    found, highest = list[MainsTones](), max(float(frequency[-1]) for frequency, _ in noises)
    for mains in MAINS:
        dips = {tone: _dip(noises, tone) for tone in _multiples(mains, highest)}
        tones = tuple(tone for tone, dip in dips.items() if dip > DIP)
        if sum(tone % SHARED > 0 for tone in tones) > 1 or dips.get(mains, 0.0) > ALONE:
            found.append(MainsTones(mains, tones))
    return max(found, key=lambda each: len(each.tones), default=None)


def _noise(each: HammerSet) -> Real | None:
    """(rows, lines) logarithm of (1 - g^2) / g^2 |H|^2, of noise over force; None without coherence."""
    if each.coherence is None or each.frequency.size < 2 * NEIGHBOURS.size:
        return None
    known = np.clip(each.coherence, 1e-9, 1 - 1e-9)
    return np.asarray(np.log((1 - known) / known) + 2 * np.log(np.maximum(np.abs(each.accelerance), 1e-12)))


def _dip(noises: Sequence[tuple[Real, Real]], tone: float) -> float:
    """Noise at the line of a tone over that at its neighbours, the geometric mean of all rows; 0 without that line."""
    shares = list[Real]()
    for frequency, noise in noises:
        line = int(np.argmin(np.abs(frequency - tone)))
        spacing = frequency[1] - frequency[0]
        if (
            abs(frequency[line] - tone) <= spacing / 2
            and 0 <= line + NEIGHBOURS[0] <= line + NEIGHBOURS[-1] < frequency.size
        ):
            shares.append(noise[:, line] - np.median(noise[:, line + NEIGHBOURS], axis=1))
    return float(np.exp(np.mean(np.concatenate(shares)))) if shares else 0.0


AROUND, DEGREE = 30, 5
"""Lines on either side of a tone in which accelerances, without leakage, are a polynomial of this degree."""
FARTHEST = 0.45
"""Distance in lines by which a tone may differ from its nearest line."""


def without_leakage(sets: Sequence[HammerSet], tones: Sequence[float]) -> tuple[HammerSet, ...]:
    """Hammer sets without the leakage of tones, which all differ from their lines by the same share of frequency."""
    above = below = 0.0
    heights = [[_height_and_leak(each, tone) for tone in tones] for each in sets]
    for each, of_set in zip(sets, heights, strict=True):
        for tone, found in zip(tones, of_set, strict=True):
            if found is not None:
                height, leak = found
                per_line = tone / _spacing(each)
                above -= per_line * float(np.vdot(height, leak).real)
                below += per_line**2 * float(np.vdot(height, height).real)
    off = above / below if below > 0 else 0.0
    return tuple(_cleaned(each, tones, of_set, off) for each, of_set in zip(sets, heights, strict=True))


def _height_and_leak(each: HammerSet, tone: float) -> tuple[Complex, Complex] | None:
    """(rows,) C, and the estimate of -C d; None where the tone is too near to an end of the lines."""
    line = int(np.argmin(np.abs(each.frequency - tone)))
    if not AROUND <= line < each.frequency.size - AROUND:
        return None
    away = np.arange(-AROUND, AROUND + 1)
    at_tone = (away == 0).astype(float)
    leak = np.where(away == 0, 0.0, 1 / np.where(away == 0, 1, away))
    smooth = np.vander(away / AROUND, DEGREE + 1)
    found, *_ = np.linalg.lstsq(
        np.column_stack([smooth, at_tone, leak]), each.accelerance[:, line + away].T.astype(complex), rcond=None
    )
    return found[-2], found[-1]


def _cleaned(
    each: HammerSet, tones: Sequence[float], heights: Sequence[tuple[Complex, Complex] | None], off: float
) -> HammerSet:
    accelerance = each.accelerance.copy()
    for tone, found in zip(tones, heights, strict=True):
        if found is not None:
            line = int(np.argmin(np.abs(each.frequency - tone)))
            lines_off = float(np.clip(off * tone / _spacing(each), -FARTHEST, FARTHEST))
            away = np.arange(each.frequency.size) - line
            shape: Real = np.where(away == 0, 0.0, lines_off / (lines_off - np.where(away == 0, 1, away)))
            accelerance -= found[0][:, None] * shape
    return replace(each, accelerance=accelerance, reference=None)


def _spacing(each: HammerSet) -> float:
    return float(np.median(np.diff(each.frequency)))
