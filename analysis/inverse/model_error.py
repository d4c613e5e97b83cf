"""Evidence against a model in the residual of its fit: correlated neighbours, and causes that the model lacks.

Chi-square alone is blunt: it averages over thousands of lines. Noise is independent from line to line, and the error of
a model is not. A score test asks of each cause, such as a mass at a joint, how far one more parameter would lower
chi-square (C. R. Rao, Proc. Camb. Phil. Soc. 44, 1948), with the scatter of single blows for the variance where it is
known.

Nobody states how large a cause may be, so the data do: each is Gaussian about zero with the variance that makes the
scores most likely, zero for most (M. E. Tipping, J. Machine Learning Research 1, 2001). The fit leaves causes out, and
so they add to the covariance of its errors. A statement of the bench that is further off than its tolerance is a cause
as well: its prior is shifted.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import expit, logit

from analysis.frequency_response import Complex, Real
from analysis.inverse.regression import UPPER
from analysis.inverse.response_jacobian import deviation_columns, term_columns
from analysis.inverse.response_likelihood import ResponseLikelihood
from analysis.inverse.response_model import SupportedResponse
from analysis.inverse.tolerances import COMMON, deviation_labels, law_places

LAGS = (3, 4, 5, 6)
"""Distances of the lines that are compared. A Hann window makes the noise of lines one and two apart alike, and no
record says whether there was one; the error of a model reaches over the width of a resonance."""
HALF = len(UPPER)
TRANSLATIONS = (UPPER.index((0, 0)), UPPER.index((1, 1)))
IN_PLANE = tuple(UPPER.index(each) for each in ((0, 0), (0, 1), (1, 1)))
"""Terms of which each may follow a power of its own, as where rubber in shear and in compression follow two laws."""
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
        size: the standard deviation about zero, in `unit`, of which the scores of all causes speak; often zero.
        slope: (parameters,) how far one unit of it moves the fitted parameters.
        grows: places, among the upper terms of all joints, of those that it makes follow a power of frequency.
    """

    name: str
    value: float
    unit: str
    gain: float
    size: float
    slope: Real
    grows: tuple[int, ...]

    @property
    def is_law_of_joint(self) -> bool:
        """Whether all terms of a joint follow the same power of frequency."""
        return len(self.grows) == HALF

    @property
    def reach(self) -> Real:
        """(parameters,) how far it moves the fitted parameters, one standard deviation."""
        return self.size * self.slope

    def growth(self, upper: Complex, logarithm: Complex) -> Complex:
        """(6 joints,) how far it moves the upper terms (6 joints,) by their growth, one standard deviation.

        `logarithm` is that of the frequency over the one at which the terms are stated.
        """
        found, grows = np.zeros_like(upper), list(self.grows)
        found[grows] = self.size * upper[grows] * logarithm
        return found


class _Column(NamedTuple):
    """Derivative of the accelerances (rows, lines) in a cause, with the cause's `name`, `unit` and `grows`."""

    name: str
    unit: str
    column: Complex
    grows: tuple[int, ...] = ()


def correlation_of_neighbours(residual: Complex, scatter: Complex | None, decay_per_line: float) -> float:
    """How many standard deviations the correlation of lines a few apart is above that of noise.

    Args:
        residual: (rows, lines) over the standard deviation of the noise.
        scatter: (rows, blows, lines) the part of each blow in that noise, in the same unit; None where not known.
        decay_per_line: decay of an exponential window in 1/s, divided by the distance of two lines in Hz; noise under
            it is alike over neighbouring lines.
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
    """The effect of each cause that the model lacks, the strongest first.

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

    every = _columns(likelihood, values, response, terms)
    of_causes: Complex = np.array([each.column * weight for each in every], dtype=complex)
    stated = _stated(likelihood)
    whole = np.pad(_stacked(of_causes), ((0, known.size), (0, len(stated))))
    for at, (parameter, tolerance) in enumerate(stated.values(), len(every)):
        whole[left.size - known.size :, at] = -root[:, parameter] * tolerance
    shared = basis.T @ whole
    own = whole - basis @ shared
    separate = np.sum(own**2, axis=0) > SEPARABLE * np.sum(whole**2, axis=0)
    if not np.any(separate):
        return ()
    own, shared = own[:, separate], shared[:, separate]
    of_data, of_prior = np.split(own, [left.size - known.size])
    variance = _variance(of_data, noise * weight, None if scatter is None else scatter * weight[:, None])
    variance += _products(of_prior)
    score, information = own.T @ left, _products(own)
    sizes = likely_sizes(score, information, variance)
    moves = -np.linalg.lstsq(triangle, shared, rcond=None)[0] / size[:, None]
    labels = [(each.name, each.unit, each.grows) for each in every] + [(name, "tolerances", ()) for name in stated]
    labels = [label for label, separable in zip(labels, separate, strict=True) if separable]
    found = [
        Cause(
            name,
            float(score[at] / information[at, at]),
            unit,
            float(score[at] ** 2 / variance[at, at]),
            float(sizes[at]),
            moves[:, at],
            grows,
        )
        for at, (name, unit, grows) in enumerate(labels)
    ]
    return tuple(sorted(found, key=lambda cause: -cause.gain))


def likely_sizes(score: Real, information: Real, variance: Real) -> Real:
    """(causes,) most likely standard deviation of each cause about zero, given the scores.

    The cause with the strongest evidence gets the variance that makes the scores most likely, then the strongest of the
    others, and so on (M. E. Tipping, A. C. Faul, Proc. 9th Workshop on Artificial Intelligence and Statistics, 2003).
    Of causes that look alike, only one gets a variance. Each variance is multiplied by the probability that the cause
    exists: before the data, it is even odds that any cause is missing, and all causes are equally probable.

    Args:
        score: (causes,) information times causes plus noise.
        information: (causes, causes).
        variance: (causes, causes) of the noise of the scores.
    """
    unit = 1 / np.sqrt(np.diag(variance))
    weight = np.linalg.pinv(variance * np.outer(unit, unit), hermitian=True)
    gain = information * unit[:, None]
    precision, pull = gain.T @ weight @ gain, gain.T @ weight @ (score * unit)
    square, probability = np.zeros((2, score.size))
    while np.any(square == 0):
        by = np.flatnonzero(square)
        through = precision[:, by] @ np.linalg.inv(np.diag(1 / square[by]) + precision[np.ix_(by, by)])
        left, seen = pull - through @ pull[by], np.diag(precision) - np.sum(through * precision[:, by], axis=1)
        times = np.where(square == 0, left**2 / seen, 0.0)
        at = int(np.argmax(times))
        if times[at] <= 1:
            break
        square[at] = (times[at] - 1) / seen[at]
        probability[at] = expit((times[at] - 1 - np.log(times[at])) / 2 + logit(0.5 / score.size))
    return np.asarray(np.sqrt(square * probability))


def _variance(own: Real, noise: Real, scatter: Complex | None) -> Real:
    """(causes, causes) of what noise adds to their scores: that of lines, or of blows where that is more.

    Args:
        own: (data, causes) what is their own.
        noise: (rows, lines) standard deviation of the data.
        scatter: (rows, blows, lines) of the data; None where not known.
    """
    of_lines = _products(own * np.tile(noise.ravel(), 2)[:, None])
    if scatter is None:
        return of_lines
    real, imaginary = own.reshape(2, *noise.shape, -1)
    moved = np.einsum("rlc,rbl->rbc", real, scatter.real) + np.einsum("rlc,rbl->rbc", imaginary, scatter.imag)
    of_blows = _products(moved.reshape(-1, moved.shape[-1]))
    return np.asarray(of_blows + np.diag(np.maximum(np.diag(of_lines - of_blows), 0.0)))


def _products(columns: Real) -> Real:
    """(columns, columns) of each with each."""
    return np.asarray(columns.T @ columns)


def _stacked(fields: Complex) -> Real:
    """(2 rows lines, ...) real parts, then imaginary parts, of (..., rows, lines)."""
    flat = fields.reshape(*fields.shape[:-2], -1)
    return np.ascontiguousarray(np.concatenate([flat.real, flat.imag], axis=-1).T)


def _columns(
    likelihood: ResponseLikelihood, values: Real, response: SupportedResponse, terms: Complex
) -> Sequence[_Column]:
    model, names = likelihood.model, likelihood.parameters.names
    square = model.poles**2
    found = []
    for joint, name in enumerate(names):
        at = slice(HALF * joint, HALF * (joint + 1))
        moving = sum(terms[at][place] for place in TRANSLATIONS) / response.condensed.growth[3 * joint]
        found.append(_Column(f"mass at joint {name}", "kg", np.asarray(square * moving)))
        found.append(_Column(f"compliance under joint {name}", "m/N", _in_series(response, joint)))
    found += [*_powers_of_joints(likelihood, response), *_powers_of_terms(likelihood, values, response, terms)]
    held = _held_at_sensor(response)
    found.append(_Column(f"mass of the accelerometer at {model.response}", "kg", square * held))
    found.append(_Column(f"damping of the cable at {model.response}", "N s/m", model.poles * held))
    # of a sensor below its resonance; a law of the joints would take it up
    rising = np.asarray((model.frequency / 1e3) ** 2 * response.accelerance)
    found.append(_Column("sensitivity that rises with frequency", "1/kHz^2", rising))
    found.append(_Column("delay of a channel", "s", np.asarray(-model.poles * response.accelerance)))
    return found


def _powers_of_joints(likelihood: ResponseLikelihood, response: SupportedResponse) -> Iterator[_Column]:
    """All terms of a joint alike, where the fit has no such parameter."""
    names = likelihood.parameters.names
    first = law_places(len(names)).start
    lacks = np.zeros(len(likelihood.tolerance), dtype=bool)
    lacks[first : first + len(names)] = True
    lacks &= ~likelihood.active
    missing = np.flatnonzero(lacks) - first
    for joint, column in zip(missing.tolist(), deviation_columns(response, lacks), strict=True):
        grows = tuple(range(HALF * joint, HALF * (joint + 1)))
        yield _Column(f"power of frequency of joint {names[joint]}", "1", column, grows)


def _powers_of_terms(
    likelihood: ResponseLikelihood, values: Real, response: SupportedResponse, terms: Complex
) -> Iterator[_Column]:
    """Each term by itself, also where the joint follows a law."""
    stiffness = likelihood.upper(values)
    for joint, name in enumerate(likelihood.parameters.names):
        for place in IN_PLANE:
            (p, q), at = UPPER[place], HALF * joint + place
            column = terms[at] * stiffness[at] * response.condensed.log_frequency
            yield _Column(f"power of frequency of k{p + 1}{q + 1} of joint {name}", "1", column, (at,))


def _stated(likelihood: ResponseLikelihood) -> dict[str, tuple[int, float]]:
    """Number and tolerance of each parameter of the bench as a whole, by what may be wrong with it."""
    model = likelihood.model
    labels = deviation_labels(model.response, model.inputs, likelihood.parameters.names)
    return {
        f"wrong statement of the {labels[at]}": (number, float(np.sqrt(likelihood.tolerance[at, at])))
        for at, number in likelihood.numbers.items()
        if at < len(COMMON)
    }


def _in_series(response: SupportedResponse, joint: int) -> Complex:
    """(rows, lines) derivative in the compliance of an elastic base, the same along and across the beam."""
    force = response.force[3 * joint : 3 * joint + 2]
    factor = response.condensed.model.poles**2 * (1 + response.condensed.deviations.gain)
    return np.asarray(factor * np.einsum("jl,jsl->sl", force[:, 0], force[:, 1:]))


def _held_at_sensor(response: SupportedResponse) -> Complex:
    """(rows, lines) derivative in the dynamic stiffness of what holds the accelerometer in its direction."""
    beam = response.condensed
    under = beam.direct[0] - np.einsum("jl,jl->l", np.moveaxis(beam.ends[:, :, 0], 0, -1), response.force[:, 0])
    return np.asarray(-under * response.accelerance)
