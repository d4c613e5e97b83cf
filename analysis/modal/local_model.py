"""What the cut end of one record adds to its spectrum, and the noise of each line, from the lines around it.

A record that is cut while the structure still rings holds, beside accelerance times force, the spectrum of what would
have followed. R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., Wiley 2012,
Section 7.2, and R. Pintelon, J. Schoukens, G. Vandersteen, K. Barbe, Mech. Syst. Signal Process. 24, 2010, 573-595:
both are smooth over a few lines, so that a local polynomial of either is fitted there, and the residual is noise. T.
McKelvey, G. Guerin, IFAC Proc. 45(16), 2012, 358-363: with a denominator that both share the fit also follows a mode
as narrow as a line.

The force of a hammer is as smooth as both, so that on the lines alone they are not distinguished. Here the spectrum is
also taken half way between lines, as of a record with as many zeros behind it: the transient begins at its end T and
has there the factor exp(-i w T) = -1. Noise of lines and half lines is correlated as known from the record's length.
"""

from dataclasses import dataclass, fields

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real

HALF_WINDOW = 8
"""Lines on either side of the one that is estimated."""
SHORTEST = 4 * HALF_WINDOW
"""Samples of a record that has a local model."""
_DEGREE = 2  # of the numerators
_POLES = (1, 2)  # of the denominator: modes within a window
_WORTH = 2.0  # by which a further pole lowers the residual where it is taken; noise alone hardly ever does
_RANK = 1e-12  # of the largest singular value
_NEAREST = 1e-6  # least denominator; a pole lies on a line otherwise
_TINY = np.finfo(float).tiny


@dataclass(frozen=True)
class LocalModel:
    """Of the spectrum of one record of acceleration; arrays are (lines,), variances per real and imaginary part.

    Attributes:
        transient: what the end of the record adds to the spectrum.
        noise: variance of the spectrum.
        noise_without: variance of the spectrum less its transient.
        freedom: degrees of freedom of these variances, in pairs of a real and an imaginary part.
    """

    transient: Complex
    noise: Real
    noise_without: Real
    freedom: Real


def local_model(force: Real, acceleration: Real, lines: int, window: Real | None = None) -> LocalModel:
    """The local model of the first `lines` lines of the record of one blow.

    Its error is below the noise where no more than two modes lie within 17 lines, however narrow they are. Variances
    are those that make squared errors over them 1 on the mean.

    Args:
        force: (samples,) with the whole pulse.
        acceleration: (samples,) the same record.
        lines: how many are wanted, from 0 Hz.
        window: (samples,) by which both were multiplied; None for none. It correlates the noise of lines. Where it
            falls to e^-6 variances are 8 % too small, as a pole then fits some of the noise.

    Raises:
        AnalysisError: the record has fewer lines than a window.
    """
    samples = force.size
    if samples < SHORTEST:
        raise AnalysisError(f"a record of {samples} samples is too short for a local model; it takes {SHORTEST}")
    line = np.arange(lines)
    middle = np.clip(line, HALF_WINDOW, samples // 2 - HALF_WINDOW)
    places = 2 * middle[:, None] + np.arange(-2 * HALF_WINDOW, 2 * HALF_WINDOW + 1)  # of lines and half lines
    apart = (places - 2 * line[:, None]) / (2 * HALF_WINDOW)
    forces, heard = (np.fft.rfft(record, 2 * samples)[places] for record in (force, acceleration))
    ends = np.where(places % 2, -1.0, 1.0)
    numerators = np.stack([apart**power * each for each in (forces, ends) for power in range(_DEGREE + 1)], axis=-1)
    own, correlation = np.argmin(np.abs(apart), axis=1), _correlation(samples, window)
    one, two = (_with_variances(_fitted(numerators, apart, heard, poles), heard, own, correlation) for poles in _POLES)
    better = _WORTH * two.noise < one.noise
    return LocalModel(
        **{each.name: np.where(better, getattr(two, each.name), getattr(one, each.name)) for each in fields(LocalModel)}
    )


@dataclass(frozen=True)
class _Fit:
    """A fit and its linear form.

    Attributes:
        transient: (lines,) the constant of its numerator.
        residual: (lines, places).
        columns: (lines, places, parameters) orthonormal; zero beyond the rank.
        to_transient: (lines, parameters) how the transient follows from their coefficients.
    """

    transient: Complex
    residual: Complex
    columns: Complex
    to_transient: Complex


def _fitted(numerators: Complex, apart: Real, heard: Complex, poles: int) -> _Fit:
    """Numerators (lines, places, parameters) over a common denominator that is 1 at the line itself.

    The first step is linear in all parameters and has the noise in its columns (E. C. Levi, IRE Trans. Autom. Control
    4, 1959, 37-43); the second is one of Gauss and Newton from there. Further ones fit noise by a pole on a line.
    """
    size = np.maximum(np.sqrt(np.mean(np.abs(numerators) ** 2, axis=1)), _TINY)
    numerators = numerators / size[:, None, :]
    powers, count, constant = apart[..., None] ** np.arange(1, poles + 1), numerators.shape[-1], _DEGREE + 1

    left, sizes, right = _decomposed(np.concatenate([numerators, -powers * heard[..., None]], axis=-1))
    found = np.einsum("lki,lk->li", right.conj(), _on(left, heard) / sizes)
    denominator = 1 + np.einsum("lpi,li->lp", powers, found[:, count:])
    denominator = np.where(np.abs(denominator) < _NEAREST, _NEAREST, denominator)
    model = np.einsum("lpi,li->lp", numerators, found[:, :count]) / denominator

    columns = np.concatenate([numerators, -powers * model[..., None]], axis=-1) / denominator[..., None]
    left, sizes, right = _decomposed(columns)
    step = _on(left, heard - model)
    to_transient = right[:, :, constant].conj() / sizes / size[:, constant, None]
    return _Fit(
        transient=found[:, constant] / size[:, constant] + np.sum(to_transient * step, axis=1),
        residual=heard - model - np.einsum("lpi,li->lp", left, step),
        columns=left,
        to_transient=to_transient,
    )


def _decomposed(columns: Complex | Real) -> tuple[Complex, Real, Complex]:
    """Singular vectors and values; beyond the rank the former are zero and the latter infinite."""
    left, sizes, right = np.linalg.svd(columns, full_matrices=False)
    kept = sizes > np.maximum(_RANK * sizes[:, :1], _TINY)
    return left * kept[:, None, :], np.where(kept, sizes, np.inf), right


def _on(columns: Complex, values: Complex) -> Complex:
    return np.asarray(np.einsum("lpi,lp->li", columns.conj(), values))


def _with_variances(fit: _Fit, heard: Complex, own: Real, correlation: Complex) -> LocalModel:
    """Variances from the residual, whose mean square is the noise times the trace of (1 - Q Q*) R.

    R is the correlation of the noise over places, Q are the columns. Degrees of freedom are those of a chi-square of
    equal mean and variance (F. E. Satterthwaite, Biometrics Bull. 2, 1946, 110-114). Of the error of a line the part
    that is within the residual moves with the variance, and the rest does not: it alone raises the mean of squared
    errors over variances.
    """
    q, lines = fit.columns, np.arange(heard.shape[0])
    rq = correlation @ q
    within = q.conj().swapaxes(1, 2) @ rq
    trace = np.real(np.trace(correlation) - np.trace(within, axis1=1, axis2=2))
    squared = np.real(
        np.sum(np.abs(correlation) ** 2)
        - 2 * np.sum(np.abs(rq) ** 2, axis=(1, 2))
        + np.sum(within * within.swapaxes(1, 2), axis=(1, 2))
    )
    freedom = trace**2 / squared
    noise = np.sum(np.abs(fit.residual) ** 2, axis=1) / trace / 2
    here = np.zeros(heard.shape, dtype=complex)
    here[lines, own] = 1.0

    def power(coefficients: Complex) -> Real:
        """Of the noise of the line itself less `coefficients` (lines, parameters) of the columns."""
        weights = here - np.einsum("li,lpi->lp", coefficients, q.conj())
        return np.asarray(np.real(np.sum((weights @ correlation) * weights.conj(), axis=1)))

    residual, alone, without = power(q[lines, own]), np.ones(heard.shape[0]), power(fit.to_transient)
    raised, raised_without = (
        total * (1 + np.maximum(1 - residual / total, 0.0) / np.maximum(freedom - 1, 1.0)) for total in (alone, without)
    )
    return LocalModel(fit.transient, noise * raised, noise * raised_without, freedom)


def _correlation(samples: int, window: Real | None) -> Complex:
    """(places, places) correlation of white noise under a window between lines and half lines."""
    power = np.ones(samples) if window is None else window**2
    distance = np.arange(4 * HALF_WINDOW + 1)
    by_distance = np.exp(-1j * np.pi / samples * np.outer(distance, np.arange(samples))) @ power / np.sum(power)
    between = distance[:, None] - distance[None, :]
    return np.asarray(np.where(between >= 0, by_distance[between], by_distance[-between].conj()))
