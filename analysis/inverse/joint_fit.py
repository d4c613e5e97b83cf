"""Result of a maximum likelihood fit: joints, deviations of the bench, weak directions, predictions and checks.

The likelihood takes the errors of lines as independent. A blow that is harder than the others or beside its mark
changes all lines together, and two thousand lines do not average it out. So the share of every blow in the average is
followed through the fit, to first order, and the squares of its effects are added up, as `analysis.modal.modal_scatter`
does for modes (H. White, Econometrica 48, 1980, with the blows for clusters). Ten blows give their scatter to a quarter
only, and some terms depend on the blows of one or two points. So each term has the degrees of freedom of the blows
behind its variance, and Student's interval (R. M. Bell, D. F. McCaffrey, Survey Methodology 28, 2002, with
Satterthwaite's approximation).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from analysis.frequency_response import Complex, FrequencyResponses, Real, blows_behind
from analysis.interval import Estimate, combined_degrees_of_freedom, quantile
from analysis.inverse.frequency_law import FrequencyLaw
from analysis.inverse.frequency_laws import LAW_PARAMETERS, REFERENCE_FREQUENCY, growth, growth_slopes, law_of
from analysis.inverse.joint_estimate import HALF, IdentifiedJoint, joint_from_terms
from analysis.inverse.joint_parameters import real_terms
from analysis.inverse.levenberg_marquardt import Minimum, inverse_of_squares
from analysis.inverse.model_error import Cause, correlation_of_neighbours, missing_causes
from analysis.inverse.observability import term_bound, term_units
from analysis.inverse.response_band import ResponseBand, propagated_band
from analysis.inverse.response_jacobian import deviation_columns, term_columns
from analysis.inverse.response_likelihood import ResponseLikelihood
from analysis.inverse.response_model import ResponseModel, SupportedResponse
from analysis.inverse.tolerances import Deviations, deviation_labels, law_places, places_of_law, places_of_leans
from analysis.inverse.undetermined_terms import Reasons, WeakDirections, common_factor, term_names, weak_directions
from analysis.inverse.validity_checks import (
    ValidityCheck,
    convergence,
    goodness_of_fit,
    independent_residual,
    no_missing_cause,
    passivity,
    positive_stiffness,
    within_tolerances,
)

_UPPER = tuple(np.triu_indices(3))


@dataclass(frozen=True, eq=False)
class PriorEffect:
    """Effect of a prior on the terms of all joints, (12 joints,), in the order of `regression.TERMS`.

    Attributes:
        bias: to first order, for the identified joints. It is zero where the prior alone determines the term.
        share: of the variance that comes from the prior, 0 to 1; the rest comes from noise. 0 where the data determine
            the term, 1 where the prior does.
    """

    bias: Real
    share: Real


def prior_effect(slope: Real, independent_covariance: Real, covariance: Real, weight: Real, off: Real) -> PriorEffect:
    """Bias and share of a Gaussian prior.

    With F the information of the data and R that of the prior, the estimate has the bias -(F + R)^-1 R (theta - theta0)
    and the covariance C F C + C R C with C = (F + R)^-1 (A. E. Hoerl, R. W. Kennard, Technometrics 12, 1970, for R
    equal in all directions). Where errors of lines are correlated, their covariance replaces the middle F.

    Args:
        slope: (terms, parameters) derivative of the terms.
        independent_covariance: (parameters, parameters) C.
        covariance: (parameters, parameters) of the estimate; C itself where the data's errors are those of F.
        weight: (parameters, parameters) R; zero for parameters without this prior.
        off: (parameters,) theta - theta0.
    """
    reach = slope @ independent_covariance
    of_prior = np.einsum("tp,pq,tq->t", reach, weight, reach)
    whole = np.einsum("tp,pq,tq->t", slope, covariance, slope)
    return PriorEffect(-reach @ weight @ off, np.asarray(np.clip(of_prior / whole, 0.0, 1.0)))


def information_from_scatter(
    likelihood: ResponseLikelihood, values: Real, response: SupportedResponse, scatter: Complex
) -> Real:
    """(rows, parameters, parameters) covariance of each row's part of the gradient J^t W r.

    Where lines are independent the parts add up to J^t W J.

    Args:
        likelihood: that was maximised.
        values: (parameters,) where.
        response: the model's there.
        scatter: (rows, blows, lines) how far each blow moves the average of its row, (m/s^2)/N.
    """
    terms, deviations = term_columns(response), deviation_columns(response, likelihood.active)
    weighted = np.concatenate([terms, deviations]) / likelihood.deviation**2
    moved = np.einsum("crl,rbl->rcb", weighted.conj(), scatter, optimize=True)
    gradients = np.real(likelihood.chain(values).conj().T @ moved)
    return np.asarray(gradients @ gradients.transpose(0, 2, 1))


def degrees_of_freedom(slope: Real, of_rows: Real, covariance: Real, scatter: Complex) -> Real:
    """(terms,) behind the variance of each term.

    Args:
        slope: (terms, parameters) derivative of the terms.
        of_rows: (rows, parameters, parameters) what the blows of each row add to the covariance of the parameters.
        covariance: (parameters, parameters) all of it; what is not from blows is known beforehand.
        scatter: (rows, blows, lines); blows that a row lacks are zero.
    """
    parts = np.einsum("tp,rpq,tq->tr", slope, of_rows, slope)
    beforehand = np.einsum("tp,pq,tq->t", slope, covariance, slope) - np.sum(parts, axis=1)
    known = [*(blows_behind(scatter) - 1).tolist(), np.inf]
    return np.array(
        [combined_degrees_of_freedom([*rows, rest], known) for rows, rest in zip(parts, beforehand, strict=True)]
    )


@dataclass(frozen=True, eq=False)
class LikelihoodEstimate(IdentifiedJoint):
    """A joint as identified from accelerances; `covariance` includes noise, tolerances and misfit.

    Attributes:
        degrees_of_freedom: (12,) behind the variance of each term, as in `covariance`; infinite where no single blows
            were known.
        checks: of stiffness and passivity, also at the ends of the band where the joint follows frequency. The
            parameters cannot break symmetry.
    """

    degrees_of_freedom: Real
    checks: tuple[ValidityCheck, ...]


@dataclass(frozen=True, eq=False)
class JointFit:
    """Result of a fit to accelerances.

    Attributes:
        joints: by name.
        labels: (parameters,) of the joints, then of the bench's deviations.
        values: (parameters,) most likely.
        covariance: (parameters, parameters) with noise multiplied by `noise_scale`, with the correlation of lines where
            single blows are known, and with the causes that the model seems to lack.
        noise_covariance: the same without these causes.
        independent_covariance: (parameters, parameters) the covariance if all lines were independent: inverse of
            the curvature of chi-square.
        degrees_of_freedom: (parameters,) behind the variance of each; infinite where no single blows were known.
        deviations: of the bench, as estimated.
        chi_square_per_row: (rows,) per datum; 1 is noise alone.
        noise_scale: factor on the noise's variance: chi-square per degree of freedom where above one, so that a model
            which does not quite fit gets wider intervals.
        weak_directions: combinations of terms that the data hardly determine, the weakest first.
        checks: fit and convergence; the joints have their own.
        causes: that the model may lack, the strongest first.
        likelihood: that was maximised.
    """

    joints: dict[str, LikelihoodEstimate]
    labels: tuple[str, ...]
    values: Real
    covariance: Real
    noise_covariance: Real
    independent_covariance: Real
    degrees_of_freedom: Real
    deviations: Deviations
    chi_square_per_row: Real
    noise_scale: float
    weak_directions: WeakDirections
    checks: tuple[ValidityCheck, ...]
    causes: tuple[Cause, ...]
    likelihood: ResponseLikelihood

    @property
    def all_checks(self) -> tuple[ValidityCheck, ...]:
        """The checks of the fit, then those of each joint."""
        return (*self.checks, *(check for joint in self.joints.values() for check in joint.checks))

    @property
    def passed(self) -> bool:
        """Whether all checks passed."""
        return all(check.passed for check in self.all_checks)

    @cached_property
    def terms_covariance(self) -> Real:
        """(12 joints, 12 joints) of the terms of all joints, with their correlations."""
        slope = _terms_slope(self.likelihood, self.values)
        return np.asarray(slope @ self.covariance @ slope.T)

    @cached_property
    def prior_effect(self) -> PriorEffect:
        """Effect of the prior on the joints, without that of the tolerances of the bench."""
        count = len(self.likelihood.parameters.labels)
        mean, whole = self.likelihood.prior
        weight = np.zeros_like(whole)
        weight[:count, :count] = whole[:count, :count]
        slope = _terms_slope(self.likelihood, self.values)
        return prior_effect(slope, self.independent_covariance, self.covariance, weight, self.values - mean)

    @property
    def law(self) -> FrequencyLaw:
        """The law of frequency that the joints follow, each with parameters of its own."""
        count = len(self.joints)
        return law_of(self.likelihood.active[law_places(count)][::count].tolist())

    @property
    def law_parameters(self) -> dict[str, dict[str, Estimate]]:
        """By joint, the free parameters of its law by their `LAW_PARAMETERS`; empty where joints are constant."""
        places = {each: places_of_law(each, len(self.joints)) for each in LAW_PARAMETERS}
        found = {
            name: self._estimates({each: of_joints[joint] for each, of_joints in places.items()})
            for joint, name in enumerate(self.joints)
        }
        return {name: own for name, own in found.items() if own}

    def joints_at(self, frequency: float) -> dict[str, LikelihoodEstimate]:
        """The joints as they are at `frequency`, Hz, with the uncertainty of their law; as at 100 Hz if constant.

        The uncertainty allows for laws that the model seems to lack.
        Degrees of freedom are those at 100 Hz, and so is what the data leave undetermined.
        """
        likelihood, names = self.likelihood, tuple(self.joints)
        logarithm = np.log([frequency / REFERENCE_FREQUENCY]).astype(complex)
        laws, places = self.deviations.joint_laws, law_places(len(names))
        factor = np.repeat(growth(laws, logarithm)[:, 0], HALF)
        upper = factor * likelihood.upper(self.values)
        slope = factor[:, None] * likelihood.chain(self.values)[: factor.size]
        by_law = np.zeros((factor.size, len(likelihood.tolerance)), dtype=complex)
        for place, turn in enumerate(growth_slopes(laws, logarithm).reshape(-1).tolist()):
            own = slice(HALF * (place % len(names)), HALF * (place % len(names) + 1))
            by_law[own, places.start + place] = turn * upper[own]
        slope[:, len(likelihood.parameters.labels) :] += by_law[:, likelihood.active]
        real = real_terms(slope)
        moved = np.array([real @ cause.reach + real_terms(cause.growth(upper, logarithm)) for cause in self.causes])
        covariance = real @ self.noise_covariance @ real.T + moved.T @ moved
        return _joints(
            likelihood.model,
            names,
            real_terms(upper).reshape(len(names), -1),
            covariance,
            np.concatenate([joint.degrees_of_freedom for joint in self.joints.values()]),
            np.array([np.tile(joint.why_not[_UPPER], 2) for joint in self.joints.values()]),
        )

    @property
    def leans(self) -> dict[str, Estimate]:
        """Mean lean of the blows by point, rad: towards x for blows across the beam, towards y for blows along it.

        Empty where blows are straight.
        """
        points = self.likelihood.model.inputs
        return self._estimates(dict(zip(map(str, points), places_of_leans(len(self.joints), len(points)), strict=True)))

    def _estimates(self, places: Mapping[str, int]) -> dict[str, Estimate]:
        """Estimates of deviations by name, from their places in `Deviations`, but for those that are no parameters."""
        error, numbers = np.sqrt(np.diag(self.covariance)), self.likelihood.numbers
        found = {name: numbers[place] for name, place in places.items() if place in numbers}
        return {
            name: Estimate(float(self.values[at]), float(error[at]), float(self.degrees_of_freedom[at]))
            for name, at in found.items()
        }

    def sum_of(self, p: int, q: int) -> tuple[complex, Real, float]:
        """Sum over all joints of k + i h at row `p`, column `q`, the (2, 2) covariance of its parts, and the degrees of
        freedom behind that: the fewest of all terms of the sum."""
        place = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].index((min(p, q), max(p, q)))
        total = sum(complex(joint.joint.dynamic_stiffness[p, q]) for joint in self.joints.values())
        parts = np.zeros((2, len(self.terms_covariance)))
        for half in range(2):
            parts[half, np.arange(len(self.joints)) * 2 * HALF + half * HALF + place] = 1
        freedom = [joint.degrees_of_freedom[[place, HALF + place]] for joint in self.joints.values()]
        return total, parts @ self.terms_covariance @ parts.T, float(np.min(freedom))

    @cached_property
    def predicted(self) -> ResponseBand:
        """Accelerances at the fitted lines, with blows at their estimated places."""
        likelihood = self.likelihood
        response = likelihood.response(self.values)
        columns = np.concatenate([term_columns(response), deviation_columns(response, likelihood.active)])
        chain = likelihood.chain(self.values)
        model = likelihood.model
        responses = FrequencyResponses(
            model.frequency, response.accelerance, model.response, model.inputs, decay=model.decay
        )
        return propagated_band(responses, np.tensordot(chain.T, columns, axes=1), self.covariance)


def describe_fit(
    likelihood: ResponseLikelihood, found: Minimum, noise: Real, scatter: Complex | None = None
) -> JointFit:
    """The result at a minimum.

    Args:
        likelihood: that was maximised.
        found: where.
        noise: (rows, lines) standard deviation of the accelerances by what is known without this fit, for its checks.
        scatter: (rows, blows, lines) how far each blow moves the average of its row; None where blows are not known.
    """
    model, names = likelihood.model, likelihood.parameters.names
    response = likelihood.response(found.values)
    square = np.abs((likelihood.measured - response.accelerance) / likelihood.deviation) ** 2 / 2
    left = 1 - len(found.values) / (2 * square.size)
    scale = max(1.0, float(np.mean(square)) / left)

    _, weight = likelihood.prior
    of_data, of_prior = likelihood.square_roots(found.values, response)
    independent_covariance = covariance = inverse_of_squares(np.concatenate([of_data / np.sqrt(scale), of_prior]))
    slope = _terms_slope(likelihood, found.values)
    freedom, of_parameters = np.full(len(slope), np.inf), np.full(len(found.values), np.inf)
    if scatter is not None:
        of_blows = information_from_scatter(likelihood, found.values, response, scatter) / scale
        covariance = independent_covariance @ (np.sum(of_blows, axis=0) + weight) @ independent_covariance
        of_rows = independent_covariance @ of_blows @ independent_covariance
        freedom = degrees_of_freedom(slope, of_rows, covariance, scatter)
        of_parameters = degrees_of_freedom(np.eye(len(found.values)), of_rows, covariance, scatter)
    terms = real_terms(likelihood.upper(found.values)).reshape(len(names), 2 * HALF)
    information = likelihood.information(response).scaled(1 / scale)
    unit = term_units(model.free_beam, len(names))
    bound = term_bound(information, likelihood.active_tolerance, unit)
    why_not = bound.undetermined(terms.ravel(), term_names(names)).reshape(terms.shape)

    causes = missing_causes(likelihood, found.values, response, noise, scatter)
    without = _joints(model, names, terms, slope @ covariance @ slope.T, freedom, why_not)
    shown = np.concatenate([np.tile(joint.observable[_UPPER], 2) for joint in without.values()])
    relative = slope[shown] / np.sqrt(np.sum((slope[shown] @ covariance) * slope[shown], axis=1))[:, None]
    of_noise = covariance
    covariance = covariance + sum(np.outer(cause.reach, cause.reach) for cause in causes)
    joints = _joints(model, names, terms, slope @ covariance @ slope.T, freedom, why_not)

    labels = np.array(deviation_labels(model.response, model.inputs, names))[likelihood.active]
    weak = weak_directions(bound.as_drawn, names, model.free_beam.beam.stiffness_unit, terms.ravel())
    ending = convergence(found.converged, found.expected)
    common_scale = common_factor(likelihood.tolerance[:3, :3], bound.as_drawn, terms.ravel())
    fit = JointFit(
        joints=joints,
        labels=(*likelihood.parameters.labels, *labels.tolist()),
        values=found.values,
        covariance=covariance,
        noise_covariance=of_noise,
        independent_covariance=independent_covariance,
        degrees_of_freedom=of_parameters,
        deviations=likelihood.deviations(found.values),
        chi_square_per_row=np.mean(square, axis=1),
        noise_scale=scale,
        weak_directions=weak if common_scale is None else (*weak, common_scale),
        checks=(
            *_checks_of_model(likelihood, found, response, noise, scatter),
            no_missing_cause(causes, relative),
            ending,
        ),
        causes=causes,
        likelihood=likelihood,
    )
    return fit if fit.law is FrequencyLaw.CONSTANT else _checked_at_ends(fit)


def _checked_at_ends(fit: JointFit) -> JointFit:
    """The fit with each joint checked at the lowest and the highest line, too.

    A law of frequency has a loss of its own. What is passive at 100 Hz may draw energy where that loss is less.
    """
    lines = fit.likelihood.model.frequency
    every = [(fit.joints, "")]
    every += [(fit.joints_at(float(lines[end])), f" at {lines[end]:.4g} Hz") for end in (0, -1)]
    joints = {
        name: replace(
            joint,
            checks=tuple(replace(each, name=each.name + at) for joints, at in every for each in joints[name].checks),
        )
        for name, joint in fit.joints.items()
    }
    return replace(fit, joints=joints)


def _joints(
    model: ResponseModel, names: Sequence[str], terms: Real, covariance: Real, freedom: Real, why_not: Reasons
) -> dict[str, LikelihoodEstimate]:
    """The joints of `terms` (joints, 12) with `covariance` (12 joints, 12 joints)."""
    found = {}
    for joint, name in enumerate(names):
        at = slice(2 * HALF * joint, 2 * HALF * (joint + 1))
        own = covariance[at, at]
        common = joint_from_terms(
            name, model.joint_nodes[joint], terms[joint], own, [(own, quantile(freedom[at]))], why_not[joint]
        )
        checks = (
            positive_stiffness(common, float(np.min(freedom[at][:HALF]))),
            passivity(common, float(np.min(freedom[at][HALF:]))),
        )
        found[name] = LikelihoodEstimate(**vars(common), degrees_of_freedom=freedom[at], checks=checks)
    return found


def _checks_of_model(
    likelihood: ResponseLikelihood, found: Minimum, response: SupportedResponse, noise: Real, scatter: Complex | None
) -> tuple[ValidityCheck, ...]:
    """Whether noise alone is left, and the bench is within its tolerances."""
    model = likelihood.model
    left = likelihood.measured - response.accelerance
    square = np.abs(left / noise) ** 2 / 2
    of_blows = None if scatter is None else scatter / likelihood.deviation[:, None]
    per_line = model.decay * (model.frequency.size - 1) / float(np.ptp(model.frequency))
    labels = np.array(deviation_labels(model.response, model.inputs, likelihood.parameters.names))[likelihood.active]
    return (
        goodness_of_fit(np.mean(square, axis=0), np.mean(square, axis=1), model.frequency, model.inputs),
        independent_residual(correlation_of_neighbours(left / likelihood.deviation, of_blows, per_line)),
        within_tolerances(
            labels.tolist(),
            found.values[len(likelihood.parameters.labels) :],
            np.sqrt(np.diag(likelihood.active_tolerance)),
        ),
    )


def _terms_slope(likelihood: ResponseLikelihood, values: Real) -> Real:
    """(12 joints, parameters) derivative of the terms of all joints in the parameters."""
    return real_terms(likelihood.chain(values)[: HALF * len(likelihood.parameters.names)])
