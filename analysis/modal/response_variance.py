"""Variance of averaged accelerances from the available data.

Always per real and per imaginary part, in the square of the accelerance's unit.
"""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import convolve1d, median_filter

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, FrequencyResponses, Real

# weights of the fourth difference over five neighbouring lines; cubic polynomials have none
_DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0])
_MEDIAN_OF_EXPONENTIAL = np.log(2.0)
_NEIGHBOURS = 31  # lines
_ROUNDS = 100  # of multiplicative updates
_KNOTS = 8
_KNOT_RATIO = 0.4  # of its frequency, between a knot and the one below
_LINES_A_KNOT = 60
_LEAST_FREEDOM = 4.0  # of a variance that serves as a weight; below 2 the mean of its inverse is infinite
WEIGHED_OVER = 5
"""Lines over which the variance of a few blows is averaged before it serves as a weight."""
CREDIBLE = 0.5
"""Coherence above which lines tell how finely a file rounds; below are lines without signal, such as 0 Hz."""
_QUIETEST = 1e-3  # deviation of a line, over the median of its row


def blow_scatter(force: Complex, acceleration: Complex, accelerance: Complex) -> Complex:
    """Change of H1 by each blow, (blows, lines): the residual of the blow by its weight in the average.

    The outer products of F_b* (A_b - H F_b) / sum |F_b|^2 add up to the covariance of the weighted mean, for scatter
    from noise and from differing blows alike; sqrt(n / (n - 1)) accounts for the subtracted mean.

    Args:
        force: (blows, lines) spectra of the force.
        acceleration: (blows, lines) spectra of the acceleration.
        accelerance: (lines,) their averaged ratio.
    """
    blows = force.shape[0]
    if blows < 2:
        raise AnalysisError("one blow has no scatter; strike at least twice")
    power = np.sum(np.abs(force) ** 2, axis=0)
    left = acceleration - accelerance * force
    return np.asarray(force.conj() * left / power * np.sqrt(blows / (blows - 1)))


def h2_scatter(force: Complex, acceleration: Complex, accelerance: Complex) -> Complex:
    """Change of H2 by each blow, (blows, lines): as `blow_scatter` of its inverse, with the channels exchanged.

    `accelerance` is H2 (lines,), zero without acceleration.
    """
    blows = force.shape[0]
    heard = np.maximum(np.sum(np.abs(acceleration) ** 2, axis=0), np.finfo(float).tiny)
    left = acceleration - accelerance * force
    return np.asarray(accelerance * acceleration.conj() * left / heard * np.sqrt(blows / (blows - 1)))


def variance_from_scatter(scatter: Complex) -> Real:
    """Variance (lines,) of an average from `blow_scatter` (blows, lines)."""
    return np.asarray(np.sum(np.abs(scatter) ** 2, axis=0) / 2)


def variance_from_coherence(accelerance: Complex, coherence: Real, averages: int) -> Real:
    """Variance, in the shape of `accelerance`, from the coherence of `averages` blows.

    (1 - g^2) / (2 n g^2) |H|^2 (J. S. Bendat, A. G. Piersol, Random Data, 4th ed., Section 9.2), with n - 1
    in place of n because the coherence of n blows is itself an estimate; without bias at ten blows.

    Files round coherence, to three decimals or so. There 1 means less than half a step below 1, and is taken for that:
    a variance of zero would give such a line all of the weight. The step is from the largest value below 1.

    Raises:
        AnalysisError: one average, or a coherence outside 0 to 1.
    """
    if averages < 2:
        raise AnalysisError(f"the coherence of {averages} blow says nothing about noise; give two averages or more")
    if np.any((coherence < 0) | (coherence > 1)):
        raise AnalysisError("coherence lies outside 0 to 1")
    floor = 1 / (averages * 1e6)
    below = coherence[(coherence > CREDIBLE) & (coherence < 1)]
    known = np.clip(coherence, floor, (1 + np.max(below)) / 2 if below.size else 1.0)
    return np.asarray((1 - known) / (2 * (averages - 1) * known) * np.abs(accelerance) ** 2)


def variance_from_neighbours(accelerance: Complex) -> Real:
    """Variance (rows, lines) from the differences of neighbouring lines, as a start without other data.

    The fourth difference over five lines cancels smooth parts. Its median over 31 lines ignores resonances narrower
    than half of that. The scatter about a fit replaces this estimate later.

    Raises:
        AnalysisError: fewer than five lines.
    """
    if accelerance.shape[1] < _DIFFERENCE.size:
        raise AnalysisError(
            f"{accelerance.shape[1]} lines are too few to estimate noise from neighbours; give {_DIFFERENCE.size}"
        )
    difference = np.apply_along_axis(np.convolve, 1, accelerance, _DIFFERENCE, mode="valid")
    square = np.abs(difference) ** 2 / (2 * np.sum(_DIFFERENCE**2))
    typical = median_filter(square, size=(1, _NEIGHBOURS), mode="reflect") / _MEDIAN_OF_EXPONENTIAL
    return np.asarray(np.pad(typical, ((0, 0), (2, 2)), mode="edge"))


def variance_from_residual(accelerance: Complex, fitted: Complex, frequency: Real | None = None) -> Real:
    """Variance (rows, lines) by the scatter of `accelerance` about `fitted`: a floor and a part proportional to |H|^2.

    Each row has its own floor; all share the proportion, otherwise rows that agree by chance would get all the weight.
    The parts are the most likely ones for Gaussian errors, by multiplicative updates (C. Fevotte, N. Bertin, J.-L.
    Durrieu, Neural Computation 21, 2009, for the Itakura-Saito divergence; of an exponent of 1, which is quicker than
    1/2). A row that fits exactly keeps a floor of 1e-9 of its largest value.

    Args:
        accelerance, fitted: (rows, lines).
        frequency: (lines,) in Hz where the floor may vary with it, straight between knots; else it is constant.
    """
    square = np.abs(accelerance - fitted) ** 2 / 2
    power = np.abs(fitted) ** 2
    hats = np.ones((1, power.shape[1])) if frequency is None else _hats(frequency)
    smallest = 1e-18 * np.max(np.abs(accelerance) ** 2, axis=1, keepdims=True)
    floor = square @ hats.T / np.sum(hats, axis=1) / 2
    share = float(np.mean(square) / np.mean(power)) / 2
    variance = np.maximum(floor @ hats + share * power, smallest)
    for _ in range(_ROUNDS):
        weight, found = 1 / variance, square / variance**2
        floor = floor * (found @ hats.T) / (weight @ hats.T)
        share *= float(np.sum(found * power) / np.sum(weight * power))
        variance = np.maximum(floor @ hats + share * power, smallest)
    return np.asarray(variance)


def _hats(frequency: Real) -> Real:
    """(knots, lines) that add up to one, an eighth of the band apart, and closer towards 0 Hz, as noise falls there."""
    lowest, highest = float(frequency[0]), float(frequency[-1])
    closest = _LINES_A_KNOT * (highest - lowest) / (frequency.size - 1)
    widest = max((highest - lowest) / _KNOTS, closest)
    knots = [highest]
    while knots[-1] - closest > lowest:
        knots.append(max(lowest, knots[-1] - min(widest, max(_KNOT_RATIO * knots[-1], closest))))
    knots[-1] = lowest
    return np.array([np.interp(frequency, knots[::-1], each) for each in np.eye(len(knots))])


def standard_deviation(responses: FrequencyResponses) -> Real:
    """(rows, lines) from the stated variance or else from neighbouring lines; at least 1e-9 of the largest value."""
    stated = responses.variance
    if stated is None:
        deviation = levelled(np.sqrt(variance_from_neighbours(responses.accelerance)))
    else:
        deviation = np.sqrt(stated)
    floor = 1e-9 * np.max(np.abs(responses.accelerance), axis=1, keepdims=True)
    return np.asarray(np.maximum(deviation, floor))


def levelled(deviation: Real) -> Real:
    """(rows, lines) with lines of next to no noise, such as those near 0 Hz, kept from taking all of the weight."""
    return np.maximum(deviation, _QUIETEST * np.median(deviation, axis=1, keepdims=True))


def smoothed_variance(variance: Real, lines: int = WEIGHED_OVER) -> Real:
    """Mean of `variance` (rows, lines) over `lines` neighbouring lines.

    The scatter of ten blows gives the variance of a line to 30 % only. As a weight it would follow the noise:
    chi-square would be 1/8 too high, and every estimate 10 % less certain than possible.
    """
    # no running sum: rounding beside lines a million times as large would make it negative
    return np.asarray(convolve1d(variance, np.full(lines, 1 / lines), axis=-1, mode="nearest"))


def weighing_variance(variance: Real, blows: int | Sequence[int], lines: int = WEIGHED_OVER) -> Real:
    """`smoothed_variance` of a scatter, raised so that squared errors over it are 1 on the mean.

    The mean over lines follows chi-square of m = 2 (blows - 1) (lines averaged) degrees of freedom, and the inverse of
    that has the mean m / (m - 2): 1.25 for two blows and five lines, which would count as an error of the model. Lines
    at the ends of a row are averaged with fewer others and have a smaller m.

    A fit multiplies its covariance by chi-square per datum. What is raised here is not multiplied again there.

    Args:
        variance: (rows, lines) from the scatter or coherence of blows, independent from line to line.
        blows: behind each row, or behind all. A row of one has its variance from elsewhere, and is not raised.
        lines: averaged.
    """
    return np.asarray(smoothed_variance(variance, lines) * _raised(blows, variance.shape[-1], lines))


def weighed_over_more(variance: Real, blows: int | Sequence[int], lines: int) -> Real:
    """A `weighing_variance` averaged over `lines` more, and raised for both means together instead of the first alone.

    Args:
        variance: (rows, lines) from `weighing_variance` over its usual lines.
        blows: as they were given there.
        lines: over which its values are averaged again.
    """
    places = variance.shape[-1]
    plain = smoothed_variance(variance / _raised(blows, places, WEIGHED_OVER), lines)
    return np.asarray(plain * _raised(blows, places, WEIGHED_OVER, lines))


def _raised(blows: int | Sequence[int], places: int, *means: int) -> Real:
    """(rows, places) m / (m - 2) of a variance that was averaged over `means` lines one after another."""
    # far from both ends of a row all lines are alike, so that a short row tells the shares of a long one
    few = min(places, 2 * sum(means) + 1)
    shares = np.eye(few)
    for lines in means:
        shares = smoothed_variance(shares, lines)
    squares, middle = np.sum(shares**2, axis=0), few // 2
    squares = np.concatenate([squares[:middle], np.full(places - few, squares[middle]), squares[middle:]])
    count = np.atleast_1d(blows)[:, None]
    freedom = np.maximum(2 * (count - 1) / squares, _LEAST_FREEDOM)
    return np.where(count > 1, freedom / (freedom - 2), 1.0)
