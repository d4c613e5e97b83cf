"""What the residual of a fit says against its model: correlated neighbours, and causes that the model lacks.

Chi-square alone is blunt: it averages over thousands of lines. Noise is independent from line to line, and the error of
a model is not. A score test asks of each cause, such as a mass at a joint, how far one more parameter would lower
chi-square (C. R. Rao, Proc. Camb. Phil. Soc. 44, 1948), with the scatter of single blows for the variance where it is
known.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.inverse.regression import UPPER
from analysis.inverse.response_jacobian import deviation_columns, term_columns
from analysis.inverse.response_likelihood import ResponseLikelihood
from analysis.inverse.response_model import SupportedResponse
from analysis.inverse.tolerances import COMMON

LAGS = (3, 4, 5, 6)
"""Distances of the lines that are compared. A Hann window makes the noise of lines one and two apart alike, and no
record says whether there was one; the error of a model reaches over the width of a resonance."""
TRANSLATIONS = (UPPER.index((0, 0)), UPPER.index((1, 1)))
SEPARABLE = 1e-8
"""Share of a cause's effect that the fitted parameters must leave, so that rounding is not taken for a cause."""


@dataclass(frozen=True, eq=False)
class Cause:
    """One parameter that the model lacks.

    Attributes:
        name: such as ``mass at joint II``.
        value: that it would have, to first order, in `unit`.
        unit: of the value.
        gain: by how much it would lower chi-square; 1 on average where the model is right.
        moves: (parameters,) how far it would move the fitted parameters.
    """

    name: str
    value: float
    unit: str
    gain: float
    moves: Real


def correlation_of_neighbours(residual: Complex, scatter: Complex | None, decay_per_line: float) -> float:
    """How many standard deviations the correlation of lines a few apart is above that of noise.

    Args:
        residual: (rows, lines) over the standard deviation of the noise.
        scatter: (rows, blows, lines) the part of each blow in that noise, in the same unit; None where not known.
        decay_per_line: decay of an exponential window over the distance of two lines in Hz; noise under it is alike
            over neighbouring lines.
    """
    found = sum(_product(residual, residual, lag) for lag in LAGS)
    size = float(np.sum(np.abs(residual) ** 2))
    if scatter is None:
        alike = [1 / (1 + 1j * np.pi * lag / decay_per_line) if decay_per_line else 0j for lag in range(1, 60)]
        known = float(size * np.sum([alike[lag - 1].real for lag in LAGS]))
        wider = 1 + 4 * float(np.sum(np.abs(alike) ** 2))
        return float((found - known) / (size * np.sqrt(wider * len(LAGS) / (2 * residual.size))))
    known, variance = 0.0, 0.0
    for row in scatter:
        struck = row[np.any(row != 0, axis=1)]
        products = np.array([[sum(_product(a, b, lag) for lag in LAGS) for b in struck] for a in struck])
        own, mixed = np.diag(products), (products + products.T) / 2
        known += float(np.sum(own))
        between = 2 * (np.sum(mixed**2) - np.sum(own**2))
        variance += float(between + own.size * np.var(own, ddof=1))
    return float((found - known) / np.sqrt(variance))


def _product(first: Complex, second: Complex, lag: int) -> float:
    return float(np.real(np.vdot(first[..., :-lag], second[..., lag:])))


def missing_causes(
    likelihood: ResponseLikelihood, values: Real, response: SupportedResponse, noise: Real, scatter: Complex | None
) -> tuple[Cause, ...]:
    """What each cause would do that the model lacks, the strongest first.

    Args:
        likelihood: that was maximised.
        values: (parameters,) where.
        response: the model's there.
        noise: (rows, lines) standard deviation of the accelerances by what is known without the fit.
        scatter: (rows, blows, lines) how far each blow moves the average of its row; None where not known.
    """
    terms = term_columns(response)
    weight = 1 / likelihood.deviation
    fitted = np.concatenate([terms, deviation_columns(response, likelihood.active)])
    slopes = np.tensordot(likelihood.chain(values).T, fitted * weight, axes=1)
    mean, prior = likelihood.prior
    known = np.flatnonzero(np.diag(prior) > 0)
    root = np.zeros((known.size, values.size))
    root[:, known] = np.linalg.cholesky(prior[np.ix_(known, known)]).T
    columns = np.concatenate([_stacked(slopes), root])
    size = np.linalg.norm(columns, axis=0)
    basis, triangle = np.linalg.qr(columns / size)
    left = np.concatenate([_stacked((likelihood.measured - response.accelerance) * weight), root @ (mean - values)])
    spread = np.concatenate([np.tile((noise * weight).ravel(), 2), np.ones(known.size)])
    found = []
    for name, unit, column in _columns(likelihood, response, terms):
        whole = np.concatenate([_stacked(column * weight), np.zeros(known.size)])
        shared = basis.T @ whole
        own = whole - basis @ shared
        information = float(own @ own)
        if information <= SEPARABLE * float(whole @ whole):
            continue
        variance = float(np.sum((own * spread) ** 2))
        if scatter is not None:
            shares = own[: 2 * column.size].reshape(2, *column.shape) * weight
            moved = np.einsum("rl,rbl->rb", shares[0], scatter.real) + np.einsum("rl,rbl->rb", shares[1], scatter.imag)
            variance = max(variance, float(np.sum(moved**2)))
        score = float(own @ left)
        value = score / information
        moves = -value * np.linalg.lstsq(triangle, shared, rcond=None)[0] / size
        found.append(Cause(name, value, unit, score**2 / variance, moves))
    return tuple(sorted(found, key=lambda cause: -cause.gain))


def _stacked(fields: Complex) -> Real:
    """(2 rows lines, ...) real parts, then imaginary parts, of (..., rows, lines)."""
    flat = fields.reshape(*fields.shape[:-2], -1)
    return np.ascontiguousarray(np.concatenate([flat.real, flat.imag], axis=-1).T)


def _columns(
    likelihood: ResponseLikelihood, response: SupportedResponse, terms: Complex
) -> Sequence[tuple[str, str, Complex]]:
    """Name, unit, and derivative of the accelerances (rows, lines) of each cause."""
    model, names = likelihood.model, likelihood.parameters.names
    square = model.poles**2
    found = []
    for joint, name in enumerate(names):
        at = slice(len(UPPER) * joint, len(UPPER) * (joint + 1))
        moving = sum(terms[at][place] for place in TRANSLATIONS) / response.condensed.growth[3 * joint]
        found.append((f"mass at joint {name}", "kg", np.asarray(square * moving)))
        found.append((f"compliance under joint {name}", "m/N", _in_series(response, joint)))
    first = len(COMMON) + len(names)
    exponents = np.zeros(len(likelihood.tolerance), dtype=bool)
    exponents[first : first + len(names)] = True
    exponents &= ~likelihood.active
    missing = [name for name, lacks in zip(names, exponents[first : first + len(names)], strict=True) if lacks]
    for name, column in zip(missing, deviation_columns(response, exponents), strict=True):
        found.append((f"power of frequency of joint {name}", "1", column))
    found.append((f"mass of the accelerometer at {model.response}", "kg", _mass_at_sensor(response)))
    return found


def _in_series(response: SupportedResponse, joint: int) -> Complex:
    """(rows, lines) derivative in the compliance of an elastic base, the same along and across the beam."""
    force = response.force[3 * joint : 3 * joint + 2]
    factor = response.condensed.model.poles**2 * (1 + response.condensed.deviations.gain)
    return np.asarray(factor * np.einsum("jl,jsl->sl", force[:, 0], force[:, 1:]))


def _mass_at_sensor(response: SupportedResponse) -> Complex:
    """(rows, lines) derivative in a point mass that moves with the accelerometer in its direction."""
    beam = response.condensed
    under = beam.direct[0] - np.einsum("jl,jl->l", np.moveaxis(beam.ends[:, :, 0], 0, -1), response.force[:, 0])
    return np.asarray(-(beam.model.poles**2) * under * response.accelerance)
