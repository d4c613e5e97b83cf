"""The direct method: dynamic stiffness from one sine record of displacement and force.

With X and F the first harmonics of displacement and force, Eqs. (47) and (48) read

    k_d = F / X = |k_d| e^(i delta) = k + i h = k (1 + i gamma),      gamma = tan delta.

Uncertainty comes from blocks of whole cycles, of which only F_b - k_d X_b counts. k and h are those at the mean
amplitude of the record. Where the amplitude wanders and the specimen softens, a regression over the blocks
(`_at_mean_amplitude`) gives the slope, which takes the wander out of the error, and the mean over a bent curve out of
the value. Intervals are Student's. Their degrees of freedom are the number of blocks less three, or less one where no
regression is made (fewer than five blocks).

k and h describe the specimen only if the first harmonic does. It must have 99 % of the power of either signal, which is
at most 10 % total harmonic distortion (0.1^2 = 1 %). The energy of the measured loop must equal that of the ellipse,
pi X^2 h, to 1 % or to within its scatter, whichever is larger.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from analysis.direct.saturation import saturation
from analysis.direct.sine import FEWEST_TO_SPLIT, SineFit, covariance_of_mean, fit_sine, variance_of_mean
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.interval import Estimate

FIRST_HARMONIC_SHARE = 0.99
LARGEST_DISTORTION = math.sqrt(1 - FIRST_HARMONIC_SHARE)
HUM = "mains hum"
"""First words of a remark about hum."""
SATURATED = "saturated"
"""First word of a remark about a clipped record."""
SMALLEST_SIGNAL = 5.0  # displacement in standard errors; below, the ratio F/X is not nearly normal


@dataclass(frozen=True)
class AppliedCorrection:
    """One parameter of a correction that was applied to a result.

    Attributes:
        effect: that was corrected, such as "frame_compliance".
        parameter: its symbol, such as "c".
        value: in `unit`.
        standard_error: in `unit`; part of the result's covariance.
        unit: SI.
    """

    effect: str
    parameter: str
    value: float
    standard_error: float
    unit: str


@dataclass(frozen=True)
class DynamicStiffness:
    """Dynamic stiffness of a specimen at one frequency and amplitude, Eqs. (47) and (48).

    Attributes:
        frequency: in Hz.
        amplitude_pp: reached peak-to-peak displacement of the first harmonic, in m.
        complex_stiffness: k + i h, in N/m.
        covariance: (2, 2) of [k, h] at `amplitude_pp`, in (N/m)^2.
        degrees_of_freedom: behind the covariance; infinite where it is known in advance.
        amplitude_pp_standard_error: in m, as a sample of how the machine wanders, or None where unknown.
        amplitude_slope: change of k + i h with the logarithm of amplitude within the record, N/m.
        thd_displacement: total harmonic distortion of the displacement, 1, or None where it was not recorded.
        thd_displacement_standard_error: of it, 1, or None where unknown; noise only increases a distortion, so a value
            of a few standard errors may be noise alone.
        thd_force, thd_force_standard_error: the same of the force.
        loop_energy: loop integral of force over displacement with all modelled harmonics, J a cycle, or None where it
            was not recorded.
        loop_energy_excess: loop energy less `first_harmonic_energy` with its standard error, J a cycle, or None.
        corrections: that were applied, in this order; empty as measured.
        shared_errors: errors that other points share, by their source: change of k + i h by one standard deviation of
            the source, in N/m. They are in `covariance` too.
        remarks: shortcomings that the figures above do not show, such as mains hum or a clipped
            record, a sentence each.
    """

    frequency: float
    amplitude_pp: float
    complex_stiffness: complex
    covariance: Real
    degrees_of_freedom: float = math.inf
    amplitude_pp_standard_error: float | None = None
    thd_displacement: float | None = None
    thd_displacement_standard_error: float | None = None
    thd_force: float | None = None
    thd_force_standard_error: float | None = None
    loop_energy: float | None = None
    loop_energy_excess: Estimate | None = None
    corrections: tuple[AppliedCorrection, ...] = ()
    shared_errors: Mapping[str, complex] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    amplitude_slope: complex = 0j

    @property
    def covariance_about_amplitude(self) -> Real:
        """(2, 2) of k and h at the amplitude about which the machine wanders, in (N/m)^2."""
        slope = np.array([self.amplitude_slope.real, self.amplitude_slope.imag])
        relative = (self.amplitude_pp_standard_error or 0.0) / self.amplitude_pp
        return np.asarray(self.covariance + relative**2 * np.outer(slope, slope))

    @property
    def stiffness(self) -> float:
        """k, N/m."""
        return self.complex_stiffness.real

    @property
    def damping(self) -> float:
        """h, N/m."""
        return self.complex_stiffness.imag

    @property
    def magnitude(self) -> float:
        """|k_d|, N/m."""
        return abs(self.complex_stiffness)

    @property
    def loss_angle(self) -> float:
        """delta, rad."""
        return math.atan2(self.damping, self.stiffness)  # cmath.phase overflows where h is subnormal

    @property
    def loss_factor(self) -> float:
        """gamma = tan delta = h / k, dimensionless."""
        return self.damping / self.stiffness

    @property
    def stiffness_estimate(self) -> Estimate:
        """k with its standard error, N/m."""
        return self._estimate(self.stiffness, 1, 0)

    @property
    def damping_estimate(self) -> Estimate:
        """h with its standard error, N/m."""
        return self._estimate(self.damping, 0, 1)

    @property
    def magnitude_estimate(self) -> Estimate:
        """|k_d| with its standard error, N/m."""
        return self._estimate(self.magnitude, self.stiffness / self.magnitude, self.damping / self.magnitude)

    @property
    def loss_angle_estimate(self) -> Estimate:
        """Delta with its standard error, rad."""
        return self._estimate(self.loss_angle, -self.damping / self.magnitude**2, self.stiffness / self.magnitude**2)

    @property
    def loss_factor_estimate(self) -> Estimate:
        """Gamma with its standard error."""
        return self._estimate(self.loss_factor, -self.damping / self.stiffness**2, 1 / self.stiffness)

    def _estimate(self, value: float, by_stiffness: float, by_damping: float) -> Estimate:
        gradient = np.array([by_stiffness, by_damping])
        variance = float(gradient @ self.covariance @ gradient)
        return Estimate(value, math.sqrt(max(variance, 0.0)), self.degrees_of_freedom)

    @property
    def first_harmonic_energy(self) -> float:
        """Energy pi X^2 h of the ellipse that the first harmonics draw, J a cycle."""
        return math.pi * (self.amplitude_pp / 2) ** 2 * self.damping

    @property
    def loop_energy_estimate(self) -> Estimate | None:
        """`loop_energy` with its standard error, J a cycle, from those of amplitude, h and the higher harmonics."""
        if self.loop_energy is None or self.loop_energy_excess is None or self.amplitude_pp_standard_error is None:
            return None
        of_amplitude = 2 * self.first_harmonic_energy * self.amplitude_pp_standard_error / self.amplitude_pp
        of_damping = math.pi * (self.amplitude_pp / 2) ** 2 * self.damping_estimate.standard_error
        error = math.hypot(of_amplitude, of_damping, self.loop_energy_excess.standard_error)
        return Estimate(self.loop_energy, error, self.degrees_of_freedom)

    @property
    def shortcomings(self) -> tuple[str, ...]:
        """Why the first harmonic does not describe the specimen, one sentence each; empty where it does."""
        found = [
            f"total harmonic distortion of the {name} is {100 * thd:.1f} %, above {100 * LARGEST_DISTORTION:.0f} %"
            for name, thd in (("displacement", self.thd_displacement), ("force", self.thd_force))
            if thd is not None and thd > LARGEST_DISTORTION
        ]
        if self.loop_energy is not None and self.loop_energy_excess is not None:
            ellipse = self.first_harmonic_energy
            rounding = 1e-9 * math.pi * (self.amplitude_pp / 2) ** 2 * self.magnitude
            allowed = max((1 - FIRST_HARMONIC_SHARE) * abs(ellipse), self.loop_energy_excess.half_width(), rounding)
            if abs(self.loop_energy_excess.value) > allowed:
                found.append(
                    f"the loop holds {self.loop_energy:.4g} J, the ellipse of the first harmonic {ellipse:.4g} J; "
                    f"they may differ by {allowed:.2g} J"
                )
        return (*found, *self.remarks)

    @property
    def first_harmonic_sufficient(self) -> bool:
        """Whether k, h and gamma describe the specimen; `shortcomings` says why not."""
        return not self.shortcomings

    def with_loop_energy(self) -> DynamicStiffness:
        """The same with the loop energy of its present h and amplitude; its excess over the ellipse stays."""
        if self.loop_energy is None or self.loop_energy_excess is None:
            return self
        return replace(self, loop_energy=self.first_harmonic_energy + self.loop_energy_excess.value)


def dynamic_stiffness(
    displacement: ArrayLike,
    force: ArrayLike,
    sample_rate: float,
    frequency: float,
    *,
    harmonics: int = 5,
    refine: bool = True,
    tones: Sequence[float] = (),
) -> DynamicStiffness:
    """Dynamic stiffness from displacement and force on one clock.

    Args:
        displacement: (samples,) in m, settled.
        force: (samples,) in N, positive along positive displacement.
        sample_rate: in Hz.
        frequency: in Hz, a start value if `refine`.
        harmonics: how many to model, the first included.
        refine: refine the frequency or hold it.
        tones: Hz, of hum beside the sine (`fit_sine`).

    Raises:
        AnalysisError: what `fit_sine` raises; the two records differ in length; or the displacement at this frequency
            is lost in its noise.
    """
    if np.ndim(displacement) != 1 or np.shape(displacement) != np.shape(force):
        raise AnalysisError(
            f"displacement and force have shapes {np.shape(displacement)} and {np.shape(force)}; "
            "both have to be (samples,), on one clock"
        )
    fit = fit_sine(
        np.stack([displacement, force]),
        sample_rate,
        frequency,
        harmonics=harmonics,
        refine=refine,
        names=("displacement", "force"),
        tones=tones,
    )
    motion = abs(fit.first[0])
    noise = max(float(fit.residual_standard_error[0]), float(fit.amplitude_pp_standard_error[0]) / 2)
    if motion < SMALLEST_SIGNAL * noise:
        raise AnalysisError(
            f"the displacement at {fit.frequency:g} Hz is {motion:.3g} m with a standard error of {noise:.3g} m: "
            "lost in noise; raise the amplitude or record more cycles"
        )
    return replace(_from_fit(fit), remarks=_clipped((displacement, force), fit, sample_rate))


def _clipped(signals: Sequence[ArrayLike], fit: SineFit, sample_rate: float) -> tuple[str, ...]:
    """A remark for each signal whose samples pile up at its limit."""
    remarks = []
    for signal, residual, name, unit in zip(signals, fit.residual, ("displacement", "force"), ("m", "N"), strict=True):
        record = np.asarray(signal, dtype=np.float64)
        found = saturation(record, residual, sample_rate / fit.frequency)
        if found is not None:
            remarks.append(
                f"{SATURATED} {name}: {found.samples} of {record.size} samples are at its {found.extreme} of "
                f"{found.value:.4g} {unit}, where a sine has {found.expected} at most; widen the channel's range or "
                "lower the amplitude"
            )
    return tuple(remarks)


def _at_mean_amplitude(fit: SineFit) -> tuple[complex, Real, complex]:
    """k + i h at the mean amplitude of a record, its (2, 2) covariance, and the slope over the logarithm of amplitude.

    Deviations of blocks are regressed on the motion: its size, along which a specimen softens, and its phase, which a
    change of size within a cycle turns, and the next cycle turns back. Noise of the displacement looks like motion that
    the force does not follow, and is added again. With w the relative wander, k (1 + w)^n (1 + w)
    averages to k (1 + n (n + 1) / 2 var(w)).
    """
    stiffness = complex(fit.first[1] / fit.first[0])
    # F_b / X_b - F / X to first order: a change of motion that the force follows cancels
    deviation = (fit.blocks[:, 1, 0] - stiffness * fit.blocks[:, 0, 0]) / fit.first[0]
    count = len(deviation)
    if count < FEWEST_TO_SPLIT or np.ptp(np.abs(fit.blocks[:, 0, 0])) == 0:
        motion = np.abs(fit.blocks[:, 0, 0])
        return stiffness, covariance_of_mean(deviation, motion, fit.cycles_per_block) * fit.tone_inflation, 0j
    relative = fit.blocks[:, 0, 0] / np.mean(fit.blocks[:, 0, 0])
    motion = np.stack([relative.real - 1, relative.imag], axis=1)
    along, *_ = np.linalg.lstsq(motion, deviation - np.mean(deviation), rcond=None)
    left = deviation - np.mean(deviation) - motion @ along
    parts = np.stack([left.real, left.imag])
    noise = float(fit.noise_of_block[0])
    again = abs(stiffness) ** 2 * np.eye(2)
    slope, wander = 0j, 0.0
    spreads = np.var(motion, axis=0, ddof=1)
    # of all of its motion beside the sine: blocks of several cycles do not see that of single ones
    beside = 2 * float(np.mean(fit.residual[0] ** 2)) / abs(fit.first[0]) ** 2 - noise * fit.residual.shape[1] / count
    for number, (followed, by_noise) in enumerate(zip(along.tolist(), (-stiffness, -1j * stiffness), strict=True)):
        spread = float(spreads[number])
        if spread > 2 * noise:
            # where motion is more than its noise, the regression has left a part of that in the rest
            lasting = (followed - by_noise) * spread / (spread - noise)
            again -= (spread - noise) / spread * _outer(lasting)
            if number == 0:
                slope, wander = by_noise + lasting, max(spread - noise, beside * spread / float(np.sum(spreads)))
    size, axes = np.linalg.eigh(again)
    own = parts @ parts.T / (count - 3) + noise * (axes * np.maximum(size, 0.0)) @ axes.T
    # a record that ends at another amplitude than it began with turns F and X by that over 4 pi cycles, each by its own
    ends = (relative.real[-1] - relative.real[0]) ** 2 + 2 * np.mean(np.diff(relative.real) ** 2)
    turned = abs(slope) ** 2 * ends / (4 * math.pi * fit.cycles) ** 2 / 2 * np.eye(2)
    exponent = slope / stiffness
    bent = 1 + wander * exponent * (exponent + 1) / 2
    return stiffness / bent, own / count * fit.tone_inflation + turned, slope


def _outer(value: complex) -> Real:
    return np.outer([value.real, value.imag], [value.real, value.imag])


def _from_fit(fit: SineFit) -> DynamicStiffness:
    stiffness, covariance, slope = _at_mean_amplitude(fit)
    count = len(fit.blocks)
    motion = np.abs(fit.blocks[:, 0, 0])
    ellipse = float(_energies(fit.harmonics[:, :1]))
    loop = float(_energies(fit.harmonics))
    excess = _energies(fit.blocks) - _energies(fit.blocks[:, :, :1])
    distortion = fit.total_harmonic_distortion
    distortion_error = [
        math.sqrt(covariance_of_mean(each.astype(np.complex128), motion, fit.cycles_per_block)[0, 0])
        for each in fit.distortion_deviation.T
    ]
    return DynamicStiffness(
        frequency=fit.frequency,
        amplitude_pp=float(fit.amplitude_pp[0]),
        complex_stiffness=stiffness,
        covariance=covariance,
        amplitude_slope=slope,
        degrees_of_freedom=count - (1 if count < FEWEST_TO_SPLIT else 3),
        amplitude_pp_standard_error=2 * math.sqrt(variance_of_mean(motion, fit.cycles_per_block)),
        thd_displacement=float(distortion[0]),
        thd_displacement_standard_error=distortion_error[0],
        thd_force=float(distortion[1]),
        thd_force_standard_error=distortion_error[1],
        loop_energy=loop,
        loop_energy_excess=Estimate(
            loop - ellipse, math.sqrt(variance_of_mean(excess, fit.cycles_per_block)), count - 1
        ),
    )


def _energies(harmonics: Complex) -> Real:
    """Loop integral of force over displacement, J a cycle, of harmonics (..., 2 signals, harmonics).

    The sum of pi m Im(F_m X_m*) over harmonics m is exact at any sample rate. The polygon through the samples is too
    small by sin(a) / a, with the angle a between samples: 6 % at ten samples a cycle.
    """
    order = np.arange(1, harmonics.shape[-1] + 1)
    product = harmonics[..., 1, :] * harmonics[..., 0, :].conj()
    return np.asarray(math.pi * np.sum(order * product.imag, axis=-1))
