"""Mains hum under sine points at 50 or 60 Hz and multiples: its size from the other records of a run.

At a multiple of the mains the hum cannot be distinguished from the sine: it adds h_F to the first harmonic of the force
and h_X to that of the displacement, which shifts k + i h by (h_F - (k + i h) h_X) / X. Its phase against the sine is
another one at each start, so the shift is an error of variance (|h_F|^2 + |k + i h|^2 |h_X|^2) / (2 |X|^2) in k and in
h.

Records at other frequencies have the same hum beside their sine. Its power is what their spectrum has at the multiple,
through a Kaiser window (F. J. Harris, Proc. IEEE 66, 1978) that lets a millionth of the sine through, less what it has
beside it.

A plan that knows the mains measures such points a cycle in the record beside the multiple instead. There the tones are
fitted with the sine (`fit_sine`), and nothing has to be assumed about the hum.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal.windows import kaiser

from analysis.direct.dynamic_stiffness import HUM, DynamicStiffness
from analysis.frequency_response import Real
from analysis.interval import Z95

MAINS = (50.0, 60.0)
MULTIPLES = 6
_WINDOW = 16.0  # beta
_CLEAR = 6.0  # resolved frequencies between a tone and the sine or its harmonics; half the lobe is 5.2
_FINER = 4  # spacing of a padded spectrum
_BESIDE = np.array([-9.0, -8.0, -7.0, -6.0, 6.0, 7.0, 8.0, 9.0])
_FEWEST_RECORDS = 4
_MATTERS = Z95**2 / 2  # variance by hum, over that by everything else, where its shift is the half-width without it
_CERTAIN = 2.3  # standard errors, one-sided 99 %

Tones = Mapping[float, Real]
"""(2,) power of displacement and force in m^2 and N^2, less that of noise, by frequency in Hz."""


@dataclass(frozen=True)
class Hum:
    """Amplitudes at one multiple of the mains.

    Attributes:
        power: (2,) squared amplitude of displacement and force, m^2 and N^2; noise may make it negative.
        standard_error: (2,) of it.
    """

    power: Real
    standard_error: Real


def multiples_of(mains: Iterable[float]) -> list[float]:
    """The multiples that count, rising, Hz, of a mains of each frequency, Hz."""
    return sorted({each * multiple for each in mains for multiple in range(1, MULTIPLES + 1)})


def tones_beside(signals: Real, sample_rate: float, frequency: float) -> Tones:
    """Powers at multiples of the mains that are clear of the sine.

    Args:
        signals: (2, samples) displacement in m and force in N.
        sample_rate: in Hz.
        frequency: of the sine, in Hz.
    """
    samples = signals.shape[1]
    resolved = sample_rate / samples
    asked = multiples_of(MAINS)
    sine = np.arange(sample_rate / 2 // frequency + 1) * frequency
    clear = [
        tone
        for tone in asked
        if tone < sample_rate / 2 - 10 * resolved and np.min(np.abs(sine - tone)) > _CLEAR * resolved
    ]
    if not clear:
        return {}
    window = kaiser(samples, _WINDOW, sym=False)
    seen = (signals - np.mean(signals, axis=1, keepdims=True)) * (2 * window / np.sum(window))
    power = np.abs(np.fft.rfft(seen, _FINER * samples)) ** 2

    def at(places: Real) -> Real:
        return np.asarray(power[:, np.round(places * _FINER / resolved).astype(int)])

    found = {}
    for tone in clear:
        beside = tone + _BESIDE * resolved
        beside = beside[np.min(np.abs(sine[:, None] - beside), axis=0) > _CLEAR * resolved]
        if beside.size >= 2:
            found[tone] = at(np.array([tone]))[:, 0] - np.mean(at(beside), axis=1)
    return found


def mains_beside(frequency: float) -> tuple[float, ...]:
    """Multiples of the mains, Hz, beside one of which a sine of `frequency` Hz was measured."""
    mains = min(MAINS, key=lambda each: abs(each * max(1, round(frequency / each)) - frequency))
    return tuple(mains * multiple for multiple in range(1, 1 + max(MULTIPLES, round(frequency / mains))))


def hum_of(records: Iterable[Tones]) -> dict[float, Hum]:
    """Hum at each multiple of the mains that enough records tell."""
    by_tone: dict[float, list[Real]] = {}
    for record in records:
        for tone, power in record.items():
            by_tone.setdefault(tone, []).append(power)
    found = {}
    for tone, powers in by_tone.items():
        if len(powers) >= _FEWEST_RECORDS:
            error = np.std(powers, axis=0, ddof=1) / math.sqrt(len(powers))
            found[tone] = Hum(np.mean(powers, axis=0), error)
    return found


def with_hum(
    point: DynamicStiffness, duration: float, hum: Mapping[float, Hum], mains: Iterable[float] = MAINS
) -> DynamicStiffness:
    """The point with the hum at its frequency in its covariance, and in its shortcomings where that matters.

    A point at a multiple whose hum the run does not tell has a remark that says so, and its interval as it was.

    Args:
        point: as measured.
        duration: of its record, s.
        hum: of the run.
        mains: frequencies that the mains may have, Hz.
    """
    at = [tone for tone in multiples_of(mains) if abs(tone - point.frequency) * duration < 1]
    if at and not any(tone in hum for tone in at):
        said = f"{HUM} of {at[0]:g} Hz is not known here, and the interval is without it; measure beside {at[0]:g} Hz"
        return replace(point, remarks=(*point.remarks, said))
    under = [(tone, each) for tone, each in hum.items() if abs(tone - point.frequency) * duration < 1]
    if not under:
        return point
    tone, found = under[0]
    weight = np.array([point.magnitude**2, 1.0]) / (point.amplitude_pp / 2) ** 2
    variance = max(0.0, float(weight @ found.power) / 2)
    largest = variance + _CERTAIN * float(np.linalg.norm(weight * found.standard_error)) / 2
    remarks = point.remarks
    share = math.sqrt(2 * largest) / point.magnitude
    if largest > _MATTERS * float(np.min(np.diag(point.covariance))):
        said = f"{HUM} of {tone:g} Hz shifts k by up to {100 * share:.2g} % of |k|; measure beside {tone:g} Hz"
        remarks = (*remarks, said)
    return replace(point, covariance=point.covariance + variance * np.eye(2), remarks=remarks)
