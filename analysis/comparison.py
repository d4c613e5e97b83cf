"""Direct against inverse: one verdict per element of each joint's matrix (Figs. 13, 14).

The inverse test gives one k + i h per joint for its whole band; the tester gives them frequency by frequency, up to
200 Hz, at an amplitude. They are compared at the frequencies of those modes that lie within the tester's band. Where
the direct method gives a fitted law, it is asked there at the amplitude that the blows caused, mode by mode
(`analysis.joint_amplitude`), and what scatters over the blows is part of the direct interval. Where it gives
points, those of the amplitude nearest to that of each mode are taken (the smallest measured unless another one is asked
for), and where no mode lies in the band, their mean over 50 to 200 Hz, above the range in which the paper finds the
stiffness to depend on frequency most. What was done is said in each result.

Two elements differ when zero lies outside of the 95 % interval of their difference, however wide it is: a table in a
wrong unit gives a direct value that is small beside any interval. Where zero lies within, they agree, unless the
interval is so wide that even a joint without the element would have agreed: then they are not comparable. Neither are
loss factors where the direct stiffness may be zero, as the inverse test gives none there either.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from analysis.direct.cylinder_terms import AMPLITUDE_TOLERANCE, JointLaw, JointTerms
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.interval import Estimate
from analysis.inverse.joint_estimate import IdentifiedJoint
from analysis.joint_amplitude import JointAmplitude

FLAT_BAND = (50.0, 200.0)  # Hz
NEAR_BAND = 1.05  # a law is asked at modes this factor outside of the tester's band
UNIT_FACTORS = (1e3, 1e-3)  # what kN for N or mm for m makes of a stiffness
UNIT_TOLERANCE = 1.2  # factor; real joints may differ between the methods
ELEMENTS = ("k11", "k22", "k12", "gamma11", "gamma22", "gamma12")


class Agreement(StrEnum):
    """The outcome of the comparison of one element."""

    AGREE = "agree"
    DIFFER = "differ"
    NOT_COMPARABLE = "not comparable"


@dataclass(frozen=True)
class Bounds:
    """A value and its 95 % interval."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, estimate: Estimate) -> Bounds:
        """Student's interval of an estimate."""
        return cls(estimate.value, *estimate.interval())


@dataclass(frozen=True)
class ElementComparison:
    """One element of one joint's matrix, by both methods.

    Attributes:
        joint: its name, or the names of all joints whose sum is compared, such as "I+II".
        element: k11, k22, k12 in N/m or gamma11, gamma22, gamma12.
        inverse: value and 95 % interval, or None where there is none.
        direct: value and 95 % interval.
        amplitude_pp: at which the direct value was measured or asked for, m.
        amplitude_ci95: its 95 % interval over the blows, m, or None where that is not known.
        basis: at which frequencies and amplitudes, and what these are known from, in words.
        verdict: agree, differ or not comparable.
        reason: the verdict's, in one sentence with figures.
    """

    joint: str
    element: str
    inverse: Bounds | None
    direct: Bounds
    amplitude_pp: float
    amplitude_ci95: tuple[float, float] | None
    basis: str
    verdict: Agreement
    reason: str


def compare(
    direct: Mapping[str, Sequence[JointTerms] | JointLaw],
    inverse: Mapping[str, IdentifiedJoint],
    *,
    mode_frequencies: Sequence[float] = (),
    amplitude_pp: float | Mapping[str, JointAmplitude] | None = None,
    sums: Mapping[str, Bounds] | None = None,
    relative_uncertainty: float = 0.0,
    setup_scatter: float = 0.0,
) -> tuple[ElementComparison, ...]:
    """Compare k11, k22, k12 and their loss factors, joint by joint, and the sum of those not observable singly.

    Args:
        direct: of each joint by its name, either terms from the tester at any frequencies and amplitudes, or a law.
        inverse: what the inverse test identified, by the same names.
        mode_frequencies: of the modes it was identified from, Hz.
        amplitude_pp: where to compare: one for all in m, or by the joint's name one for each of `mode_frequencies`. A
            law is asked there; of points, the measured amplitude nearest to each is taken, the smallest if None.
        sums: of the inverse test, over all joints, by element ("k11", "gamma11" as sum of h over sum of k), where it
            knows them with their correlation. Otherwise k11 is summed here and the half-widths of its intervals are
            added, which holds for any correlation.
        relative_uncertainty: standard deviation of what scales all direct values alike (tester gain, specimens).
        setup_scatter: relative standard deviation of each joint's stiffness from one set-up to another. Each method has
            a set-up of its own, so it counts twice, joint by joint.

    Raises:
        AnalysisError: the two do not name the same joints, a joint has no direct points, or amplitudes do not fit what
            is asked.
    """
    if not inverse or set(direct) != set(inverse):
        raise AnalysisError(
            f"the direct test has joints ({', '.join(sorted(direct))}), the inverse test "
            f"({', '.join(sorted(inverse))}); they have to name the same ones, at least one"
        )
    sums = sums or {}
    modes = np.asarray(mode_frequencies, dtype=np.float64)
    asked = {name: _amplitudes(name, amplitude_pp, modes) for name in inverse}
    series = {name: _series(name, direct[name], modes, asked[name]) for name in inverse}
    of_joint = math.sqrt(2) * setup_scatter
    result = []
    for element in ELEMENTS:
        p, q = int(element[-2]) - 1, int(element[-1]) - 1
        for name, joint in inverse.items():
            value = series[name].estimate(element, math.hypot(relative_uncertainty, of_joint))
            found, missing = _inverse_bounds(joint, element, p, q)
            if not joint.observable[p, q]:
                found, missing = None, f"the inverse test alone does not determine {element} of this joint"
            if not element.startswith("k") and not _is_known(series[name].estimate(f"k{element[-2:]}", 0.0)):
                found, missing = None, f"the direct k{element[-2:]} may be zero, which leaves no loss factor"
            result.append(_judge(name, element, found, missing, value, series[name]))
        observable = all(joint.observable[p, q] for joint in inverse.values())
        if not observable and (element in sums or (p, q) == (0, 0)):
            total = _total(tuple(series.values()), element, relative_uncertainty, of_joint)
            found, missing = _inverse_total(tuple(inverse.values()), element, p, q)
            first = next(iter(series.values()))
            result.append(_judge("+".join(inverse), element, sums.get(element, found), missing, total, first))
    return tuple(result)


def unit_factors(ratios: Mapping[str, Sequence[float]]) -> dict[str, float]:
    """Which power of ten a wrong unit made of the stiffness of a joint: 1000 or 0.001, by the joint's name.

    Args:
        ratios: by joint, inverse over direct stiffness of each element that both methods know.

    Returns:
        Only joints whose median ratio is within 20 % of a factor.
    """
    found = {}
    for name, each in ratios.items():
        middle = float(np.median(np.abs(each))) if each else 1.0
        for factor in UNIT_FACTORS:
            if 1 / UNIT_TOLERANCE <= middle / factor <= UNIT_TOLERANCE:
                found[name] = factor
    return found


@dataclass(frozen=True)
class _Series:
    """Direct terms of one joint, and where to read them."""

    curves: tuple[tuple[JointTerms, ...], ...]  # (frequencies,) each by rising frequency, at the amplitude there
    targets: Real  # (frequencies,) Hz
    basis: str
    amplitude_ci95: tuple[float, float] | None = None

    @property
    def amplitude_pp(self) -> float:
        return float(np.mean([np.mean([point.amplitude_pp for point in curve]) for curve in self.curves]))

    def estimate(self, element: str, relative_uncertainty: float) -> Estimate:
        """Mean over the targets; that it varies among them is part of its error.

        Neighbouring points share specimens and sensors, so their errors are not averaged down.
        """
        stiffness = element.startswith("k")
        values, errors, freedom = np.zeros(len(self.curves)), np.zeros(len(self.curves)), list[float]()
        for place, (target, curve) in enumerate(zip(self.targets, self.curves, strict=True)):
            terms = [getattr(point, f"k{element[-2:]}") for point in curve]
            estimates = [term.stiffness_estimate if stiffness else term.loss_factor_estimate for term in terms]
            frequency = [point.frequency for point in curve]
            values[place] = np.interp(target, frequency, [estimate.value for estimate in estimates])
            errors[place] = np.interp(target, frequency, [estimate.standard_error for estimate in estimates])
            freedom += [estimate.degrees_of_freedom for estimate in estimates]
        value = float(np.mean(values))
        spread = float(np.std(values, ddof=1)) if values.size > 1 else 0.0
        common = relative_uncertainty * value if stiffness else 0.0  # a gain leaves a loss factor alone
        return Estimate(
            value,
            math.hypot(float(np.mean(errors)), spread, common),
            min(freedom),
        )


def _amplitudes(
    name: str, amplitude_pp: float | Mapping[str, JointAmplitude] | None, modes: Real
) -> JointAmplitude | None:
    """The amplitude at which each mode sees the joint, or none where none is given."""
    if amplitude_pp is None:
        return None
    if not isinstance(amplitude_pp, Mapping):
        found = JointAmplitude(np.full(max(modes.size, 1), amplitude_pp))
    elif name not in amplitude_pp:
        raise AnalysisError(f"joint {name} has no amplitude to be compared at; give one for each joint")
    else:
        found = amplitude_pp[name]
        if found.amplitude_pp.size != modes.size:
            raise AnalysisError(
                f"joint {name} has {found.amplitude_pp.size} amplitudes for {modes.size} modes; give one for each"
            )
    if not np.all(found.amplitude_pp > 0):
        raise AnalysisError(
            f"the amplitude to compare joint {name} at is {found.amplitude_pp} m; it has to be positive"
        )
    return found


def _series(name: str, direct: Sequence[JointTerms] | JointLaw, modes: Real, asked: JointAmplitude | None) -> _Series:
    """Pick amplitude and frequencies."""
    if isinstance(direct, JointLaw):
        return _series_of_law(name, direct, modes, asked)
    if not direct:
        raise AnalysisError(f"joint {name} has no point from the direct test")
    smallest = min(point.amplitude_pp for point in direct)
    own = np.full(modes.size, smallest) if asked is None else asked.amplitude_pp[: modes.size]
    curves = [_nearest_amplitude(direct, each) for each in own.tolist()]
    inside = np.array([a[0].frequency <= mode <= a[-1].frequency for mode, a in zip(modes, curves, strict=True)], bool)
    if np.any(inside):
        seen = tuple(curve for curve, is_in in zip(curves, inside, strict=True) if is_in)
        reached = np.array([np.mean([point.amplitude_pp for point in curve]) for curve in seen])
        at = f" and {_in_mm(reached, None)}" if np.ptp(reached) > 0 else ""
        return _Series(seen, modes[inside], f"at the modes {_listed(modes[inside])} Hz{at}")
    near = _nearest_amplitude(direct, smallest if asked is None else float(asked.over_modes.amplitude_pp[0]))
    frequency = np.array([point.frequency for point in near])
    low, high = FLAT_BAND
    flat = frequency[(frequency >= low) & (frequency <= high)]
    if flat.size == 0:
        raise AnalysisError(
            f"joint {name} has no direct point at a mode's frequency nor within {low:g}-{high:g} Hz; "
            f"its points lie between {frequency[0]:g} and {frequency[-1]:g} Hz"
        )
    return _Series(flat.size * (near,), flat, f"mean of {flat.size} points over {flat[0]:g}-{flat[-1]:g} Hz")


def _nearest_amplitude(direct: Sequence[JointTerms], wanted: float) -> tuple[JointTerms, ...]:
    """The points at the measured amplitude nearest to `wanted`, m, by rising frequency."""
    nearest = min((point.amplitude_pp for point in direct), key=lambda amplitude: abs(math.log(amplitude / wanted)))
    near = [point for point in direct if abs(point.amplitude_pp / nearest - 1) < AMPLITUDE_TOLERANCE]
    return tuple(sorted(near, key=lambda point: point.frequency))


def _series_of_law(name: str, law: JointLaw, modes: Real, asked: JointAmplitude | None) -> _Series:
    """The law at the modes near the tester's band, or at all where there are none, at the blows' amplitude."""
    if asked is None or modes.size == 0:
        raise AnalysisError(
            f"joint {name}: a law has to be told mode_frequencies and amplitude_pp, to be asked there; "
            "analysis.joint_amplitude computes the amplitude"
        )
    order = np.argsort(modes)
    low, high = law.frequencies
    near = order[(modes[order] > low / NEAR_BAND) & (modes[order] < high * NEAR_BAND)]
    chosen = near if near.size else order
    frequency, amplitude = modes[chosen], asked.amplitude_pp[chosen]
    error = np.zeros(chosen.size) if asked.log_error is None else asked.log_error[chosen]
    ends = None if asked.ci95 is None else asked.ci95[chosen]
    questions = list(zip(amplitude.tolist(), frequency.tolist(), strict=True))
    beyond = sorted({phrase for question in questions for phrase in law.beyond(*question)})
    return _Series(
        tuple((_scattered(law, *question, each),) for question, each in zip(questions, error.tolist(), strict=True)),
        frequency,
        f"by the fitted law at the modes {_listed(frequency)} Hz and {_in_mm(amplitude, ends)}"
        + (f", {asked.source}" if asked.source else "")
        + "".join(f"; {phrase}" for phrase in beyond),
        None if ends is None else (float(np.mean(ends[:, 0])), float(np.mean(ends[:, 1]))),
    )


def _scattered(law: JointLaw, amplitude_pp: float, frequency: float, log_error: float) -> JointTerms:
    """The law there, with what the standard error of the amplitude's logarithm does to it in the covariance."""
    terms = law.at(amplitude_pp, frequency)
    if log_error == 0:
        return terms
    larger, smaller = (law.at(amplitude_pp * math.exp(step), frequency) for step in (log_error, -log_error))

    def term(which: str) -> DynamicStiffness:
        moved = (getattr(larger, which).complex_stiffness - getattr(smaller, which).complex_stiffness) / 2
        return _moved(getattr(terms, which), moved)

    return JointTerms(term("k11"), term("k22"), term("k12"))


def _moved(term: DynamicStiffness, by: complex) -> DynamicStiffness:
    """The term with an added error of standard deviation `by` in k and h, fully correlated."""
    move = np.array([by.real, by.imag])
    return replace(term, covariance=term.covariance + np.outer(move, move))


def _in_mm(amplitude: Real, ends: Real | None) -> str:
    if ends is None:
        return f"{_listed(1e3 * amplitude, '.2g')} mm"
    written = [
        f"{value:.3g} ({low:.3g} .. {high:.3g})" for value, (low, high) in zip(1e3 * amplitude, 1e3 * ends, strict=True)
    ]
    return f"{', '.join(written)} mm"


def _listed(numbers: Real, style: str = ".1f") -> str:
    return ", ".join(format(number, style) for number in numbers)


def _total(series: tuple[_Series, ...], element: str, relative_uncertainty: float, of_joint: float) -> Estimate:
    """Sum of k over all joints, or sum of h over sum of k; the joints err independently but for what scales all."""
    parts = [each.estimate(element, of_joint) for each in series]
    shares, common = np.ones(len(parts)), relative_uncertainty
    if not element.startswith("k"):
        common = 0.0
        stiffness = np.array([each.estimate(f"k{element[-2:]}", 0.0).value for each in series])
        shares = stiffness / np.sum(stiffness)
    value = float(shares @ [part.value for part in parts])
    return Estimate(
        value,
        math.hypot(float(np.linalg.norm(shares * [part.standard_error for part in parts])), common * value),
        min(part.degrees_of_freedom for part in parts),
    )


def _inverse_bounds(joint: IdentifiedJoint, element: str, p: int, q: int) -> tuple[Bounds | None, str]:
    """Value and interval of one element, or None and the reason why there is none."""
    stiffness = element.startswith("k")
    value = joint.stiffness[p, q] if stiffness else joint.loss_factor[p, q]
    low, high = joint.k_ci95[p, q] if stiffness else joint.loss_factor_ci95[p, q]
    if not np.all(np.isfinite([value, low, high])):
        return None, f"the inverse test gives no finite interval for {element}, as where k may be zero"
    return Bounds(float(value), float(low), float(high)), ""


def _inverse_total(joints: tuple[IdentifiedJoint, ...], element: str, p: int, q: int) -> tuple[Bounds | None, str]:
    """Sum of k over all joints, or sum of h over sum of k; the errors of joints may be correlated in any way."""
    parts = [_inverse_bounds(joint, element, p, q) for joint in joints]
    bounds = [part for part, _ in parts if part is not None]
    if len(bounds) < len(joints):
        return None, next(reason for part, reason in parts if part is None)
    stiffness = np.array([joint.stiffness[p, q] for joint in joints])
    shares = np.ones(len(joints)) if element.startswith("k") else stiffness / np.sum(stiffness)
    value, low, high = (float(shares @ [getattr(part, end) for part in bounds]) for end in ("value", "low", "high"))
    return Bounds(value, low, high), ""


def _judge(
    joint: str, element: str, inverse: Bounds | None, missing: str, direct: Estimate, series: _Series
) -> ElementComparison:
    bounds = Bounds.of(direct)
    verdict, reason = (Agreement.NOT_COMPARABLE, missing) if inverse is None else _verdict(inverse, bounds)
    return ElementComparison(
        joint=joint,
        element=element,
        inverse=inverse,
        direct=bounds,
        amplitude_pp=series.amplitude_pp,
        amplitude_ci95=series.amplitude_ci95,
        basis=series.basis,
        verdict=verdict,
        reason=reason,
    )


def _verdict(inverse: Bounds, direct: Bounds) -> tuple[Agreement, str]:
    difference = inverse.value - direct.value
    # of the inverse interval, which need not be symmetric, the side that faces the direct value
    facing = inverse.value - inverse.low if difference > 0 else inverse.high - inverse.value
    half = math.hypot(facing, direct.high - direct.value)
    wide = half >= abs(direct.value)
    if wide:
        figures = f"inverse less direct is {difference:.3g} +- {half:.3g}"
    else:
        percent = 100 / abs(direct.value)
        figures = f"inverse less direct is {percent * difference:.1f} +- {percent * half:.1f} % of the direct value"
    if abs(difference) > half:
        return Agreement.DIFFER, f"{figures}: zero lies outside"
    if wide:
        return Agreement.NOT_COMPARABLE, f"{figures}, so wide that zero for the element would agree too"
    return Agreement.AGREE, f"{figures}: zero lies within"


def _is_known(stiffness: Estimate) -> bool:
    """Whether zero lies outside of its 95 % interval."""
    low, high = stiffness.interval()
    return low > 0 or high < 0
