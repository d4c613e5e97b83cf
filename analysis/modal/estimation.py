"""Modes from accelerances, with no pole clicked and no order set by hand.

1. Poles of all orders up to 60 by least squares (`lscf`); columns of the stabilisation chart that reach its
   top are candidates (`stabilisation`).
2. All candidates, their modal constants and the residual terms are refined together by maximum likelihood
   (`modal_refinement`).
3. A candidate stays if the chi-square that it explains pays for its parameters, by Schwarz's criterion: each
   parameter costs the logarithm of the number of data. The number of residual terms is chosen by the same rule.
4. Where noise of known variance cannot explain what is left around some frequency, a pole is tried there and kept by
   the same rule. This separates near-repeated modes that noise has merged in the chart. Where the noise is not stated,
   it is estimated together with the modes, and poles are added where the likelihood of both pays (`unstated_noise`).
5. A pole whose loss factor is at the bound within its uncertainty is background and no mode. Where the noise is not
   stated, neither is one whose loss factor may be zero, and which does not pay beside what the fit leaves there.

Covariances are what the scatter of single blows leads to, where that is known, and else that of noise independent from
line to line. They are multiplied by chi-square per degree of freedom where that exceeds one, so a model that does not
quite fit gets wider intervals. Where the noise is not stated, deviations may hang together from line to line, as
leakage does, so a standard deviation is at least what the disagreement of the rows says. Where single blows tell it,
intervals are Student's, with the degrees of freedom of those that a mode hangs on.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from analysis.errors import AnalysisError, NoModeError
from analysis.frequency_response import FrequencyResponses, Real
from analysis.interval import Z95
from analysis.modal.lscf import OrderPoles, lscf_poles
from analysis.modal.modal_model import DampingKind
from analysis.modal.modal_refinement import ModalData, ModalFit
from analysis.modal.modal_scatter import modal_scatter
from analysis.modal.mode_selection import (
    chi_square_per_line,
    evidence,
    extended,
    noise_scale,
    resolved,
    without_idle_modes,
)
from analysis.modal.response_variance import standard_deviation
from analysis.modal.stabilisation import Stabilisation, read_chart
from analysis.modal.unstated_noise import residual_correlation, with_unstated_noise
from analysis.modes import Modes, frequency_and_loss_factor_slope

_FIRST_TERMS = 4
_MOST_MISSED = 4


@dataclass(frozen=True)
class ModalEstimate:
    """Modes and how they were found.

    Attributes:
        modes: poles and shapes with covariances; shape component j of mode r is the modal constant A_rj in 1/kg, the
            product of the mass-normalised shape at the accelerometer and at the blow.
        fitted: the model's accelerances at the lines that were fitted.
        evidence: (modes,) chi-square that the mode explains over what its parameters cost; those kept exceed 1.
        chi_square_per_line: (lines,) mean over rows of squared deviations over their variance; 1 is noise alone.
        degrees_of_freedom: (2 modes,) behind the variances of [f_1, eta_1, f_2, ...]; infinite without single blows.
        noise_scale: what the covariances were multiplied by; 1 where the stated noise explains the deviations.
        explained: part of the measured energy, the sum of |H|^2 over rows and lines, that the fit explains.
        residual_over_noise: root mean square of what is left over the noise, which is the stated one or else that of
            neighbouring lines; 1 is noise alone.
        stabilisation: the chart.
        damping: where the mirror poles were assumed.
    """

    modes: Modes
    fitted: FrequencyResponses
    evidence: Real
    chi_square_per_line: Real
    degrees_of_freedom: Real
    noise_scale: float
    explained: float
    residual_over_noise: float
    stabilisation: Stabilisation
    damping: DampingKind

    @property
    def quality(self) -> dict[str, float]:
        """Figures for the quality of the fit, as they are stored and shown."""
        return {"explained": self.explained, "residual_over_noise": self.residual_over_noise}

    @property
    def frequency_ci95(self) -> Real:
        """(modes, 2) 95 % interval of the natural frequencies in Hz."""
        return self._interval(self.modes.frequency, 0)

    @property
    def loss_factor_ci95(self) -> Real:
        """(modes, 2) 95 % interval of the loss factors."""
        return self._interval(self.modes.loss_factor, 1)

    def _interval(self, value: Real, offset: int) -> Real:
        assert self.modes.pole_covariance is not None
        deviation = np.sqrt(np.diag(self.modes.pole_covariance)[offset::2])
        half = stdtrit(self.degrees_of_freedom[offset::2], 0.975) * deviation
        return np.stack([value - half, value + half], axis=1)


def estimate_modes(
    responses: FrequencyResponses,
    band: tuple[float, float] | None = None,
    *,
    damping: DampingKind = DampingKind.STRUCTURAL,
    highest_order: int = 60,
) -> ModalEstimate:
    """Poles and shapes of all modes in `band`, with their covariance.

    Args:
        responses: accelerances; their variance is the noise and weighs the lines, their scatter, where there is one,
            gives the covariances. Where the variance is None, noise is estimated from the scatter about the fit, as a
            floor that may vary with frequency and a part proportional to the response. What their window adds to the
            damping is taken out exactly.
        band: lowest and highest frequency in Hz; all lines above 0 Hz by default.
        damping: what the structure's damping is like. It places the mirror poles only: viscously damped modes of loss
            factor 0.11, fitted as structurally damped, come out 0.01 % off in frequency and 0.1 % in loss factor.
        highest_order: of the stabilisation chart; few lines allow less, see `lscf_poles`.

    Raises:
        NoModeError: no mode found, or too few lines in the band.
        AnalysisError: a row has no signal.
    """
    lowest, highest = band if band is not None else (0.0, float(responses.frequency[-1]))
    lines = responses.band(max(lowest, 1e-9), highest)
    if lines.frequency.size == 0:
        raise NoModeError(f"there are no lines between {lowest:g} and {highest:g} Hz")
    _check_signal(lines)
    orders = lscf_poles(lines.frequency, lines.accelerance, highest_order)
    chart = _chart(lines, orders)
    if chart.candidates.size == 0:
        turned = _chart(lines, lscf_poles(lines.frequency, lines.accelerance.conj(), highest_order))
        hint = (
            ""
            if turned.candidates.size == 0
            else f"; their complex conjugate has {turned.candidates.size}: the accelerances seem to be of the time "
            "dependence e^(-i w t), export them for e^(+i w t), with a phase that falls over a resonance"
        )
        raise NoModeError(
            f"no mode between {lowest:g} and {highest:g} Hz: no pole stays put up to order {orders[-1].order}{hint}"
        )
    data = ModalData(lines.frequency, lines.accelerance, standard_deviation(lines), damping, lines.decay)
    if lines.variance is None:
        data, fit = with_unstated_noise(data, chart.candidates, _FIRST_TERMS)
    else:
        fit = resolved(data, chart.candidates, _FIRST_TERMS)
    poles_to_add = _MOST_MISSED if lines.variance is not None else 0
    fit = extended(data, without_idle_modes(data, fit), most_poles=poles_to_add)
    fit = without_idle_modes(data, fit)
    estimate = _estimate(lines, data, fit, chart)
    while lines.variance is None and np.any(doubtful := _doubtful(estimate, data, fit)):
        weakest = int(np.argmin(np.where(doubtful, estimate.evidence, np.inf)))
        if estimate.evidence.size == 1:
            raise NoModeError(f"no mode stands out from the noise between {lowest:g} and {highest:g} Hz")
        fit = resolved(data, np.delete(estimate.modes.poles, weakest), fit.residual_terms.shape[0])
        fit = without_idle_modes(data, fit)
        estimate = _estimate(lines, data, fit, chart)
    return estimate


def _check_signal(lines: FrequencyResponses) -> None:
    """AnalysisError for a row of zeros: it has no noise either, and would outweigh every other row."""
    silent = [str(point) for point, row in zip(lines.inputs, lines.accelerance, strict=True) if not np.any(row)]
    if silent:
        raise AnalysisError(
            f"the accelerance at {', '.join(silent)} is zero on all lines from {lines.frequency[0]:g} to "
            f"{lines.frequency[-1]:g} Hz; leave the row out, or measure the point again"
        )


def _chart(lines: FrequencyResponses, orders: tuple[OrderPoles, ...]) -> Stabilisation:
    """The stabilisation chart of poles that were found on these lines."""
    return read_chart(
        orders,
        lowest=float(lines.frequency[0]),
        highest=float(lines.frequency[-1]),
        line_spacing=float(lines.frequency[1] - lines.frequency[0]),
        decay=lines.decay,
    )


def _doubtful(estimate: ModalEstimate, data: ModalData, fit: ModalFit) -> NDArray[np.bool_]:
    """(modes,) whether the loss factor may be zero and the mode is weak: it does not pay beside what is left there.

    A sharp peak of few lines may have a loss factor within its uncertainty of zero, but it pays.
    """
    left = np.array([residual_correlation(data, fit, pole) for pole in estimate.modes.poles])
    return np.asarray((estimate.loss_factor_ci95[:, 0] <= 0) & (estimate.evidence < left))


def _estimate(lines: FrequencyResponses, data: ModalData, fit: ModalFit, chart: Stabilisation) -> ModalEstimate:
    rising = np.argsort(-(fit.poles**2).real)
    scale = noise_scale(fit)
    poles = fit.poles[rising]
    jacobian = frequency_and_loss_factor_slope(poles)
    pairs = np.stack([2 * rising, 2 * rising + 1], axis=1).ravel()
    slope = np.empty_like(jacobian)
    slope[:, pairs] = jacobian
    if lines.scatter is None:
        covariance, of_constants = slope @ fit.pole_covariance @ slope.T, fit.constants_covariance
        freedom = np.full(2 * poles.size, np.inf)
    else:
        blows = modal_scatter(data, fit, lines.scatter)
        covariance, of_constants = blows.covariance(slope), blows.constants_covariance
        freedom = blows.degrees_of_freedom(slope)
    covariance, shape_covariance = scale * covariance, scale * of_constants[rising]
    if lines.variance is None and len(lines.inputs) > 1:
        between_rows = slope @ fit.pole_covariance_between_rows @ slope.T
        # standard deviations are at least what the rows say; few rows: Student
        student = float(stdtrit(len(lines.inputs) - 1, 0.975)) / Z95
        widening = np.maximum(1.0, student * np.sqrt(np.diag(between_rows) / np.diag(covariance)))
        covariance = covariance * widening * widening[:, None]
        shape_covariance = shape_covariance * np.max(widening.reshape(-1, 2), axis=1)[:, None, None] ** 2
    left = np.abs(lines.accelerance - fit.accelerance)
    modes = Modes(
        poles=poles,
        shapes=fit.constants[rising],
        dofs=lines.inputs,
        pole_covariance=covariance,
        shape_covariance=shape_covariance,
    )
    return ModalEstimate(
        modes=modes,
        fitted=replace(lines, accelerance=fit.accelerance, coherence=None, variance=None, scatter=None),
        evidence=evidence(fit)[rising],
        chi_square_per_line=chi_square_per_line(data, fit),
        degrees_of_freedom=freedom,
        noise_scale=scale,
        explained=float(1 - np.sum(left**2) / np.sum(np.abs(lines.accelerance) ** 2)),
        residual_over_noise=float(np.sqrt(np.mean((left / standard_deviation(lines)) ** 2) / 2)),
        stabilisation=chart,
        damping=data.kind,
    )
