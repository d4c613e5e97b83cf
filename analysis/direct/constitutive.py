"""The law of a filled elastomer: stiffness and loss against amplitude and frequency, with its derivatives.

Amplitude after Kraus (J. Appl. Polymer Sci.: Appl. Polymer Symposia 39, 1984, 75-92): agglomerates of filler break up
and form again. With u = (x / x_c)^m, x zero to peak,

    k'(x) = k_inf + (k_0 - k_inf) / (1 + u^2),     k''(x) = k''_inf + 2 (k''_m - k''_inf) u / (1 + u^2).

Frequency by the fractional Zener model (T. Pritz, J. Sound and Vibration 195, 1996, 103-115): relaxation over decades,

    z(w) = (1 + B s) / (1 + C s),     s = (i w t)^a,

divided by |z| at a reference frequency, where the amplitude part then equals the measurement. The dynamic stiffness is
the product (k' + i k'') z / |z_ref|. Every parameter is positive, and its logarithm is fitted; so k' falls with
amplitude and rises with frequency, as for every filled rubber.
"""

from enum import IntEnum

import numpy as np

from analysis.frequency_response import Complex, Real


class LawParameter(IntEnum):
    """Place of each parameter; the vector holds natural logarithms."""

    K_INF = 0
    """k_inf, N/m: stiffness with all agglomerates broken."""
    NETWORK = 1
    """(k_0 - k_inf) / k_inf."""
    LOSS_FLOOR = 2
    """k''_inf / k_inf."""
    LOSS_PEAK = 3
    """(k''_m - k''_inf) / k_inf."""
    AMPLITUDE = 4
    """x_c, m zero to peak."""
    EXPONENT = 5
    """m."""
    RELAXATION = 6
    """B - C."""
    SHORT_TIME = 7
    """C."""
    TIME = 8
    """t, s."""
    ORDER = 9
    """a."""


def dynamic_stiffness(logarithms: Real, amplitude: Real, frequency: Real, reference: float) -> tuple[Complex, Complex]:
    """The law and its derivatives.

    Args:
        logarithms: (10,) of the parameters, in the order of `LawParameter`.
        amplitude: (points,) zero to peak, m.
        frequency: (points,) Hz.
        reference: frequency at which the amplitude part holds, Hz.

    Returns:
        (points,) k + i h in N/m, and (points, 10) its derivatives by the logarithms.
    """
    values = np.exp(logarithms)
    by_amplitude, amplitude_slopes = _kraus(values, amplitude)
    by_frequency, frequency_slopes = fractional_zener(
        values[LawParameter.RELAXATION :], np.append(frequency, reference)
    )
    level = abs(by_frequency[-1])
    # d ln |z| = Re(dz / z)
    level_slopes = (frequency_slopes[-1] / by_frequency[-1]).real
    relative = by_frequency[:-1] / level
    relative_slopes = frequency_slopes[:-1] / level - relative[:, None] * level_slopes
    slopes = np.concatenate(
        [amplitude_slopes * relative[:, None], by_amplitude[:, None] * relative_slopes], axis=1, dtype=np.complex128
    )
    return by_amplitude * relative, slopes * values


def _kraus(values: Real, amplitude: Real) -> tuple[Complex, Complex]:
    """(points,) k' + i k'' and (points, 6) derivatives by the first six parameters."""
    scale, network, floor, peak, middle, exponent = values[: LawParameter.RELAXATION]
    ratio = amplitude / middle
    u = ratio**exponent
    unbroken, breaking = 1 / (1 + u**2), 2 * u / (1 + u**2)
    shape = 1 + network * unbroken + 1j * (floor + peak * breaking)
    by_u = scale * (-2 * network * u * unbroken**2 + 2j * peak * (1 - u**2) * unbroken**2)
    one = np.ones_like(u)
    slopes = [
        shape,
        scale * unbroken,
        1j * scale * one,
        1j * scale * breaking,
        by_u * u * (-exponent / middle),
        by_u * u * np.log(ratio),
    ]
    return np.asarray(scale * shape), np.stack(slopes, axis=1)


def fractional_zener(values: Real, frequency: Real) -> tuple[Complex, Complex]:
    """(points,) z and (points, 4) derivatives by `values`: B - C, C, t in s and a; frequency (points,) in Hz."""
    relaxation, short, time, order = values
    logarithm = np.log(2 * np.pi * frequency * time) + 0.5j * np.pi
    s = np.exp(order * logarithm)
    below = 1 + short * s
    z = 1 + relaxation * s / below
    by_s = relaxation / below**2
    slopes = [s / below, -relaxation * s**2 / below**2, by_s * order * s / time, by_s * s * logarithm]
    return z, np.stack(slopes, axis=1)
